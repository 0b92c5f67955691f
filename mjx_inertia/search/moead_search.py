"""MOEA/D: many costs divided into many single ones, each solved with the help of its neighbours.

Zhang and Li 2007, "MOEA/D: a multiobjective evolutionary algorithm based on decomposition", IEEE
TEC 11(6). A generation here makes some children first and evaluates them in one batch; then, child
by child, they replace decisions of the population. Beside the population is an archive: it is the
result, so the weights need not fit the shape of the front, and most parents come from it (Cai, Li,
Fan and Zhang 2015, "An external archive guided multiobjective evolutionary algorithm based on
decomposition", IEEE TEC 19(4)). Feasibility rules (Deb 2000, Comput. Methods Appl. Mech. Eng. 186):
less violation wins; of two allowed decisions the better by the weight's single cost.
In: a problem, settings, a key. Out: an archive of decisions that none dominates.
"""

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int
from numpy import ndarray

from mjx_inertia.search.archive import (
    Archive,
    ArchiveSettings,
    cost_range,
    empty_archive,
    in_use,
    update_archive,
)
from mjx_inertia.search.decomposition import (
    Decomposition,
    decomposition,
    nearest_weights,
    spread_weights,
)
from mjx_inertia.search.loop import Recording, SearchResult, run_search
from mjx_inertia.search.problem import (
    Evaluation,
    Problem,
    evaluate_all,
    latin_hypercube,
    least_costs,
)
from mjx_inertia.search.variation import VariationSettings, children


@dataclass(frozen=True)
class MoeadSettings:
    """How MOEA/D searches."""

    # weights, at most; the largest lattice that fits (100 of 100 for two costs, 91 of 100 for
    # three, 210 of 250 for nine)
    population: int = 100
    # made and evaluated together in a generation; the fewer, the sooner each improvement is built
    # upon. More than the population are cut to it.
    children: int = 20
    neighbours: int = 20  # weights whose decisions are parents and may be replaced
    replacements: int = 2  # at most, by one child
    decomposition: str = "tchebycheff"  # "tchebycheff", "boundary_intersection" or "weighted_sum"
    # whether costs are divided by their range on the front found so far; needed where their units
    # differ
    normalised: bool = True
    variation: VariationSettings = field(default_factory=VariationSettings)  # how children are made
    archive: ArchiveSettings = field(default_factory=ArchiveSettings)  # what the result keeps


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


@struct.dataclass
class MoeadState:
    """A search under way."""

    key: Array  # of the next generation
    step: Int[Array, ""]  # generations done; below 0 while the first decisions are evaluated
    evaluations: Int[Array, ""]  # made
    decisions: Float[Array, "n d"]  # one for each weight
    # costs and violations of the decisions; infinite where the evaluation failed or is yet to come
    held: Evaluation
    ideal: Float[Array, " k"]  # least costs of allowed decisions so far; infinite if there are none
    archive: Archive  # of allowed decisions


def moead(
    problem: Problem,
    settings: MoeadSettings,
    generations: int,
    *,
    key: Array,
    recording: Recording | None = None,
) -> SearchResult:
    """Searches by MOEA/D.

    One compiled program; with a checkpoint or a report one for each part of the run, the same for
    all parts. Without them it may be traced and `vmap`ped, over keys for example.

    Args:
      problem: to be searched.
      settings: of the search.
      generations: after those that evaluate the first population, which are as many as it needs.
      key: the same key gives the same result.
      recording: what is kept and told on the way.

    Raises:
      ValueError: settings that cannot be, or a checkpoint that is damaged or of another search.
    """
    return run_search(Moead(problem, settings), generations, key, recording)


@dataclass(frozen=True)
class Moead:
    """MOEA/D as a start and a step, for `run_search`."""

    problem: Problem  # to be searched
    settings: MoeadSettings  # of the search

    def start(self, key: Array) -> MoeadState:
        """Decisions spread over the box, one for each weight, not evaluated yet.

        The first generations do that: costs that take long to compile are compiled once.
        """
        weights = self._subproblems().weights
        count, costs = len(weights), len(self.problem.cost_names)
        key, draw = jax.random.split(key)
        decisions = latin_hypercube(self.problem, count, key=draw)
        unknown = jnp.full((count, costs), jnp.inf, decisions.dtype)
        none = empty_archive(self.settings.archive, decisions[0], costs)
        made, first = jnp.array(0), jnp.array(-self._first_generations(count))
        held = Evaluation(unknown, unknown[:, 0])
        return MoeadState(key, first, made, decisions, held, unknown[0], none)

    def step(self, state: MoeadState) -> MoeadState:
        """A generation: children, evaluated together; then who stays."""
        subproblems = self._subproblems()
        key, draw = jax.random.split(state.key)
        owners, first = self._owners(state)
        made = children(
            state.decisions,
            (state.archive.decisions, in_use(state.archive)),
            (owners, jnp.asarray(subproblems.near)[owners]),
            (jnp.asarray(self.problem.lower), jnp.asarray(self.problem.upper)),
            self.settings.variation,
            key=draw,
        )
        made = jnp.where(first[:, None], state.decisions[owners], made)
        found = evaluate_all(self.problem, made)
        held = jax.tree.map(
            lambda old, new: old.at[owners].set(jnp.where(_as(first, new), new, old[owners])),
            state.held,
            found,
        )
        archive = update_archive(
            state.archive, made, found, subproblems.weights, self.settings.archive
        )
        ideal = jnp.minimum(state.ideal, least_costs(found))
        span = cost_range(archive, ideal) if self.settings.normalised else jnp.ones_like(ideal)
        offered = found._replace(violation=jnp.where(first, jnp.inf, found.violation))
        child = replaced(subproblems, held, offered, owners, (ideal, span))

        def next_of(old: Array, new: Array) -> Array:
            return jnp.where(_as(child < 0, old), old, new[child])

        return MoeadState(
            key,
            state.step + 1,
            state.evaluations + len(owners),
            next_of(state.decisions, made),
            jax.tree.map(next_of, held, found),
            ideal,
            archive,
        )

    def _owners(self, state: MoeadState) -> tuple[Int[Array, " c"], Bool[Array, " c"]]:
        """The weights whose turn it is to have a child, and whose own decision comes first."""
        population = len(state.decisions)
        size = min(self.settings.children, population)
        turn = (state.step + self._first_generations(population)) * size + jnp.arange(size)
        return turn % population, turn < population

    def _first_generations(self, population: int) -> int:
        """As many as evaluate the first population."""
        return -(-population // min(self.settings.children, population))

    def _subproblems(self) -> Subproblems:
        settings = self.settings
        if min(settings.children, settings.neighbours, settings.replacements) < 1:
            raise ValueError(
                f"`children` {settings.children}, `neighbours` {settings.neighbours} and "
                f"`replacements` {settings.replacements} must be at least 1"
            )
        weights = spread_weights(len(self.problem.cost_names), settings.population)
        near = nearest_weights(weights, min(settings.neighbours, len(weights)))
        of_one = decomposition(settings.decomposition)
        directed = settings.decomposition != "weighted_sum"
        return Subproblems(weights, near, of_one, settings.replacements, directed)


def _as(flags: Bool[Array, " n"], like: Array) -> Bool[Array, "..."]:
    """Flags of rows, to be broadcast over all that a row has."""
    return flags.reshape(-1, *[1] * (like.ndim - 1))


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
    `owners` are the subproblems that the children were made for; `scaling` is ideal point and
    scale.
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
