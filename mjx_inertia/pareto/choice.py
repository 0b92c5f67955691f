"""Which of many rows to take.

In: a table of costs, one row per candidate and one column per metric, lower is better; NaN or
infinite is a failure. Out: rows. Failed rows are never chosen, and a failure in one column is a
failure of the row for every choice that looks at this column.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from numpy import ndarray

from mjx_inertia.pareto.dominance import NONE, is_non_dominated, non_dominated_ranks


def succeeded(costs: Float[Array | ndarray, "n k"]) -> Bool[Array, " n"]:
    """Whether all costs of a row are finite."""
    return jnp.all(jnp.isfinite(costs), axis=1)


def best_per_metric(costs: Float[Array | ndarray, "n k"]) -> Int[Array, " k"]:
    """For each metric the row of least cost (the first of equals); `NONE` where all failed."""
    usable = jnp.where(jnp.isfinite(costs), costs, jnp.inf)
    best = jnp.argmin(usable, axis=0)
    return jnp.where(jnp.any(jnp.isfinite(costs), axis=0), best, NONE)


def normalised(costs: Float[Array | ndarray, "n k"]) -> Float[Array, "n k"]:
    """Each cost from 0 for the least to 1 for the greatest of the rows that succeeded.

    A cost that is alike for all becomes 0, those of failed rows NaN.
    """
    valid = succeeded(costs)[:, None]
    low = jnp.min(jnp.where(valid, costs, jnp.inf), axis=0)
    span = jnp.max(jnp.where(valid, costs, -jnp.inf), axis=0) - low
    alike = ~(span > 0.0)
    return jnp.where(valid, (costs - low) / jnp.where(alike, 1.0, span), jnp.nan)


def weighted_choice(
    costs: Float[Array | ndarray, "n k"], weights: Float[Array | ndarray, " k"]
) -> Int[Array, ""]:
    """The row of least weighted sum of `normalised` costs; `NONE` where all failed.

    A cost of weight 0 counts for nothing, not even as a failure.

    Args:
      costs: the table.
      weights: not negative.
    """
    counted = jnp.where(weights > 0.0, costs, 0.0)
    total = jnp.sum(weights * normalised(counted), axis=1)
    usable = jnp.isfinite(total)
    best = jnp.argmin(jnp.where(usable, total, jnp.inf))
    return jnp.where(jnp.any(usable), best, NONE)


_on_front = jax.jit(is_non_dominated)
_fronts = jax.jit(non_dominated_ranks)


def pareto_set(
    costs: Float[Array | ndarray, "n k"], columns: Sequence[int] | None = None
) -> Int[ndarray, " m"]:
    """Rows that no other beats in the given columns, in ascending order, on the host.

    Args:
      costs: the table.
      columns: which metrics count; all if None.

    Raises:
      ValueError: no column, or one that the table does not have.
    """
    return np.flatnonzero(np.asarray(_on_front(jnp.asarray(_counted(costs, columns)))))


def pareto_ranks(
    costs: Float[Array | ndarray, "n k"], columns: Sequence[int] | None = None
) -> Int[ndarray, " n"]:
    """Front of each row in the given columns, from 0; `UNRANKED` for failed rows.

    Args:
      costs: the table.
      columns: which metrics count; all if None.

    Raises:
      ValueError: as `pareto_set`.
    """
    return np.asarray(_fronts(jnp.asarray(_counted(costs, columns))))


def knee(costs: Float[Array | ndarray, "n k"], columns: Sequence[int] | None = None) -> int:
    """The row of the Pareto set that gives up least of everything; `NONE` where all failed.

    The farthest below the plane through the ends of the front (Das 1999, "On characterizing the
    knee of the Pareto curve"): with each cost from 0 to 1 over the Pareto set, the least sum.

    Args:
      costs: the table.
      columns: which metrics count; all if None.

    Raises:
      ValueError: as `pareto_set`.
    """
    rows = pareto_set(costs, columns)
    if not len(rows):
        return NONE
    front = _counted(costs, columns)[rows]
    span = np.ptp(front, axis=0)
    scaled = (front - front.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    return int(rows[np.argmin(scaled.sum(axis=1))])


def _counted(
    costs: Float[Array | ndarray, "n k"], columns: Sequence[int] | None
) -> Float[ndarray, "n _"]:
    """The columns that count, with failed rows NaN."""
    table = np.asarray(costs)
    chosen = list(range(table.shape[1])) if columns is None else list(columns)
    if not chosen or not all(0 <= column < table.shape[1] for column in chosen):
        raise ValueError(f"`columns` {chosen}: expected some of 0 to {table.shape[1] - 1}")
    table = table[:, chosen]
    failed = ~np.all(np.isfinite(table), axis=1)
    return np.where(np.expand_dims(failed, 1), np.nan, table)
