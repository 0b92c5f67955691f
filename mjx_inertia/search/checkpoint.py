"""A search under way on disk, so that what was interrupted can go on.

In: the state of a search and what search it is of. Out: the same state again, bit for bit.
"""

import hashlib
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.files import read_arrays, write_arrays
from mjx_inertia.search.problem import Problem

_FORMAT = 2  # of what a step of the same search does; raised when that changes


class Kept(NamedTuple):
    """A search under way and what is in its history."""

    state: Any  # of the search; arrays and keys
    evaluations: Int[ndarray, " s"]  # made at each mark, so far
    costs: Float[ndarray, "s m k"]  # of the archive at each mark, so far
    done: int  # marks passed


def fingerprint(problem: Problem, search: tuple[Any, list[int]], key: Array, like: Any) -> str:
    """Tells a search from others: its settings, bounds, costs, parts, key, precision and state.

    What the costs are is not looked at: change the names of the costs where they change.

    Args:
      problem: searched.
      search: the method, and the steps at which it is written.
      key: of the search.
      like: shapes of its state.
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
