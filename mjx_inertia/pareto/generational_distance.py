"""How well a set of rows stands for a front that is known.

In: costs and points of the front, on the host. Out: the inverted generational distance, by
`moocore`.
"""

import moocore
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray


def inverted_generational_distance(
    costs: Float[Array | ndarray, "n k"], front: Float[Array | ndarray, "m k"]
) -> float:
    """Mean distance from the points of the front to the nearest row (Coello and Reyes 2004).

    Rows with NaN or an infinity are left out; infinite if no row is left.

    Args:
      costs: the set.
      front: points of the true front, dense against the set.

    Raises:
      ValueError: the front has no point, or one that is not finite.
    """
    rows, points = np.asarray(costs, dtype=np.float64), np.asarray(front, dtype=np.float64)
    if not len(points) or not np.all(np.isfinite(points)):
        raise ValueError(f"`front` {points.shape} must have points, and all finite")
    rows = rows[np.all(np.isfinite(rows), axis=1)]
    return float(moocore.igd(rows, ref=points)) if len(rows) else np.inf
