"""How far the neighbours of a row are on its front.

In: costs and fronts. Out: crowding distances, by which a diverse part of a front is chosen.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int


def crowding_distance(costs: Float[Array, "n k"], ranks: Int[Array, " n"]) -> Float[Array, " n"]:
    """Half the circumference of the cuboid between the neighbours of each row on its front.

    Each cost is divided by its range on the front (Deb et al. 2002, Sec. III.B); the least and the
    greatest row of a cost are infinitely far. Of equal rows one may get all of the distance. A cost
    that is infinite or alike on the whole front adds nothing.

    Args:
      costs: lower is better.
      ranks: front of each row, as from `non_dominated_ranks`; unranked rows get 0.
    """
    total = jnp.zeros(costs.shape[0], dtype=costs.dtype)
    for column in range(costs.shape[1]):
        total += _along(costs[:, column], ranks)
    return jnp.where(ranks >= 0, total, 0.0)


def _along(cost: Float[Array, " n"], ranks: Int[Array, " n"]) -> Float[Array, " n"]:
    count = cost.shape[0]
    order = jnp.lexsort((cost, ranks))
    value, rank = cost[order], ranks[order]
    first = jnp.concatenate([jnp.array([True]), rank[1:] != rank[:-1]])
    last = jnp.concatenate([first[1:], jnp.array([True])])
    fronts = jnp.cumsum(first) - 1
    low = jax.ops.segment_min(value, fronts, count, indices_are_sorted=True)[fronts]
    high = jax.ops.segment_max(value, fronts, count, indices_are_sorted=True)[fronts]
    span = high - low
    usable = jnp.isfinite(span) & (span > 0.0)
    gap = jnp.roll(value, -1) - jnp.roll(value, 1)
    inner = jnp.where(usable, gap / jnp.where(usable, span, 1.0), 0.0)
    return jnp.zeros_like(cost).at[order].set(jnp.where(first | last, jnp.inf, inner))
