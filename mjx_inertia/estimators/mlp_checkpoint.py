"""A training under way on disk, so that what was interrupted can go on.

In: a pytree of arrays and what it belongs to. Out: the same pytree again.
"""

from pathlib import Path
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia.files import read_arrays, write_arrays

Tree = TypeVar("Tree")


def write_mlp_checkpoint(path: Path, fingerprint: str, tree: object) -> None:
    """Writes the arrays of `tree`; an interrupted write leaves what was there before."""
    arrays = {f"leaf_{number}": np.asarray(leaf) for number, leaf in _leaves(tree)}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, {"fingerprint": np.array(fingerprint), **arrays})


def read_mlp_checkpoint(path: Path, fingerprint: str, like: Tree) -> Tree | None:
    """The tree, in the structure of `like`; None if there is no file or it belongs to another.

    Raises:
      ValueError: the file is damaged or of another kind.
    """
    if not path.is_file():
        return None
    remedy = "; delete it or name another"
    with read_arrays(path, "a checkpoint of `mlp`", remedy) as arrays:
        if str(arrays["fingerprint"]) != fingerprint:
            return None
        leaves = [jnp.asarray(arrays[f"leaf_{number}"]) for number, _ in _leaves(like)]
    return jax.tree.unflatten(jax.tree.structure(like), leaves)


def _leaves(tree: object) -> enumerate:
    return enumerate(jax.tree.leaves(tree))
