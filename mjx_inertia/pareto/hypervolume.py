"""How much of the space of costs a set of rows dominates.

In: costs and a reference point, on the host. Out: the exact hypervolume, by `moocore` (C; Guerreiro
and Fonseca 2018 for four costs, Fonseca et al. 2006 for more).
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
    rows = np.asarray(costs, dtype=np.float64)
    point = np.asarray(reference, dtype=np.float64)
    if not np.all(np.isfinite(point)):
        raise ValueError(f"`reference` {point.tolist()} is not finite")
    rows = rows[np.all(rows < point, axis=1)]
    if np.any(np.isneginf(rows)):
        raise ValueError("`costs` has minus infinity; its hypervolume is infinite")
    return float(moocore.hypervolume(rows, ref=point)) if len(rows) else 0.0
