"""Costs of many rows at once: which dominate, which are on the front and which to take.

In: a table of costs, one row a candidate and one column a cost, lower is better; NaN or infinite is
a failure. Out: rows, or how good a set of rows is. Failed rows are never chosen; a failure in one
column is one of the row wherever this column counts. One row dominates another if it is nowhere
greater and somewhere smaller; equal rows do not dominate each other.

Fronts, hypervolumes and distances are those of `moocore` (C): exact hypervolumes by Guerreiro and
Fonseca 2018 for four costs and Fonseca et al. 2006 for more, approximate ones by Deng and Zhang
2019, "Approximating hypervolume and hypervolume contributions using polar coordinate", IEEE TEC
23(5), on a lattice of directions.
"""

from collections.abc import Sequence

import jax.numpy as jnp
import moocore
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from numpy import ndarray

NONE = -1  # no row, where every row failed


def dominates(better: Float[Array, "m k"], worse: Float[Array, "n k"]) -> Bool[Array, "m n"]:
    """Whether row i of `better` dominates row j of `worse`."""
    nowhere_greater = jnp.ones((better.shape[0], worse.shape[0]), dtype=bool)
    somewhere_smaller = ~nowhere_greater
    for column in range(better.shape[1]):  # a loop keeps the table of pairs two-dimensional
        a, b = better[:, None, column], worse[None, :, column]
        nowhere_greater &= a <= b
        somewhere_smaller |= a < b
    return nowhere_greater & somewhere_smaller


def pareto_set(
    costs: Float[Array | ndarray, "n k"], columns: Sequence[int] | None = None
) -> Int[ndarray, " m"]:
    """Rows that no other dominates in the given columns (None: all), ascending, on the host.

    Raises:
      ValueError: no column, or one that the table does not have.
    """
    counted = _counted(costs, columns)
    rows = np.flatnonzero(np.isfinite(counted).all(axis=1))
    return rows[moocore.is_nondominated(counted[rows], keep_weakly=True)] if len(rows) else rows


def knee(costs: Float[Array | ndarray, "n k"], columns: Sequence[int] | None = None) -> int:
    """The row of the Pareto set that gives up least of everything; `NONE` where all failed.

    The farthest below the plane through the ends of the front (Das 1999, "On characterizing the
    knee of the Pareto curve"): with each cost from 0 to 1 over the Pareto set, the least sum.

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


def hypervolume(
    costs: Float[Array | ndarray, "n k"], reference: Float[Array | ndarray, " k"]
) -> float:
    """Volume between the reference point and what the rows dominate, in the product of the units.

    Rows that are not better than the reference in every cost add nothing, nor do rows with NaN,
    and dominated and equal rows are allowed. Exact for any number of costs; fast up to five.

    Raises:
      ValueError: the reference is not finite, or a cost is minus infinity.
    """
    rows, point = _within(costs, reference)
    return float(moocore.hypervolume(rows, ref=point)) if len(rows) else 0.0


def approximate_hypervolume(
    costs: Float[Array | ndarray, "n k"], reference: Float[Array | ndarray, " k"]
) -> float:
    """The same for many costs, two at least, without noise: the same rows have the same volume.

    Raises:
      ValueError: as `hypervolume`.
    """
    rows, point = _within(costs, reference)
    if not len(rows):
        return 0.0
    # in units of the reference: directions are spread evenly over all costs
    low = np.min(rows, axis=0)
    share = moocore.hv_approx((rows - low) / (point - low), ref=1.0)
    return float(share * np.prod(point - low))


def inverted_generational_distance(
    costs: Float[Array | ndarray, "n k"], front: Float[Array | ndarray, "m k"]
) -> float:
    """Mean distance from the points of the front to the nearest row (Coello and Reyes 2004).

    The front is to be dense against the rows. Rows with NaN or an infinity are left out; infinite
    if no row is left.

    Raises:
      ValueError: the front has no point, or one that is not finite.
    """
    rows, points = np.asarray(costs, dtype=np.float64), np.asarray(front, dtype=np.float64)
    if not len(points) or not np.all(np.isfinite(points)):
        raise ValueError(f"`front` {points.shape} must have points, and all finite")
    rows = rows[np.all(np.isfinite(rows), axis=1)]
    return float(moocore.igd(rows, ref=points)) if len(rows) else np.inf


def _counted(
    costs: Float[Array | ndarray, "n k"], columns: Sequence[int] | None
) -> Float[ndarray, "n _"]:
    """The columns that count."""
    table = np.asarray(costs, dtype=np.float64)
    chosen = list(range(table.shape[1])) if columns is None else list(columns)
    if not chosen or not all(0 <= column < table.shape[1] for column in chosen):
        raise ValueError(f"`columns` {chosen}: expected some of 0 to {table.shape[1] - 1}")
    return table[:, chosen]


def _within(
    costs: Float[Array | ndarray, "n k"], reference: Float[Array | ndarray, " k"]
) -> tuple[Float[ndarray, "m k"], Float[ndarray, " k"]]:
    """Rows that are better than the reference in every cost."""
    rows = np.asarray(costs, dtype=np.float64)
    point = np.asarray(reference, dtype=np.float64)
    if not np.all(np.isfinite(point)):
        raise ValueError(f"`reference` {point.tolist()} is not finite")
    rows = rows[np.all(rows < point, axis=1)]
    if np.any(np.isneginf(rows)):
        raise ValueError("`costs` has minus infinity; its hypervolume is infinite")
    return rows, point
