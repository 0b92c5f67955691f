"""Gradient descent from many starts on smooth single costs, one for each direction.

In: a problem whose costs are differentiable, settings, a key. Out: an archive of all points visited
that none dominates.
"""

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import optax
from flax import struct
from jaxtyping import Array, Bool, Float, Int
from numpy import ndarray

from mjx_inertia.search.archive import (
    Archive,
    ArchiveSettings,
    cost_range,
    empty_archive,
    update_archive,
)
from mjx_inertia.search.decomposition import spread_weights
from mjx_inertia.search.loop import Recording, SearchResult, run_search
from mjx_inertia.search.problem import (
    Evaluation,
    Problem,
    into_box,
    latin_hypercube,
    least_costs,
    mark_failures,
    out_of_box,
)

_LEAST_WEIGHT = 1e-2  # a direction along an axis would not see the other costs at all


@dataclass(frozen=True)
class GradientSettings:
    """How gradients are followed."""

    weights: int = 20  # directions, at most; the largest lattice that fits
    starts: int = 2  # of each direction, drawn at random
    # share of the box, about its middle, from which starts are drawn; less where most of the box is
    # not allowed
    spread: float = 1.0
    # "adam", or "lbfgs" with a line search, for costs without noise or kinks
    optimizer: str = "adam"
    learning_rate: float = 0.05  # of Adam, in ranges of the box; falls to 0 along a cosine
    # of the greatest weighted cost, in ranges of the costs; 0.05 rounds the corner where two costs
    # are equally bad
    smoothing: float = 0.05
    penalty: float = 10.0  # of a violation of 1, in ranges of the costs
    archive: ArchiveSettings = field(default_factory=ArchiveSettings)  # what the result keeps


@struct.dataclass
class GradientState:
    """A search under way."""

    step: Int[Array, ""]  # steps done
    evaluations: Int[Array, ""]  # made; a value with its gradient counts as one
    free: Float[Array, "n d"]  # variables of each start, without bounds; weights before starts
    optimizer: Any  # state of each start
    # whether a start still moves; False once a value or a gradient was not finite
    going: Bool[Array, " n"]
    ideal: Float[Array, " k"]  # least costs of allowed decisions so far; infinite if there are none
    archive: Archive  # of allowed decisions


def gradient_descent(
    problem: Problem,
    settings: GradientSettings,
    steps: int,
    *,
    key: Array,
    recording: Recording | None = None,
) -> SearchResult:
    """Searches by gradients from all starts of all directions; the arguments are those of `moead`.

    `problem.evaluate_many` is not used. A start whose cost or gradient is not finite ends there,
    the others go on. Where the last step leads is not evaluated.

    Raises:
      ValueError: no such optimizer, or as `moead`.
    """
    return run_search(Gradients(problem, settings, steps), steps, key, recording)


def smooth_tchebycheff(
    costs: Float[Array, " k"],
    weight: Float[Array, " k"],
    scaling: tuple[Float[Array, " k"], Float[Array, " k"]],
    smoothing: float,
) -> Float[Array, ""]:
    """μ log Σ exp(λ_i z_i / μ), z = (costs - ideal) / scale: the greatest λ_i z_i made smooth.

    Lin, Zhang, Yang, Liu, Wang and Zhang 2024, "Smooth Tchebycheff scalarization for multi-
    objective optimization", ICML. λ_i is the greatest weight over w_i, so that as in `tchebycheff`
    the weight is the direction in which the search ends. `scaling` is the ideal point and the
    scale, `smoothing` is μ; the value is above the greatest by at most μ log k.
    """
    ideal, span = scaling
    w = jnp.maximum(weight, _LEAST_WEIGHT)
    z = jnp.max(w) / w * (costs - ideal) / span
    return smoothing * jax.nn.logsumexp(z / smoothing)


