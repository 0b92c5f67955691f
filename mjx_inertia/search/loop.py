"""Runs any search: one compiled program, or parts of it that are kept on disk and told about.

In: a method with a start and a step. Out: its archive, with copies made along the way, which give
the hypervolume against the number of evaluations. What was interrupted goes on bit for bit from its
checkpoint.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.files import read_arrays, write_arrays
from mjx_inertia.search.archive import Archive
from mjx_inertia.search.fronts import approximate_hypervolume, hypervolume
from mjx_inertia.search.problem import Problem

_EXACT = 5  # costs, at most: beyond, the exact volume of 100 rows takes minutes
_FORMAT = 2  # of what a step of the same search does; raised when that changes


class Kept(NamedTuple):
    """A search under way and what is in its history."""

    state: Any  # of the search; arrays and keys
    evaluations: Int[ndarray, " s"]  # made at each mark, so far
    costs: Float[ndarray, "s m k"]  # of the archive at each mark, so far
    done: int  # marks passed


def fingerprint(problem: Problem, search: tuple[Any, list[int]], key: Array, like: Any) -> str:
    """Tells a search from others: its settings, bounds, costs, parts, key, precision and state.

    What the costs are is not looked at: change the names of the costs where they change. `search`
    is the method and the steps at which it is written, `like` the shapes of its state.
    """
    method, marks = search
    parts = [(jax.tree_util.keystr(path), x.shape, str(x.dtype))
             for path, x in jax.tree_util.tree_leaves_with_path(like)]  # fmt: skip
    box = (np.asarray(problem.lower, float).tolist(), np.asarray(problem.upper, float).tolist())
    precision = str(jnp.asarray(problem.lower).dtype)
    named = (type(method).__name__, repr(method.settings), problem.cost_names, box, precision)
    draw = np.asarray(_plain(key)).tolist()
    text = repr((_FORMAT, *named, marks, draw, parts))
    return f"{type(method).__name__} {hashlib.sha256(text.encode()).hexdigest()}"


def write_checkpoint(path: Path, mine: str, kept: Kept) -> None:
    """Writes a search; an interrupted write leaves what was there before."""
    leaves = jax.tree.leaves(kept.state)
    arrays = {f"leaf_{i}": np.asarray(_plain(leaf)) for i, leaf in enumerate(leaves)}
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays |= {
        "fingerprint": np.array(mine),
        "evaluations": kept.evaluations,
        "costs": kept.costs,
        "done": np.array(kept.done),
    }
    write_arrays(path, arrays)


def read_checkpoint(path: Path, mine: str, like: Any, key: Array) -> Kept:
    """The search on disk.

    Raises:
      ValueError: the file is damaged, of another kind or of another search.
    """
    shapes, structure = jax.tree.flatten(like)
    remedy = "; delete it or name another"
    with read_arrays(path, "the checkpoint of a search", remedy) as arrays:
        found = str(arrays["fingerprint"])
        if found == mine:
            leaves = [_as(arrays[f"leaf_{i}"], shape, key) for i, shape in enumerate(shapes)]
            state = jax.tree.unflatten(structure, leaves)
            return Kept(state, arrays["evaluations"], arrays["costs"], int(arrays["done"]))
    raise ValueError(
        f"{path}: expected a checkpoint of this search ({mine[:24]}…), found one of another "
        f"({found[:24]}…): its settings, bounds, costs, steps, key or precision differ; go on "
        "with the same or name another file"
    )


def _is_key(leaf: Any) -> bool:
    return jax.dtypes.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _plain(leaf: Array) -> Array:
    return jax.random.key_data(leaf) if _is_key(leaf) else leaf


def _as(array: np.ndarray, shape: Any, key: Array) -> Array:
    if _is_key(shape):
        return jax.random.wrap_key_data(jnp.asarray(array), impl=jax.random.key_impl(key))
    return jnp.asarray(array)


@struct.dataclass
class History:
    """Copies of the archive's costs at s times."""

    evaluations: Int[Array, " s"]  # made until then
    costs: Float[Array, "s m k"]  # infinite in unused rows


@struct.dataclass
class SearchResult:
    """Decisions that do not dominate each other."""

    decisions: Float[Array, "m d"]  # zero in unused rows
    costs: Float[Array, "m k"]  # infinite in unused rows
    violation: Float[Array, " m"]  # 0; infinite in unused rows
    evaluations: Int[Array, ""]  # made in all; one of a gradient with its value counts as one
    history: History  # of the costs

    def front(self) -> tuple[Float[ndarray, "n d"], Float[ndarray, "n k"]]:
        """Decisions and costs of the rows in use, on the host, by the first cost.

        Raises:
          ValueError: the result is of many searches at once; take one of them first.
        """
        if np.ndim(self.violation) != 1:
            raise ValueError(
                f"`violation` has shape {np.shape(self.violation)}: results of many searches; take "
                "one with jax.tree.map(lambda x: x[i], result)"
            )
        decisions, costs, violation = jax.device_get((self.decisions, self.costs, self.violation))
        used = np.flatnonzero(violation == 0.0)
        rows = used[np.lexsort(costs[used].T[::-1])]
        return decisions[rows], costs[rows]


def progress(
    result: SearchResult, reference: Float[Array | ndarray, " k"]
) -> tuple[Int[ndarray, " s"], Float[ndarray, " s"]]:
    """Evaluations made and the hypervolume of the archive at each copy in the history.

    With more than five costs the volume is an approximation, see `approximate_hypervolume`.
    `reference` is worse than what counts in every cost.
    """
    evaluations, costs = jax.device_get((result.history.evaluations, result.history.costs))
    measure = hypervolume if costs.shape[-1] <= _EXACT else approximate_hypervolume
    return evaluations, np.array([measure(rows, reference) for rows in costs])


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


@dataclass(frozen=True)
class Recording:
    """What is kept and told of a search while it runs."""

    snapshots: int = 20  # how many times the archive is copied into the history
    # file to which the search is written at each snapshot; if it is there and of the same search,
    # the search goes on from it
    checkpoint: Path | None = None
    # called at each snapshot with the result so far
    report: Callable[[SearchResult], None] | None = None


def run_search(
    method: Method, steps: int, key: Array, recording: Recording | None = None
) -> SearchResult:
    """Runs a search to its end; see `moead` for the arguments.

    Raises:
      ValueError: no step or no snapshot, or a checkpoint that is damaged or of another search.
    """
    recording = recording or Recording()
    snapshots, checkpoint, report = recording.snapshots, recording.checkpoint, recording.report
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
