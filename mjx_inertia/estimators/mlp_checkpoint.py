"""A training under way on disk, so that what was interrupted can go on.

In: a pytree of arrays and what it belongs to. Out: the same pytree again.
"""

import os
import zipfile
import zlib
from pathlib import Path
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np

Tree = TypeVar("Tree")


def write_mlp_checkpoint(path: Path, fingerprint: str, tree: object) -> None:
    """Writes the arrays of `tree`; an interrupted write leaves what was there before."""
    arrays = {f"leaf_{number}": np.asarray(leaf) for number, leaf in _leaves(tree)}
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with partial.open("wb") as file:
            np.savez(file, fingerprint=np.array(fingerprint), **arrays)  # pyright: ignore[reportArgumentType]
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def read_mlp_checkpoint(path: Path, fingerprint: str, like: Tree) -> Tree | None:
    """The tree, in the structure of `like`; None if there is no file or it belongs to another.

    Raises:
      ValueError: the file is damaged or of another kind.
    """
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            if str(file["fingerprint"]) != fingerprint:
                return None
            leaves = [jnp.asarray(file[f"leaf_{number}"]) for number, _ in _leaves(like)]
    except (zipfile.BadZipFile, zlib.error, ValueError, EOFError, OSError, KeyError) as error:
        raise ValueError(
            f"{path}: expected a checkpoint of `mlp`, found a file that is damaged or of another "
            f"kind ({error}); delete it or name another"
        ) from error
    return jax.tree.unflatten(jax.tree.structure(like), leaves)


def _leaves(tree: object) -> enumerate:
    return enumerate(jax.tree.leaves(tree))
