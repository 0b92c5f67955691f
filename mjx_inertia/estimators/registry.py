"""Estimators by name, for configs; fitted ones on disk, without pickle.

A file holds arrays and a JSON description in one .npz. In: a fitted record of a known type. Out:
the same record again, equal to the bit.
"""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from mjx_inertia.estimators.boosted_trees import BoostedSettings, FittedBoosted, LogLinear, boosted
from mjx_inertia.estimators.estimate import Estimator
from mjx_inertia.estimators.limit_surface_estimator import LimitSurfaceSettings, limit_surface
from mjx_inertia.estimators.mlp_estimator import FittedMlp, MlpSettings, mlp
from mjx_inertia.estimators.mlp_training import InputScale, Shape
from mjx_inertia.estimators.newton import FittedNewton
from mjx_inertia.estimators.random_forest import FittedForest, ForestSettings, forest
from mjx_inertia.estimators.sysid import SysidSettings, sysid
from mjx_inertia.estimators.training import FittedMean, MeanSettings, TargetScale, mean
from mjx_inertia.estimators.trees import TreeEnsemble
from mjx_inertia.files import OtherFormat, read_arrays, write_arrays


class Registered(NamedTuple):
    """An estimator's settings, what makes it from them, whether it reads the signals themselves."""

    settings: type
    factory: Callable[[Any], Estimator]
    signals: bool = False


ESTIMATORS = {
    "mean": Registered(MeanSettings, mean),
    "forest": Registered(ForestSettings, forest),
    "boosted": Registered(BoostedSettings, boosted),
    "mlp": Registered(MlpSettings, mlp),
    "limit_surface": Registered(LimitSurfaceSettings, limit_surface, signals=True),
    "sysid": Registered(SysidSettings, sysid, signals=True),
}

# Records that may be stored, and the records that they hold.
STORED_TYPES: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        FittedMean,
        FittedForest,
        FittedBoosted,
        FittedMlp,
        FittedNewton,
        InputScale,
        LogLinear,
        Shape,
        TargetScale,
        TreeEnsemble,
    )
}
_FORMAT = "mjx_inertia fitted estimator"
_VERSION = 1


def save_fitted(path: str | Path, fitted: object) -> None:
    """Writes `fitted` to `path`, which an interrupted write leaves as it was.

    Raises:
      ValueError: its type, or that of a field, is not in `STORED_TYPES`.
    """
    arrays: dict[str, np.ndarray] = {}
    description = {"format": _FORMAT, "version": _VERSION, "fitted": _take_apart(fitted, arrays)}
    arrays["description"] = np.array(json.dumps(description))
    write_arrays(Path(path), arrays, compress=True)


def load_fitted(path: str | Path) -> object:
    """Reads what `save_fitted` wrote.

    Raises:
      FileNotFoundError: there is no such file.
      ValueError: the file is truncated, damaged, of another kind or of a newer version.
    """
    with read_arrays(Path(path), f"a fitted estimator ({_FORMAT!r} version {_VERSION})") as arrays:
        description = json.loads(str(arrays.pop("description")))
        if (description["format"], description["version"]) != (_FORMAT, _VERSION):
            raise OtherFormat(f"{description['format']!r} version {description['version']}")
        return _put_together(description["fitted"], arrays)


def _take_apart(record: object, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """The JSON description of a record; its arrays go to `arrays` under names of their own."""
    kind = type(record).__name__
    if not dataclasses.is_dataclass(record) or STORED_TYPES.get(kind) is not type(record):
        raise ValueError(
            f"save_fitted: a {kind} is not among {sorted(STORED_TYPES)}; add it to STORED_TYPES"
        )
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if dataclasses.is_dataclass(value):
            fields[field.name] = _take_apart(value, arrays)
        elif isinstance(value, dict):
            fields[field.name] = {
                "arrays": {key: _put(leaf, arrays) for key, leaf in value.items()}
            }
        elif field.metadata.get("pytree_node", True):
            fields[field.name] = {"array": _put(value, arrays)}
        else:
            fields[field.name] = {"value": value}
    return {"type": kind, "fields": fields}


def _put(value: Any, arrays: dict[str, np.ndarray]) -> str:
    name = f"array_{len(arrays)}"
    arrays[name] = np.asarray(value)
    return name


def _put_together(described: dict[str, Any], arrays: dict[str, np.ndarray]) -> object:
    fields = {}
    for name, field in described["fields"].items():
        if "type" in field:
            fields[name] = _put_together(field, arrays)
        elif "array" in field:
            fields[name] = jnp.asarray(arrays[field["array"]])
        elif "arrays" in field:
            fields[name] = {k: jnp.asarray(arrays[place]) for k, place in field["arrays"].items()}
        else:
            value = field["value"]
            fields[name] = tuple(value) if isinstance(value, list) else value
    return STORED_TYPES[described["type"]](**fields)
