"""CMA-ES, differential evolution and others of `evosax`, one search for each direction of costs.

In: a problem, settings, a key. Out: an archive of decisions that none dominates. Each direction's
costs become one by a decomposition, all strategies step at the same time, and their populations are
evaluated in one batch.
"""

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.search.archive import (
    Archive,
    ArchiveSettings,
    cost_range,
    empty_archive,
    in_use,
    update_archive,
)
from mjx_inertia.search.decomposition import decomposition, spread_weights
from mjx_inertia.search.loop import Recording, SearchResult, run_search
from mjx_inertia.search.problem import (
    Evaluation,
    Problem,
    evaluate_all,
    into_box,
    latin_hypercube,
    least_costs,
    out_of_box,
)

# levels of single costs, each above all of the one before: what is stored in one generation is
# compared with what comes in later ones
_NOT_ALLOWED, _FAILED, _UNKNOWN = 2.0, 4.0, 5.0


@dataclass(frozen=True)
class StrategySettings:
    """How strategies search."""

    # of any algorithm in `evosax`, such as "CMA_ES", "DifferentialEvolution" or "Sep_CMA_ES"
    name: str = "CMA_ES"
    weights: int = 20  # directions, at most; the largest lattice that fits
    population: int = 12  # of each direction's strategy
    # of the first population of strategies that have one, in ranges of the box
    initial_deviation: float = 0.2
    decomposition: str = "tchebycheff"  # "tchebycheff", "boundary_intersection" or "weighted_sum"
    archive: ArchiveSettings = field(default_factory=ArchiveSettings)  # what the result keeps


@struct.dataclass
class StrategyState:
    """A search under way."""

    key: Array  # of the next generation
    step: Int[Array, ""]  # generations done
    evaluations: Int[Array, ""]  # made
    strategies: Any  # state of `evosax`, one for each weight
    ideal: Float[Array, " k"]  # least costs that single costs are measured from
    scale: Float[Array, " k"]  # what they are divided by
    archive: Archive  # of allowed decisions


def evolution_strategies(
    problem: Problem,
    settings: StrategySettings,
    generations: int,
    *,
    key: Array,
    recording: Recording | None = None,
) -> SearchResult:
    """Searches by one strategy for each direction; the arguments are those of `moead`.

    Strategies that sample from a distribution start with means drawn at random. Their single costs
    are measured from the ideal point of each generation; those with a population keep the values of
    its members, so they stay with the ideal point of the generation that first finds a front. Their
    first population is drawn and not evaluated: whatever it breeds takes its place.

    Raises:
      ValueError: no such algorithm, or as `moead`.
    """
    return run_search(Strategies(problem, settings), generations, key, recording)


