"""What is searched: decisions within bounds, several costs of each, and whether it is allowed.

In: a pure function of one decision. Out: evaluations of many at once in which failures are marked,
so that no search has to look for NaN.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray


class Evaluation(NamedTuple):
    """Costs of decisions."""

    costs: Float[Array, "*n k"]  # lower is better; rows with a NaN or an infinity count as failed
    # 0 where the decision is allowed, else how far it is from being so; infinite or NaN where the
    # evaluation failed
    violation: Float[Array, "*n"]


@dataclass(frozen=True, eq=False)
class Problem:
    """Costs of a decision within bounds; compiled programs are kept for each `Problem` made.

    Raises:
      ValueError: the bounds are not finite, of different shapes or in the wrong order, or there is
        no cost.
    """

    # of one decision; pure and, for searches by gradient, differentiable
    evaluate: Callable[[Float[Array, " d"]], Evaluation]
    lower: Float[ndarray, " d"]  # least decision
    upper: Float[ndarray, " d"]  # greatest decision
    cost_names: tuple[str, ...]  # of the k costs
    # of many decisions, where there is a faster way than `jax.vmap(evaluate)`; for example shared
    # over cores
    evaluate_many: Callable[[Float[Array, "n d"]], Evaluation] | None = None

    def __post_init__(self) -> None:
        lower, upper = np.asarray(self.lower), np.asarray(self.upper)
        if lower.ndim != 1 or lower.shape != upper.shape:
            raise ValueError(
                f"`lower` {lower.shape} and `upper` {upper.shape} must be vectors of one length"
            )
        wrong = np.flatnonzero(~(np.isfinite(lower) & np.isfinite(upper) & (lower < upper)))
        if len(wrong):
            i = int(wrong[0])
            raise ValueError(
                f"`lower`[{i}] = {lower[i]} must be below `upper`[{i}] = {upper[i]}, both finite"
            )
        if not self.cost_names:
            raise ValueError("`cost_names` is empty; name at least one cost")

    @property
    def dimension(self) -> int:
        """How many numbers a decision has."""
        return len(self.lower)


def evaluate_all(problem: Problem, decisions: Float[Array, "n d"]) -> Evaluation:
    """Evaluates many decisions; those that failed get infinite costs and infinite violation.

    Raises:
      ValueError: the problem returns another number of costs than it names.
    """
    run = problem.evaluate_many or jax.vmap(problem.evaluate)
    return mark_failures(problem, run(decisions))


def mark_failures(problem: Problem, found: Evaluation) -> Evaluation:
    """An evaluation in which failures are infinite and no violation is below 0.

    Args:
      problem: whose number of costs is expected.
      found: of one decision or of many.
    """
    costs, violation = found
    if costs.shape[-1] != len(problem.cost_names):
        raise ValueError(
            f"`evaluate` returned {costs.shape[-1]} costs, but `cost_names` are "
            f"{problem.cost_names}; they must be as many"
        )
    whole = jnp.all(jnp.isfinite(costs), axis=-1) & jnp.isfinite(violation)
    return Evaluation(
        jnp.where(whole[..., None], costs, jnp.inf),
        jnp.where(whole, jnp.maximum(violation, 0.0), jnp.inf),
    )


def least_costs(found: Evaluation) -> Float[Array, " k"]:
    """Least of each cost among allowed decisions; infinite if there are none.

    Args:
      found: at many decisions.
    """
    allowed = (found.violation == 0.0)[:, None]
    return jnp.min(jnp.where(allowed, found.costs, jnp.inf), axis=0)
