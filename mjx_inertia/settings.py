"""Run configuration: Hydra's files and overrides become the frozen settings of the library.

In: `configs/` and overrides. Out: `SweepSettings`. Defaults live in the settings classes, YAML
holds overrides only, and no `DictConfig` passes beyond this module.
"""

import dataclasses
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hydra import compose as hydra_compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf

from mjx_inertia.dataset import (
    Cubes30Protocol,
    CubesProtocol,
    GenerateSettings,
    MeasuredSettings,
    ShapesProtocol,
    SimulatedSettings,
)
from mjx_inertia.estimators import ESTIMATORS
from mjx_inertia.features import FeatureSettings
from mjx_inertia.pushing import SceneSettings

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
_PROTOCOLS = {
    "cubes": CubesProtocol(),
    "cubes30": Cubes30Protocol(),
    "shapes": ShapesProtocol(),
}
# What a configuration holds, and its dataset, simulated or measured.
_SECTIONS = ("dataset", "estimator", "features", "seed", "progress", "devices")
_DATASET = {
    *("name", "kind", "spread"),
    *("path", "protocol", "scene", "block", "shard", "splits", "grouped_share", "floor"),
    *("root", "objects", "rate"),
}


@dataclass(frozen=True)
class SweepSettings:
    """One run of the main job."""

    dataset: SimulatedSettings | MeasuredSettings  # which pushes
    estimators: Mapping[str, Any]  # settings of each estimator by name, in the order of the tables
    features: FeatureSettings = field(default_factory=FeatureSettings)  # how features are taken
    seed: int = 0  # of everything random in the estimators
    progress: bool = True  # show bars
    devices: int | None = None  # host devices of the CPU (None: one a core)
    # the configuration that all this was read from, for the report
    config_yaml: str = field(default="", compare=False, repr=False)


def override(defaults: Any, changes: Mapping[str, Any], where: str = "") -> Any:
    """A settings object with some fields replaced, nested ones included.

    Raises:
      ValueError: a field that there is none of, or a value that the settings refuse.
    """
    known = {f.name: getattr(defaults, f.name) for f in dataclasses.fields(defaults)}
    unknown = sorted(set(changes) - set(known))
    if unknown:
        raise ValueError(f"{where or 'settings'}: no field {unknown[0]!r}; there are {[*known]}")
    replaced = {}
    for name, value in changes.items():
        if dataclasses.is_dataclass(known[name]) and isinstance(value, Mapping):
            replaced[name] = override(known[name], value, f"{where}.{name}".lstrip("."))
        else:
            replaced[name] = _frozen(value)
    return dataclasses.replace(defaults, **replaced)


def _frozen(value: Any) -> Any:
    return tuple(_frozen(v) for v in value) if isinstance(value, list | tuple) else value


def register_defaults() -> None:
    """Makes the library's defaults known to Hydra, so that each field can be overridden."""
    store = ConfigStore.instance()
    groups = {
        "protocol": _PROTOCOLS,
        "scene": {"default": SceneSettings()},
        "features": {"default": FeatureSettings()},
        "settings": {name: entry.settings() for name, entry in ESTIMATORS.items()},
    }
    for group, members in groups.items():
        for name, settings in members.items():
            store.store(group=f"defaults/{group}", name=name, node=dataclasses.asdict(settings))


def _dataset(raw: dict[str, Any], seed: int) -> SimulatedSettings | MeasuredSettings:
    if raw["kind"] == "measured":
        if not raw["root"]:
            raise ValueError(
                "dataset.root is not set: give dataset.root=PATH of a folder in the layout of the "
                "M-dataset, or set the environment variable MJX_INERTIA_DATA"
            )
        objects = Path(raw["objects"]) if raw["objects"] else None
        return MeasuredSettings(raw["name"], Path(raw["root"]), objects, raw["rate"], raw["spread"])
    if raw["kind"] not in _PROTOCOLS:
        raise ValueError(f"dataset.kind={raw['kind']}: expected one of {sorted(_PROTOCOLS)}")
    if not raw["path"]:
        raise ValueError("dataset.path is not set: give the folder of the store")
    generate = GenerateSettings(
        path=Path(raw["path"]),
        protocol=override(_PROTOCOLS[raw["kind"]], raw["protocol"], "dataset.protocol"),
        scene=override(SceneSettings(), raw["scene"], "dataset.scene"),
        seed=seed,
        block=raw["block"],
        shard=str(raw["shard"]),
    )
    return SimulatedSettings(
        name=raw["name"],
        generate=generate,
        splits=tuple(raw["splits"]),
        grouped_share=raw["grouped_share"],
        spread=raw["spread"],
        floor=raw["floor"],
    )


def _refuse_unknown(given: Iterable[Any], known: Iterable[str], path: str = "") -> None:
    known = sorted(known)
    if unknown := [name for name in given if name not in known]:
        raise ValueError(f"{path}{unknown[0]}: no such option; there are {known}")


def from_config(config: DictConfig, others: Collection[str] = ()) -> SweepSettings:
    """Settings of a composed configuration.

    Args:
      config: composed from `configs/sweep.yaml`.
      others: names in it that are not of the main job.

    Raises:
      ValueError: an unknown name, or a value that makes no sense, with its name and what to do.
    """
    raw = OmegaConf.to_container(config, resolve=True)
    assert isinstance(raw, dict)
    if type(raw["seed"]) is not int or not 0 <= raw["seed"] < 2**32:
        raise ValueError(f"seed={raw['seed']}: expected a whole number from 0 to {2**32 - 1}")
    _refuse_unknown(raw, {*_SECTIONS, *others})
    _refuse_unknown(raw["dataset"], _DATASET, "dataset.")
    _refuse_unknown(raw["estimator"], ["names", *ESTIMATORS], "estimator.")
    unknown = sorted(set(raw["estimator"]["names"]) - set(ESTIMATORS))
    if unknown:
        raise ValueError(f"estimator.names has {unknown[0]!r}; there are {sorted(ESTIMATORS)}")
    # settings of estimators that do not run are checked too
    chosen = {
        name: override(entry.settings(), raw["estimator"].get(name, {}), f"estimator.{name}")
        for name, entry in ESTIMATORS.items()
    }
    try:
        dataset = _dataset(raw["dataset"], raw["seed"])
    except TypeError as error:
        raise ValueError(f"dataset: a value is of another type than its option: {error}") from None
    return SweepSettings(
        dataset=dataset,
        estimators={name: chosen[name] for name in raw["estimator"]["names"]},
        features=override(FeatureSettings(), raw["features"], "features"),
        seed=raw["seed"],
        progress=raw["progress"],
        devices=raw["devices"],
        config_yaml=OmegaConf.to_yaml(config, resolve=True),
    )


def compose(overrides: Sequence[str]) -> SweepSettings:
    """Settings of `configs/sweep.yaml` with overrides, for scripts and tests."""
    register_defaults()
    running = GlobalHydra.instance().hydra  # an experiment may compose further configurations
    GlobalHydra.instance().clear()
    try:
        with initialize_config_dir(str(CONFIGS), version_base="1.3"):
            config = hydra_compose("sweep", overrides=list(overrides))
    finally:
        GlobalHydra.instance().hydra = running
    return from_config(config)
