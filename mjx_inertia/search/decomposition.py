"""Many costs as one number, by a direction in which the trade-off is sought.

In: costs, the direction w (not negative, sums to 1), the ideal point and a scale of each cost.
Out: a number, lower is better. All work on z = (costs - ideal) / scale, so that costs of different
units weigh alike. Zhang and Li 2007, "MOEA/D", IEEE TEC 11(6), Sec. II.
"""

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, Float

_LEAST_WEIGHT = 1e-2  # a direction along an axis would not see the other costs at all
_AUGMENTATION = 1e-3  # share of the sum, so that of equal greatest parts the better rest wins
_PBI_PENALTY = 5.0  # Zhang and Li 2007, Sec. V.D

Decomposition = Callable[
    [Float[Array, " k"], Float[Array, " k"], Float[Array, " k"], Float[Array, " k"]],
    Float[Array, ""],
]


def tchebycheff(
    costs: Float[Array, " k"],
    weight: Float[Array, " k"],
    ideal: Float[Array, " k"],
    scale: Float[Array, " k"],
) -> Float[Array, ""]:
    """Greatest of z_i / w_i, and a little of their sum.

    With the weight in the denominator the least value on a front lies where the front meets the
    ray z = t w (Qi et al. 2014, "MOEA/D with adaptive weight adjustment", Evol. Comput. 22(2)), so
    even weights give an even set; Zhang and Li multiply.
    """
    ratio = (costs - ideal) / (scale * jnp.maximum(weight, _LEAST_WEIGHT))
    return jnp.max(ratio) + _AUGMENTATION * jnp.mean(ratio)


def weighted_sum(
    costs: Float[Array, " k"],
    weight: Float[Array, " k"],
    ideal: Float[Array, " k"],
    scale: Float[Array, " k"],
) -> Float[Array, ""]:
    """Sum of w_i z_i; finds the convex parts of a front only."""
    return jnp.sum(weight * (costs - ideal) / scale)


def boundary_intersection(
    costs: Float[Array, " k"],
    weight: Float[Array, " k"],
    ideal: Float[Array, " k"],
    scale: Float[Array, " k"],
) -> Float[Array, ""]:
    """PBI: the way along the direction and five times the distance from it."""
    z = (costs - ideal) / scale
    direction = weight / jnp.sqrt(jnp.sum(weight * weight))
    along = jnp.sum(z * direction)
    off = z - along * direction
    return along + _PBI_PENALTY * jnp.sqrt(jnp.sum(off * off))


DECOMPOSITIONS: dict[str, Decomposition] = {
    "tchebycheff": tchebycheff,
    "weighted_sum": weighted_sum,
    "boundary_intersection": boundary_intersection,
}


def decomposition(name: str) -> Decomposition:
    """The function of that name.

    Raises:
      ValueError: there is none.
    """
    if name not in DECOMPOSITIONS:
        raise ValueError(f"`decomposition` {name!r} is not one of {sorted(DECOMPOSITIONS)}")
    return DECOMPOSITIONS[name]