@dataclass(frozen=True)
class Gradients:
    """All starts as a start and a step, for `run_search`."""

    problem: Problem  # to be searched
    settings: GradientSettings  # of the search
    steps: int  # in all, for the fall of the learning rate

    def start(self, key: Array) -> GradientState:
        """All starts, not evaluated yet."""
        weights = self._weights()
        decisions = latin_hypercube(
            self.problem, len(weights), key=key, spread=self.settings.spread
        )
        free = jax.vmap(lambda x: out_of_box(self.problem, x))(decisions)
        made = jnp.array(0)
        return GradientState(
            made,
            made,
            free,
            jax.vmap(self._optimizer().init)(free),
            jnp.ones(len(weights), dtype=bool),
            jnp.full(weights.shape[1], jnp.inf, free.dtype),
            empty_archive(self.settings.archive, decisions[0], weights.shape[1]),
        )

    def step(self, state: GradientState) -> GradientState:
        """A step of every start that still goes."""
        weights = jnp.asarray(self._weights())
        # forward first: what a cost counts for depends on those of all starts
        (costs, violation), back, decisions = jax.vjp(
            jax.vmap(self._evaluated), state.free, has_aux=True
        )
        found = mark_failures(self.problem, Evaluation(costs, violation))
        archive = update_archive(state.archive, decisions, found, weights, self.settings.archive)
        ideal = jnp.minimum(state.ideal, least_costs(found))
        scaling = (jnp.where(jnp.isfinite(ideal), ideal, 0.0), cost_range(archive, ideal))

        def single(costs: Array, violation: Array, weight: Array) -> Float[Array, ""]:
            value = smooth_tchebycheff(costs, weight, scaling, self.settings.smoothing)
            return value + self.settings.penalty * jnp.maximum(violation, 0.0)

        value, pull = jax.vmap(jax.value_and_grad(single, (0, 1)))(costs, violation, weights)
        (slope,) = back(pull)

        def one(free: Array, memory: Any, weight: Array, value: Array, slope: Array) -> tuple:
            def again(x: Float[Array, " d"]) -> Float[Array, ""]:
                (costs, violation), _ = self._evaluated(x)
                return single(costs, violation, weight)

            move, after = self._optimizer().update(
                slope, memory, free, value=value, grad=slope, value_fn=again
            )
            moved = jnp.asarray(optax.apply_updates(free, move))
            finite = jnp.isfinite(value) & jnp.all(jnp.isfinite(slope) & jnp.isfinite(moved))
            return finite, moved, after, _line_search_steps(after)

        finite, free, memory, searched = jax.vmap(one)(
            state.free, state.optimizer, weights, value, slope
        )
        going = state.going & finite

        def kept(new: Array, old: Array) -> Array:
            return jnp.where(going.reshape(-1, *[1] * (new.ndim - 1)), new, old)

        used = jnp.where(state.going, 1 + searched, 0)
        return GradientState(
            state.step + 1,
            state.evaluations + jnp.sum(used),
            kept(free, state.free),
            jax.tree.map(kept, memory, state.optimizer),
            going,
            ideal,
            archive,
        )

    def _evaluated(
        self, free: Float[Array, " d"]
    ) -> tuple[tuple[Array, Array], Float[Array, " d"]]:
        """Costs and violation of a free variable, and its decision."""
        decision = into_box(self.problem, free)
        costs, violation = self.problem.evaluate(decision)
        return (costs, jnp.asarray(violation, costs.dtype)), decision

    def _weights(self) -> Float[ndarray, "n k"]:
        """The direction of each start."""
        weights = spread_weights(len(self.problem.cost_names), self.settings.weights)
        return weights.repeat(self.settings.starts, axis=0)

    def _optimizer(self) -> optax.GradientTransformationExtraArgs:
        name = self.settings.optimizer
        if name == "adam":
            rate = optax.cosine_decay_schedule(self.settings.learning_rate, self.steps)
            return optax.with_extra_args_support(optax.adam(rate))
        if name == "lbfgs":
            return optax.lbfgs()
        raise ValueError(f"`optimizer` {name!r} is neither 'adam' nor 'lbfgs'")


def _line_search_steps(memory: Any) -> Int[Array, ""]:
    """Values with gradients that a line search asked for; 0 without one."""
    info = optax.tree.get(memory, "info", default=None)
    return jnp.array(0) if info is None else info.num_linesearch_steps
