"""Non-dominated sorting of tens of thousands of rows, in memory that grows with their number only.

One row dominates another if it is nowhere greater and somewhere smaller. Equal rows do not dominate
each other, infinities are ordered like numbers, and a row with a NaN takes no part.
In: a table of costs, lower is better. Out: which rows no other dominates, or the front of each row.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

UNRANKED = -1  # the front of a row that takes no part
NONE = -1  # no row, where every row failed
_BLOCK = 128


def dominates(better: Float[Array, "m k"], worse: Float[Array, "n k"]) -> Bool[Array, "m n"]:
    """Whether row i of `better` dominates row j of `worse`."""
    nowhere_greater = jnp.ones((better.shape[0], worse.shape[0]), dtype=bool)
    somewhere_smaller = ~nowhere_greater
    for column in range(better.shape[1]):  # a loop keeps the table of pairs two-dimensional
        a, b = better[:, None, column], worse[None, :, column]
        nowhere_greater &= a <= b
        somewhere_smaller |= a < b
    return nowhere_greater & somewhere_smaller


def is_non_dominated(costs: Float[Array, "n k"]) -> Bool[Array, " n"]:
    """Whether no row dominates a row; False for rows with a NaN.

    Looks at all pairs, in blocks.
    """
    blocks = _padded(costs).reshape(-1, _BLOCK, costs.shape[1])
    beaten = jax.lax.map(lambda block: jnp.any(dominates(costs, block), axis=0), blocks)
    return ~beaten.ravel()[: costs.shape[0]] & ~_has_nan(costs)


def non_dominated_ranks(costs: Float[Array, "n k"]) -> Int[Array, " n"]:
    """The front of each row, from 0; `UNRANKED` for rows with a NaN.

    Front 0 are the rows that none dominates, front 1 those that only front 0 dominates, and so on
    (Deb et al. 2002, "A fast and elitist multiobjective genetic algorithm: NSGA-II", IEEE TEC 6(2),
    Sec. III.A). The front of a row is the length of the longest chain of rows that dominate one
    another and it. In lexicographic order a row comes after all that dominate it, so one pass over
    blocks of rows finds all fronts; the work is that of all pairs, however many fronts there are.
    """
    count = costs.shape[0]
    order = jnp.lexsort(costs.T[::-1])
    rows = _padded(costs[order])
    starts = jnp.arange(0, rows.shape[0], _BLOCK)

    def rank_block(ranks: Int[Array, " m"], start: Int[Array, ""]) -> tuple[Int[Array, " m"], None]:
        block = jax.lax.dynamic_slice_in_dim(rows, start, _BLOCK)
        # rows not yet ranked have UNRANKED + 1 = 0 and change nothing
        least = jnp.max(jnp.where(dominates(rows, block), ranks[:, None] + 1, 0), axis=0)
        return jax.lax.dynamic_update_slice(ranks, _chains(block, least), (start,)), None

    unranked = jnp.full(rows.shape[0], UNRANKED, dtype=jnp.int32)
    ranks, _ = jax.lax.scan(rank_block, unranked, starts)
    in_place = jnp.zeros(count, dtype=jnp.int32).at[order].set(ranks[:count])
    return jnp.where(_has_nan(costs), UNRANKED, in_place)


def _chains(block: Float[Array, "b k"], least: Int[Array, " b"]) -> Int[Array, " b"]:
    """Fronts of the rows of one block that are at least `least`."""
    within = dominates(block, block)

    def lengthen(state: tuple[Int[Array, " b"], Bool[Array, ""]]) -> tuple[Array, Array]:
        ranks, _ = state
        longer = jnp.max(jnp.where(within, ranks[:, None] + 1, 0), axis=0)
        longer = jnp.maximum(ranks, longer)
        return longer, jnp.any(longer != ranks)

    start = (least.astype(jnp.int32), jnp.array(True))
    return jax.lax.while_loop(lambda state: state[1], lengthen, start)[0]


def _padded(costs: Float[Array, "n k"]) -> Float[Array, "m k"]:
    """Filled up to whole blocks with rows that take no part."""
    missing = -costs.shape[0] % _BLOCK
    return jnp.pad(costs, ((0, missing), (0, 0)), constant_values=jnp.nan)


def _has_nan(costs: Float[Array, "n k"]) -> Bool[Array, " n"]:
    return jnp.any(jnp.isnan(costs), axis=1)
