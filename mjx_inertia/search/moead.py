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
from jaxtyping import Array, Float, Int

from mjx_inertia.search.archive import Archive, ArchiveSettings, add, empty_archive, in_use, scale
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
    """How MOEA/D searches.

    Attributes:
      population: weights, at most; the largest lattice that fits (100 of 100 for two costs, 91 of
        100 for three, 210 of 250 for nine).
      children: made and evaluated together in a generation; the fewer, the sooner each improvement
        is built upon. More than the population are cut to it.
      neighbours: weights whose decisions are parents and may be replaced.
      replacements: at most, by one child.
      decomposition: "tchebycheff", "boundary_intersection" or "weighted_sum".
      normalised: whether costs are divided by their range on the front found so far; needed where
        their units differ.
      variation: how children are made.
      archive: what the result keeps.
    """

    population: int = 100
    children: int = 20
    neighbours: int = 20
    replacements: int = 2
    decomposition: str = "tchebycheff"
    normalised: bool = True
    variation: VariationSettings = field(default_factory=VariationSettings)
    archive: ArchiveSettings = field(default_factory=ArchiveSettings)


@struct.dataclass
class MoeadState:
    """A search under way.

    Attributes:
      key: of the next generation.
      step: generations done.
      evaluations: made.
      decisions: one for each weight.
      held: costs and violations of the decisions; infinite where the evaluation failed.
      ideal: least costs of allowed decisions so far; infinite if there are none.
      archive: of allowed decisions.
    """

    key: Array
    step: Int[Array, ""]
    evaluations: Int[Array, ""]
    decisions: Float[Array, "n d"]
    held: Evaluation
    ideal: Float[Array, " k"]
    archive: Archive


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
      generations: after the first population.
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
    """MOEA/D as a start and a step, for `run_search`.

    Attributes:
      problem: to be searched.
      settings: of the search.
    """

    problem: Problem
    settings: MoeadSettings

    def start(self, key: Array) -> MoeadState:
        """Decisions spread over the box, one for each weight, evaluated."""
        subproblems = self._subproblems()
        key, draw = jax.random.split(key)
        decisions = latin_hypercube(self.problem, len(subproblems.weights), key=draw)
        found = evaluate_all(self.problem, decisions)
        none = empty_archive(self.settings.archive, decisions[0], len(self.problem.cost_names))
        archive = add(none, decisions, found, subproblems.weights, self.settings.archive)
        count = jnp.array(len(decisions))
        ideal = least_costs(found)
        return MoeadState(key, jnp.zeros_like(count), count, decisions, found, ideal, archive)

    def step(self, state: MoeadState) -> MoeadState:
        """A generation: children, evaluated together; then who stays."""
        subproblems = self._subproblems()
        key, draw = jax.random.split(state.key)
        owners = self._owners(state)
        made = children(
            state.decisions,
            (state.archive.decisions, in_use(state.archive)),
            (owners, jnp.asarray(subproblems.near)[owners]),
            (jnp.asarray(self.problem.lower), jnp.asarray(self.problem.upper)),
            self.settings.variation,
            key=draw,
        )
        found = evaluate_all(self.problem, made)
        archive = add(state.archive, made, found, subproblems.weights, self.settings.archive)
        ideal = jnp.minimum(state.ideal, least_costs(found))
        span = scale(archive, ideal) if self.settings.normalised else jnp.ones_like(ideal)
        child = replaced(subproblems, state.held, found, owners, (ideal, span))
        stays = child < 0
        return MoeadState(
            key,
            state.step + 1,
            state.evaluations + len(owners),
            jnp.where(stays[:, None], state.decisions, made[child]),
            Evaluation(
                jnp.where(stays[:, None], state.held.costs, found.costs[child]),
                jnp.where(stays, state.held.violation, found.violation[child]),
            ),
            ideal,
            archive,
        )

    def _owners(self, state: MoeadState) -> Int[Array, " c"]:
        """The weights whose turn it is to have a child."""
        population = len(state.decisions)
        size = min(self.settings.children, population)
        return (state.step * size + jnp.arange(size)) % population

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
        return Subproblems(weights, near, of_one, settings.replacements)
