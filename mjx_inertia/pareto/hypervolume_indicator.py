"""How much of the space of costs a set of rows dominates.

In: costs and a reference point, on the host. Out: the hypervolume, by `moocore` (C): exact
(Guerreiro and Fonseca 2018 for four costs, Fonseca et al. 2006 for more), or for many costs to a
fraction of a percent (Deng and Zhang 2019, "Approximating hypervolume and hypervolume contributions
using polar coordinate", IEEE TEC 23(5), on a lattice of directions).
"""

import moocore
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray


def hypervolume(
    costs: Float[Array | ndarray, "n k"], reference: Float[Array | ndarray, " k"]
) -> float:
    """Volume between the reference point and what the rows dominate, in the product of the units.

    Rows that are not better than the reference in every cost add nothing, nor do rows with NaN.
    Exact for any number of costs; fast up to five.

    Args:
      costs: lower is better; dominated and equal rows are allowed.
      reference: worse than what counts in every cost.

    Raises:
      ValueError: the reference is not finite, or a cost is minus infinity.
    """
    rows, point = _within(costs, reference)
    return float(moocore.hypervolume(rows, ref=point)) if len(rows) else 0.0


def approximate_hypervolume(
    costs: Float[Array | ndarray, "n k"], reference: Float[Array | ndarray, " k"]
) -> float:
    """The same for many costs, without noise: the same rows have the same volume.

    Args:
      costs: as of `hypervolume`; at least two.
      reference: as of `hypervolume`.

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
