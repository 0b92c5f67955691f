"""The rows that estimators see: features computed once from the records, truth aside.

In: `PushRecord`s or a `PushBatch`. Out: `Examples`, parts of them, and columns by name. Sets are
known by name in `FEATURE_SETS`; a set's functions are written for one push and mapped over the
batch here. A column is named `set/...`, so that one table can hold a set and its supersets.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.dataset import PushBatch, PushTruth
from mjx_inertia.features.feature_sets import FEATURE_SETS, families_of, feature_set_of
from mjx_inertia.features.signals import FeatureSettings, signals
from mjx_inertia.objects import ObjectModel
from mjx_inertia.pushing import PushRecord, PushSetup, PushStatus, with_few_lengths
from mjx_inertia.spatial import AnyArray

DEFAULT = FeatureSettings()
_MOST = 256  # pushes in flight: bounds memory at about 100 MB for pushes of 1,500 samples


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


def feature_names(feature_set: str, settings: FeatureSettings = DEFAULT) -> tuple[str, ...]:
    """The columns of a feature set, in their order."""
    return feature_set_of(feature_set).names(settings)


@partial(jax.jit, static_argnames=("feature_set", "settings"))
def _rows_of_length(
    records: PushRecord, feature_set: str, settings: FeatureSettings
) -> tuple[Float[Array, "n d"], Bool[Array, " n"]]:
    compute = FEATURE_SETS[feature_set].compute

    def one(record: PushRecord) -> tuple[Float[Array, " d"], Bool[Array, ""]]:
        push = signals(record, settings)
        return jnp.where(push.usable, compute(push), 0.0), push.usable

    # Blocks of one size: what is left over would be compiled once more.
    count = len(records.status)
    blocks = max(1, -(-count // _MOST))
    size = -(-count // blocks)
    short = blocks * size - count

    def split(x: AnyArray) -> Array:
        x = jnp.asarray(x)
        whole = jnp.pad(x, ((0, short), *((0, 0),) * (x.ndim - 1)), mode="edge") if short else x
        return whole.reshape(blocks, size, *x.shape[1:])

    found = jax.lax.map(jax.vmap(one), jax.tree.map(split, records))
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:])[:count], found)


def examples(
    pushes: PushBatch | PushRecord,
    feature_set: str,
    settings: FeatureSettings = DEFAULT,
    *,
    keep_records: bool = False,
    shapes: tuple[ObjectModel, ...] = (),
) -> Examples:
    """Pushes as rows, with truth if they are a `PushBatch`.

    A push that is `OK` but has fewer than three samples in contact becomes `LOST_CONTACT`: its
    zeros must not pass for measurements. `keep_records` keeps signals and setups (35 kB a push),
    for estimators that need them; `shapes` are the outlines that the setups refer to.
    """
    columns = feature_names(feature_set, settings)
    batch = pushes if isinstance(pushes, PushBatch) else None
    records = pushes.records if isinstance(pushes, PushBatch) else pushes
    features, usable = _rows_of_length(with_few_lengths(records), feature_set, settings)
    status = jnp.asarray(records.status)
    lost = jnp.asarray(PushStatus.LOST_CONTACT, status.dtype)
    return Examples(
        features=features,
        status=jnp.where((status == PushStatus.OK) & ~usable, lost, status),
        truth=None if batch is None else batch.truth,
        columns=columns,
        records=records if keep_records else None,
        setup=batch.setup if keep_records and batch is not None else None,
        shapes=shapes if keep_records else (),
    )
