"""Runs any search: one compiled program, or parts of it that are kept on disk and told about.

In: a method with a start and a step. Out: its archive, with copies made along the way.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.search.archive import Archive
from mjx_inertia.search.checkpoint import Kept, fingerprint, read_checkpoint, write_checkpoint
from mjx_inertia.search.problem import Problem
from mjx_inertia.search.result import History, SearchResult


@runtime_checkable
class SearchState(Protocol):
    """What the state of every search has."""

    @property
    def step(self) -> Int[Array, ""]:
        """Steps done."""
        ...

    @property
    def evaluations(self) -> Int[Array, ""]:
        """Evaluations made."""
        ...

    @property
    def archive(self) -> Archive:
        """Best decisions so far."""
        ...


@runtime_checkable
class Method(Protocol):
    """A search: hashable, alike if its problem and its settings are."""

    @property
    def problem(self) -> Problem:
        """What is searched."""
        ...

    @property
    def settings(self) -> Any:
        """A frozen dataclass."""
        ...

    def start(self, key: Array) -> Any:
        """The first state."""
        ...

    def step(self, state: Any) -> Any:
        """The next state."""
        ...


def run_search(
    method: Method,
    steps: int,
    *,
    key: Array,
    snapshots: int = 20,
    checkpoint: Path | None = None,
    report: Callable[[SearchResult], None] | None = None,
) -> SearchResult:
    """Runs a search to its end; see `moead` for the arguments.

    Raises:
      ValueError: no step or no snapshot, or a checkpoint that is damaged or of another search.
    """
    if steps < 1 or snapshots < 1:
        raise ValueError(f"{steps} steps and `snapshots` {snapshots} must be at least 1")
    marks = np.unique(np.linspace(0, steps, min(snapshots, steps) + 1).round().astype(int))
    if checkpoint is None and report is None:
        return _whole(method, key, jnp.asarray(marks))
    like = jax.eval_shape(method.start, key)
    mine = fingerprint(method.problem, (method, marks.tolist()), key, like)
    if checkpoint is not None and checkpoint.exists():
        state, evaluations, costs, done = read_checkpoint(checkpoint, mine, like, key)
    else:
        state, done = _begin(method, key), 0
        evaluations = np.zeros(len(marks), int)
        rows = state.archive.costs
        costs = np.full((len(marks), *rows.shape), np.inf, rows.dtype)
    for i in range(done, len(marks)):
        state, (evaluations[i], costs[i]) = _part(method, state, jnp.asarray(marks[i]))
        if checkpoint is not None:
            kept = Kept(state, evaluations, costs, i + 1)
            write_checkpoint(checkpoint, mine, kept)
        if report is not None:
            report(_result(state, evaluations[: i + 1], costs[: i + 1]))
    return _result(state, evaluations, costs)


def _advance(method: Method, state: Any, mark: Int[Array, ""]) -> tuple[Any, tuple[Array, Array]]:
    """The state after so many steps in all, and what goes into the history."""
    state = jax.lax.while_loop(lambda s: s.step < mark, method.step, state)
    return state, (state.evaluations, state.archive.costs)


@partial(jax.jit, static_argnames="method")
def _begin(method: Method, key: Array) -> Any:
    return method.start(key)


@partial(jax.jit, static_argnames="method")
def _part(method: Method, state: Any, mark: Int[Array, ""]) -> tuple[Any, tuple[Array, Array]]:
    return _advance(method, state, mark)


@partial(jax.jit, static_argnames="method")
def _whole(method: Method, key: Array, marks: Int[Array, " s"]) -> SearchResult:
    state, (evaluations, costs) = jax.lax.scan(partial(_advance, method), method.start(key), marks)
    return _result(state, evaluations, costs)


def _result(
    state: SearchState,
    evaluations: Int[Array | ndarray, " s"],
    costs: Float[Array | ndarray, "s m k"],
) -> SearchResult:
    history = History(jnp.asarray(evaluations), jnp.asarray(costs))
    best = state.archive
    return SearchResult(best.decisions, best.costs, best.violation, state.evaluations, history)
