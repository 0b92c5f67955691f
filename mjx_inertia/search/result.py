"""What every search returns, and how good it was along the way.

In: an archive and copies of it made during the search. Out: rows on the host, and the hypervolume
against the number of evaluations.
"""

import jax
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.pareto import approximate_hypervolume, hypervolume

_EXACT = 5  # costs, at most: beyond, the exact volume of 100 rows takes minutes


@struct.dataclass
class History:
    """Copies of the archive's costs at s times."""

    evaluations: Int[Array, " s"]  # made until then
    costs: Float[Array, "s m k"]  # infinite in unused rows


@struct.dataclass
class SearchResult:
    """Decisions that do not dominate each other."""

    decisions: Float[Array, "m d"]  # zero in unused rows
    costs: Float[Array, "m k"]  # infinite in unused rows
    violation: Float[Array, " m"]  # 0; infinite in unused rows
    evaluations: Int[Array, ""]  # made in all; one of a gradient with its value counts as one
    history: History  # of the costs

    def front(self) -> tuple[Float[ndarray, "n d"], Float[ndarray, "n k"]]:
        """Decisions and costs of the rows in use, on the host, by the first cost.

        Raises:
          ValueError: the result is of many searches at once; take one of them first.
        """
        if np.ndim(self.violation) != 1:
            raise ValueError(
                f"`violation` has shape {np.shape(self.violation)}: results of many searches; take "
                "one with jax.tree.map(lambda x: x[i], result)"
            )
        decisions, costs, violation = jax.device_get((self.decisions, self.costs, self.violation))
        used = np.flatnonzero(violation == 0.0)
        rows = used[np.lexsort(costs[used].T[::-1])]
        return decisions[rows], costs[rows]


def progress(
    result: SearchResult, reference: Float[Array | ndarray, " k"]
) -> tuple[Int[ndarray, " s"], Float[ndarray, " s"]]:
    """Evaluations made and the hypervolume of the archive at each copy in the history.

    With more than five costs the volume is an approximation, see `approximate_hypervolume`.

    Args:
      result: of one search.
      reference: worse than what counts in every cost.
    """
    evaluations, costs = jax.device_get((result.history.evaluations, result.history.costs))
    measure = hypervolume if costs.shape[-1] <= _EXACT else approximate_hypervolume
    return evaluations, np.array([measure(rows, reference) for rows in costs])
