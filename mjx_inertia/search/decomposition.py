"""Many costs as one number, by a direction in which the trade-off is sought.

In: how many costs and directions. Out: weights w, evenly spread, not negative and with sum 1.
In: costs, a direction, the ideal point and a scale of each cost. Out: a number, lower is better.
All work on z = (costs - ideal) / scale, so that costs of different units weigh alike. Zhang and Li
2007, "MOEA/D", IEEE TEC 11(6), Sec. II.
"""

import itertools
import math
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpy import ndarray

_TWO_LAYERS_FROM = 5  # costs: with fewer, one layer of some hundred weights has inner weights
_LEAST_WEIGHT = 1e-2  # a direction along an axis would not see the other costs at all
_AUGMENTATION = 1e-3  # share of the sum, so that of equal greatest parts the better rest wins
_PBI_PENALTY = 5.0  # Zhang and Li 2007, Sec. V.D

Decomposition = Callable[
    [Float[Array, " k"], Float[Array, " k"], Float[Array, " k"], Float[Array, " k"]],
    Float[Array, ""],
]


def lattice_size(costs: int, divisions: int) -> int:
    """How many weights `simplex_lattice` returns."""
    return math.comb(divisions + costs - 1, costs - 1)


def simplex_lattice(costs: int, divisions: int) -> Float[ndarray, "n k"]:
    """All weights that are multiples of 1 / divisions and sum to 1, in lexicographic order.

    Das and Dennis 1998, "Normal-boundary intersection", SIAM J. Optim. 8(3), Sec. 4.

    Raises:
      ValueError: no cost or no division.
    """
    if costs < 1 or divisions < 1:
        raise ValueError(f"`costs` {costs} and `divisions` {divisions} must be at least 1")
    bars = itertools.combinations(range(divisions + costs - 1), costs - 1)
    cuts = np.array(list(bars), dtype=np.int64).reshape(-1, costs - 1)
    ends = np.full((len(cuts), 1), divisions + costs - 1)
    parts = np.diff(np.concatenate([np.full_like(ends, -1), cuts, ends], axis=1), axis=1) - 1
    return parts / divisions


def two_layer_lattice(costs: int, outer: int, inner: int) -> Float[ndarray, "n k"]:
    """A lattice and, halfway to the centre, a second one.

    With many costs an affordable lattice has all its weights on the border of the simplex; the
    inner layer has some within (Deb and Jain 2014, NSGA-III, IEEE TEC 18(4), Sec. IV.B). `outer`
    are the divisions of the lattice over the whole simplex, `inner` those of the one of half its
    size.
    """
    half = 0.5 * simplex_lattice(costs, inner) + 0.5 / costs
    return np.concatenate([simplex_lattice(costs, outer), half])


def spread_weights(costs: int, at_most: int) -> Float[ndarray, "n k"]:
    """The largest lattice of no more than so many weights: of one layer, or from five costs of two.

    Two layers have divisions p and p - 1, the usual choice. The lattice has, for example, 100
    weights of 100 for two costs, 91 of 100 for three and 210 of 250 for nine.

    Raises:
      ValueError: fewer weights than costs.
    """
    if at_most < costs:
        raise ValueError(f"{at_most} weights for {costs} costs; allow at least {costs}")
    if costs == 1:
        return np.ones((1, 1))
    outer = 1
    while _layers_size(costs, outer + 1) <= at_most:
        outer += 1
    if costs < _TWO_LAYERS_FROM or outer == 1:
        return simplex_lattice(costs, outer)
    return two_layer_lattice(costs, outer, outer - 1)


def nearest_weights(weights: Float[ndarray, "n k"], count: int) -> Int[ndarray, "n t"]:
    """For each weight those nearest to it, itself first.

    Raises:
      ValueError: more than there are weights.
    """
    if not 1 <= count <= len(weights):
        raise ValueError(f"`count` {count} of nearest weights must be from 1 to {len(weights)}")
    square = np.sum((weights[:, None] - weights[None]) ** 2, axis=2)
    return np.argsort(square, axis=1, kind="stable")[:, :count]


def _layers_size(costs: int, outer: int) -> int:
    if costs < _TWO_LAYERS_FROM:
        return lattice_size(costs, outer)
    return lattice_size(costs, outer) + lattice_size(costs, outer - 1)


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
