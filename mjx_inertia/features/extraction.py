"""A push as a vector with named entries.

In: `PushRecord`s or a `PushBatch`. Out: `Examples`. Sets are known by name in `FEATURE_SETS`; a
set's functions are written for one push and mapped over the batch here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from mjx_inertia.dataset import PushBatch
from mjx_inertia.features.example_table import Examples
from mjx_inertia.features.moments import moments, moments_names
from mjx_inertia.features.onset import onset, onset_names
from mjx_inertia.features.series import series, series_names
from mjx_inertia.features.signals import FeatureSettings, Signals, signals
from mjx_inertia.features.windows import windows, windows_names
from mjx_inertia.objects import ObjectModel
from mjx_inertia.pushing import PushRecord, PushStatus, with_few_lengths
from mjx_inertia.spatial import AnyArray

_MOST = 256  # pushes in flight: bounds memory at about 100 MB for pushes of 1,500 samples


@dataclass(frozen=True)
class FeatureSet:
    """Names of the features under given settings, and the features of one push."""

    names: Callable[[FeatureSettings], tuple[str, ...]]
    compute: Callable[[Signals], Float[Array, " d"]]


def _onset_names(settings: FeatureSettings) -> tuple[str, ...]:
    return windows_names(settings) + onset_names(settings)


def _onset(push: Signals) -> Float[Array, " d"]:
    return jnp.concatenate([windows(push), onset(push)])


FEATURE_SETS = {
    "windows": FeatureSet(windows_names, windows),
    "moments": FeatureSet(moments_names, moments),
    "series": FeatureSet(series_names, series),
    "onset": FeatureSet(_onset_names, _onset),  # holds `windows` too
}
DEFAULT = FeatureSettings()


def _lookup(feature_set: str) -> FeatureSet:
    if feature_set not in FEATURE_SETS:
        raise ValueError(f"feature_set={feature_set!r} is not one of {sorted(FEATURE_SETS)}")
    return FEATURE_SETS[feature_set]


def feature_names(feature_set: str, settings: FeatureSettings = DEFAULT) -> tuple[str, ...]:
    """The columns of a feature set, in the order of `extract`."""
    return _lookup(feature_set).names(settings)


def _rows(
    records: PushRecord, feature_set: str, settings: FeatureSettings
) -> tuple[Float[Array, "n d"], Bool[Array, " n"]]:
    return _rows_of_length(with_few_lengths(records), feature_set, settings)


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


def extract(
    records: PushRecord, feature_set: str, settings: FeatureSettings = DEFAULT
) -> Float[Array, "n d"]:
    """Features of each push of a batch; zeros where a push is not `OK` or too short."""
    _lookup(feature_set)
    return _rows(records, feature_set, settings)[0]


def examples(
    pushes: PushBatch | PushRecord,
    feature_set: str,
    settings: FeatureSettings = DEFAULT,
    *,
    keep_records: bool = False,
    shapes: tuple[ObjectModel, ...] = (),
) -> Examples:
    """Pushes as rows, with truth if they are a `PushBatch`.

    Args:
      pushes: the records, or a batch of them.
      feature_set: a name in `FEATURE_SETS`.
      settings: how features are taken.
      keep_records: keep the signals (and the setup) beside the features, for estimators that need
        them; 35 kB a push.
      shapes: outlines that the setup refers to.

    A push that is `OK` but has fewer than three samples in contact becomes `LOST_CONTACT`: its
    zeros must not pass for measurements.
    """
    columns = feature_names(feature_set, settings)
    batch = pushes if isinstance(pushes, PushBatch) else None
    records = pushes.records if isinstance(pushes, PushBatch) else pushes
    features, usable = _rows(records, feature_set, settings)
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