@dataclass(frozen=True)
class Strategies:
    """One strategy for each weight as a start and a step, for `run_search`."""

    problem: Problem  # to be searched
    settings: StrategySettings  # of the search

    def start(self, key: Array) -> StrategyState:
        """A strategy for each direction, its mean or its population drawn over the box."""
        weights, (strategy, params) = self._weights(), self._strategy()
        count = len(weights)
        key, draw, begin = jax.random.split(key, 3)
        keys = jax.random.split(begin, count)
        each = self.settings.population if _has_population(strategy) else 1
        decisions = latin_hypercube(self.problem, count * each, key=draw)
        free = jax.vmap(lambda x: out_of_box(self.problem, x))(decisions)
        if _has_population(strategy):
            unknown = jnp.full((count, each), _UNKNOWN, free.dtype)
            run = jax.vmap(lambda k, x, f: strategy.init(k, x, f, params))
            strategies = run(keys, free.reshape(count, each, -1), unknown)
        else:
            strategies = jax.vmap(lambda k, x: strategy.init(k, x, params))(keys, free)
        costs = weights.shape[1]
        return StrategyState(
            key,
            jnp.array(0),
            jnp.array(0),
            jax.tree.map(jnp.asarray, strategies),
            jnp.full(costs, jnp.inf, free.dtype),
            jnp.ones(costs, free.dtype),
            empty_archive(self.settings.archive, decisions[0], costs),
        )

    def step(self, state: StrategyState) -> StrategyState:
        """A generation of each strategy."""
        weights, (strategy, params) = self._weights(), self._strategy()
        count = len(weights)
        key, *draws = jax.random.split(state.key, 3)
        asking, telling = (jax.random.split(draw, count) for draw in draws)
        ask = jax.vmap(lambda k, s: strategy.ask(k, s, params))
        free, strategies = ask(asking, state.strategies)
        flat = free.reshape(-1, self.problem.dimension)
        decisions = jax.vmap(lambda x: into_box(self.problem, x))(flat)
        found = evaluate_all(self.problem, decisions)
        archive = update_archive(state.archive, decisions, found, weights, self.settings.archive)
        ideal = jnp.minimum(state.ideal, least_costs(found))
        span = cost_range(archive, ideal)
        if _has_population(strategy):
            known = in_use(state.archive) > 1
            ideal = jnp.where(known, state.ideal, ideal)
            span = jnp.where(known, state.scale, span)
        single = self._single(weights, found, (ideal, span))
        tell = jax.vmap(lambda k, x, f, s: strategy.tell(k, x, f, s, params)[0])
        told = tell(telling, free, single, strategies)
        # a strategy gives back other types than it began with, where a constant is its state
        told = jax.tree.map(lambda new, old: jnp.asarray(new, old.dtype), told, state.strategies)
        made = state.evaluations + len(flat)
        return StrategyState(key, state.step + 1, made, told, ideal, span, archive)

    def _single(
        self,
        weights: Float[ndarray, "w k"],
        found: Evaluation,
        scaling: tuple[Float[Array, " k"], Float[Array, " k"]],
    ) -> Float[Array, "w p"]:
        """One number of each decision: below 1 if allowed, then not allowed, then failed."""
        of_one = decomposition(self.settings.decomposition)
        whole = jnp.where(jnp.isfinite(found.costs), found.costs, 0.0)
        ideal = jnp.where(jnp.isfinite(scaling[0]), scaling[0], 0.0)
        shape = (len(weights), -1)
        costs = whole.reshape(*shape, weights.shape[1])
        value = jax.vmap(lambda w, some: jax.vmap(lambda c: of_one(c, w, ideal, scaling[1]))(some))(
            jnp.asarray(weights), costs
        )
        violation = found.violation.reshape(shape)
        beyond = _NOT_ALLOWED + violation / (1.0 + violation)
        ranked = jnp.where(violation == 0.0, value / (1.0 + jnp.abs(value)), beyond)
        return jnp.where(jnp.isfinite(violation), ranked, _FAILED)

    def _weights(self) -> Float[ndarray, "w k"]:
        return spread_weights(len(self.problem.cost_names), self.settings.weights)

    def _strategy(self) -> tuple[Any, Any]:
        from evosax.algorithms import algorithms  # noqa: PLC0415  (its import begins JAX)

        settings = self.settings
        if settings.name not in algorithms:
            raise ValueError(f"`name` {settings.name!r} is not one of {sorted(algorithms)}")
        with jax.ensure_compile_time_eval():
            one = jnp.zeros_like(jnp.asarray(self.problem.lower))
            try:
                strategy = algorithms[settings.name](
                    population_size=settings.population, solution=one
                )
            except TypeError as error:
                raise ValueError(
                    f"`name` {settings.name!r} takes arguments that no setting gives ({error}); "
                    "choose another"
                ) from None
            params = strategy.default_params
            if hasattr(params, "std_init"):
                params = params.replace(std_init=jnp.asarray(settings.initial_deviation))
        return strategy, params


def _has_population(strategy: Any) -> bool:
    return not hasattr(strategy, "get_mean")
