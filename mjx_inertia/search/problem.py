"""What is searched: decisions within bounds, several costs of each, and whether it is allowed.

In: a pure function of one decision. Out: evaluations of many at once in which failures are marked,
so that no search has to look for NaN; decisions drawn over the bounds; free variables for searches
that know no bounds; a problem with a single cost.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

_AUGMENTATION = 1e-3  # share of the mean, so that of equal greatest parts the better rest wins


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
    """An evaluation in which failures are infinite and no violation is below 0."""
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
    """Least of each cost among allowed decisions; infinite if there are none."""
    allowed = (found.violation == 0.0)[:, None]
    return jnp.min(jnp.where(allowed, found.costs, jnp.inf), axis=0)


def into_box(problem: Problem, free: Float[Array, " d"]) -> Float[Array, " d"]:
    """The decision for a free variable: from 0 to 1 the box is crossed once, and then back.

    A sine, so that a search that steps over a bound comes back inside, and one that tends to the
    bound arrives there with finite numbers.
    """
    lower, upper = jnp.asarray(problem.lower), jnp.asarray(problem.upper)
    return lower + (upper - lower) * 0.5 * (1.0 - jnp.cos(jnp.pi * free))


def out_of_box(problem: Problem, decision: Float[Array, " d"]) -> Float[Array, " d"]:
    """The free variable from 0 to 1 of a decision; `into_box` backwards."""
    lower, upper = jnp.asarray(problem.lower), jnp.asarray(problem.upper)
    share = jnp.clip((decision - lower) / (upper - lower), 0.0, 1.0)
    return jnp.arccos(1.0 - 2.0 * share) / jnp.pi


def latin_hypercube(
    problem: Problem, count: int, *, key: Array, spread: float = 1.0
) -> Float[Array, "n d"]:
    """Decisions of which each variable has one in each of n equal slices of its range.

    McKay, Beckman and Conover 1979, Technometrics 21(2). `spread` is the share of the range, about
    its middle, that is covered.
    """
    lower, upper = jnp.asarray(problem.lower), jnp.asarray(problem.upper)
    within, order = jax.random.split(key)
    shape = (count, problem.dimension)
    rows = jnp.broadcast_to(jnp.arange(count)[:, None], shape)
    slices = jax.random.permutation(order, rows, axis=0, independent=True)
    place = (slices + jax.random.uniform(within, shape, lower.dtype)) / count
    place = 0.5 + spread * (place - 0.5)
    return lower + place * (upper - lower)


def toward(problem: Problem, wish: Float[ndarray, " k"]) -> Problem:
    """The problem of making the worst cost, over what is wished for it, least.

    At most 1 means that every wish is met. Evaluations keep their violation. The problem's costs
    are not negative.

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
