"""From many costs to one that says how far a decision is from what is wished for.

In: a problem and a wish for each of its costs. Out: a problem with one cost, for any search here;
its decisions are those of the first. A front of many costs is too large to be covered; a wish says
which part of it matters (Wierzbicki 1980, "The use of reference objectives in multiobjective
optimization").
"""

import dataclasses
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

from mjx_inertia.search.problem import Evaluation, Problem

_AUGMENTATION = 1e-3  # share of the mean, so that of equal greatest parts the better rest wins


def toward(problem: Problem, wish: Float[ndarray, " k"]) -> Problem:
    """The problem of making the worst cost, over what is wished for it, least.

    At most 1 means that every wish is met. Evaluations keep their violation.

    Args:
      problem: with costs that are not negative.
      wish: for each cost, more than zero.

    Raises:
      ValueError: not a positive number for each cost.
    """
    wished = np.asarray(wish, float)
    if wished.shape != (len(problem.cost_names),) or not np.all((wished > 0) & (wished < np.inf)):
        raise ValueError(
            f"`wish` is {wished.tolist()}: expected a positive number for each of "
            f"{', '.join(problem.cost_names)}"
        )

    def worst(found: Evaluation) -> Evaluation:
        shares = found.costs / jnp.asarray(wished, found.costs.dtype)
        value = jnp.max(shares, -1) + _AUGMENTATION * jnp.mean(shares, -1)
        return Evaluation(value[..., None], found.violation)

    def over(run: Callable[[Array], Evaluation]) -> Callable[[Array], Evaluation]:
        return lambda decisions: worst(run(decisions))

    many = problem.evaluate_many
    return dataclasses.replace(
        problem,
        evaluate=over(problem.evaluate),
        evaluate_many=None if many is None else over(many),
        cost_names=("worst_share",),
    )
