"""Which decisions of a population the children replace, child by child.

In: population and children with their costs, weights. Out: for each weight the child that takes its
place. Feasibility rules (Deb 2000, Comput. Methods Appl. Mech. Eng. 186): less violation wins; of
two allowed decisions the better by the weight's single cost.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.search.decomposition import Decomposition
from mjx_inertia.search.problem import Evaluation


@dataclass(frozen=True, eq=False)
class Subproblems:
    """The single costs that a search divides its costs into."""

    weights: Float[ndarray, "n k"]  # one a subproblem
    near: Int[ndarray, "n t"]  # those nearest to each, itself first
    of_one: Decomposition  # the single cost
    replacements: int  # at most, by one child
    # whether the least single cost lies where the costs are in the direction of the weight. Not so
    # for a weighted sum, whose greatest weight asks for the least cost.
    by_direction: bool = True


def replaced(
    subproblems: Subproblems,
    held: Evaluation,
    found: Evaluation,
    owners: Int[Array, " c"],
    scaling: tuple[Float[Array, " k"], Float[Array, " k"]],
) -> Int[Array, " n"]:
    """The child that takes the place of each decision, or -1.

    A child is offered to the weights around the one in whose direction its costs lie (Wang et al.
    2014, "A replacement strategy for balancing convergence and diversity in MOEA/D", IEEE CEC), the
    nearest first; if it is not allowed, or the weights are no directions, to those around its own.

    Args:
      subproblems: one for each decision.
      held: by the population.
      found: at the children.
      owners: the subproblem that each child was made for.
      scaling: ideal point and scale of the costs.
    """
    weights = jnp.asarray(subproblems.weights)
    ideal, scale = scaling

    def single(costs: Float[Array, " k"], weight: Float[Array, " k"]) -> Float[Array, ""]:
        whole = jnp.where(jnp.isfinite(costs), costs, 0.0)  # the violation tells which failed
        return subproblems.of_one(whole, weight, ideal, scale)

    centres = _centres(weights, found, owners, scaling) if subproblems.by_direction else owners
    offered = jnp.asarray(subproblems.near)[centres]
    value = jax.vmap(jax.vmap(single, (None, 0)))(found.costs, weights[offered])

    def offer(
        so_far: tuple[Array, Array, Array], child: tuple[Array, Array, Array, Array]
    ) -> tuple[tuple[Array, Array, Array], None]:
        values, violations, taken_by = so_far
        number, places, new, violation = child
        old, other, taken = _at(values, places), _at(violations, places), _at(taken_by, places)
        allowed = (violation == 0.0) & (other == 0.0)
        better = (violation < other) | (allowed & (new < old))
        takes = better & (jnp.cumsum(better) <= subproblems.replacements)
        return (
            _set(values, places, jnp.where(takes, new, old)),
            _set(violations, places, jnp.where(takes, violation, other)),
            _set(taken_by, places, jnp.where(takes, number, taken)),
        ), None

    start = (jax.vmap(single)(held.costs, weights), held.violation, jnp.full(len(weights), -1))
    offers = (jnp.arange(len(owners)), offered, value, found.violation)
    return jax.lax.scan(offer, start, offers)[0][2]


def _centres(
    weights: Float[Array, "n k"],
    found: Evaluation,
    owners: Int[Array, " c"],
    scaling: tuple[Float[Array, " k"], Float[Array, " k"]],
) -> Int[Array, " c"]:
    """The weight nearest in direction to the costs of each child; its own if it is not allowed."""
    ideal, scale = scaling
    allowed = found.violation == 0.0
    z = jnp.where(allowed[:, None], (found.costs - ideal) / scale, 0.0)
    direction = weights / jnp.linalg.norm(weights, axis=1, keepdims=True)
    return jnp.where(allowed, jnp.argmax(z @ direction.T, axis=1), owners)


def _at(row: Array, places: Int[Array, " t"]) -> Array:
    return row.at[places].get(mode="promise_in_bounds", unique_indices=True)


def _set(row: Array, places: Int[Array, " t"], new: Array) -> Array:
    return row.at[places].set(new, mode="promise_in_bounds", unique_indices=True)
