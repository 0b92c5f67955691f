"""The rows that estimators see: features computed once from the records, truth aside.

In: feature rows with their column names. Out: `Examples`, parts of them, and columns by name.
A column is named `set/...`, so that one table can hold a set and its supersets.
"""

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.dataset import PushTruth
from mjx_inertia.objects import ObjectModel
from mjx_inertia.pushing import PushRecord, PushSetup
from mjx_inertia.spatial import AnyArray


@struct.dataclass
class Examples:
    """Pushes as rows of named features."""

    features: Float[Array, "n d"]  # one row a push; rows of unusable pushes hold zeros
    status: Int[Array, " n"]  # the record's `PushStatus`; only `OK` rows are fitted
    # what is to be estimated; None where it is not known, and ignored by `predict`
    truth: PushTruth | None
    columns: tuple[str, ...] = struct.field(pytree_node=False)  # the name of each feature
    # the signals themselves, for estimators that need them; None where they were not kept
    records: PushRecord | None = None
    setup: PushSetup | None = None  # what was known before each push, kept with the records
    # the known outlines that `setup.shape` counts
    shapes: tuple[ObjectModel, ...] = struct.field(pytree_node=False, default=())


def take_examples(
    examples: Examples, indices: Int[AnyArray, " m"] | Bool[AnyArray, " n"]
) -> Examples:
    """Rows of `examples` by index or by mask."""
    rows = jnp.asarray(indices)
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[rows], examples)


def concatenate(parts: Sequence[Examples]) -> Examples:
    """All rows of `parts`, in order; without truth if any part has none.

    Raises:
      ValueError: there is no part, or parts have different columns.
    """
    if not parts:
        raise ValueError("concatenate: `parts` is empty; pass at least one Examples")
    for number, part in enumerate(parts):
        if part.columns != parts[0].columns:
            differing = sorted(set(part.columns) ^ set(parts[0].columns))[:6]
            raise ValueError(
                f"concatenate: part {number} has other columns than part 0 ({differing} differ, or "
                "their order); extract both with one feature set and one settings"
            )
    if any(part.truth is None for part in parts):
        parts = [replace(part, truth=None) for part in parts]
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *parts)


_FAMILIES = {"onset": ("windows", "onset")}


def families_of(feature_set: str) -> tuple[str, ...]:
    """The sets whose columns a set holds, itself among them."""
    return _FAMILIES.get(feature_set, (feature_set,))


def columns_of_set(columns: tuple[str, ...], feature_set: str | None) -> tuple[str, ...]:
    """The columns that belong to `feature_set` ("windows" takes `windows/...`); None takes all.

    A set that builds on another holds the other's columns too.

    Raises:
      ValueError: no column belongs to it.
    """
    if feature_set is None:
        return columns
    families = families_of(feature_set)
    chosen = tuple(name for name in columns if name.split("/")[0] in families)
    if not chosen:
        present = sorted({name.split("/")[0] for name in columns})
        raise ValueError(
            f"no column of the feature set {feature_set!r} among the examples' sets {present}; "
            "extract it, or set the estimator's `features` to one of these or to None"
        )
    return chosen


def select_columns(examples: Examples, columns: tuple[str, ...]) -> Float[Array, "n k"]:
    """The features named `columns`, in that order; the examples may hold others too.

    Raises:
      ValueError: a column is missing.
    """
    if columns == examples.columns:
        return examples.features
    place = {name: number for number, name in enumerate(examples.columns)}
    missing = [name for name in columns if name not in place]
    if missing:
        shown = ", ".join(missing[:6]) + (", ..." if len(missing) > 6 else "")
        raise ValueError(
            f"examples lack {len(missing)} of {len(columns)} columns asked for: {shown}; extract "
            "them with the feature set and settings that the estimator was fitted with"
        )
    return examples.features[:, jnp.asarray([place[name] for name in columns], dtype=jnp.int32)]
