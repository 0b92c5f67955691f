"""MOEA/D: many costs divided into many single ones, each solved with the help of its neighbours.

Zhang and Li 2007, "MOEA/D: a multiobjective evolutionary algorithm based on decomposition", IEEE
TEC 11(6). A generation here makes some children first and evaluates them in one batch. Beside the
population is an archive: it is the result, so the weights need not fit the shape of the front, and
most parents come from it (Cai, Li, Fan and Zhang 2015, "An external archive guided multiobjective
evolutionary algorithm based on decomposition", IEEE TEC 19(4)).
In: a problem, settings, a key. Out: an archive of decisions that none dominates.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.search.archive import (
    Archive,
    ArchiveSettings,
    cost_range,
    empty_archive,
    in_use,
    update_archive,
)
from mjx_inertia.search.decomposition import decomposition
from mjx_inertia.search.loop import run_search
from mjx_inertia.search.problem import Evaluation, Problem, evaluate_all, least_costs
from mjx_inertia.search.replacement import Subproblems, replaced
from mjx_inertia.search.result import SearchResult
from mjx_inertia.search.sampling import latin_hypercube
from mjx_inertia.search.variation import VariationSettings, children
from mjx_inertia.search.weights import nearest_weights, spread_weights


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
    snapshots: int = 20,
    checkpoint: Path | None = None,
    report: Callable[[SearchResult], None] | None = None,
) -> SearchResult:
    """Searches by MOEA/D.

    One compiled program; with `checkpoint` or `report` one for each part of the run, the same for
    all parts. Without them it may be traced and `vmap`ped, over keys for example.

    Args:
      problem: to be searched.
      settings: of the search.
      generations: after those that evaluate the first population, which are as many as it needs.
      key: the same key gives the same result.
      snapshots: how many times the archive is copied into the history.
      checkpoint: file to which the search is written at each snapshot; if it is there and of the
        same search, the search goes on from it.
      report: called at each snapshot with the result so far.

    Raises:
      ValueError: settings that cannot be, or a checkpoint that is damaged or of another search.
    """
    method = Moead(problem, settings)
    return run_search(
        method,
        generations,
        key=key,
        snapshots=snapshots,
        checkpoint=checkpoint,
        report=report,
    )


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
