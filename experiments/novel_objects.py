"""Objects unlike cubes (thesis §3.4.1, Figs 3.8 and 3.9): how far diverse shapes in training help.

    python experiments/novel_objects.py [novel.pushes=20] [novel.sysid=8] [novel.shapes=4800]

The six objects of Table 3.2 and all objects of the category Pushing are pushed from drawn sides.
The thesis' forest and boosted trees estimate them from single pushes, trained on

- `cubes30`: the 30 cubes of Table 3.1 (run-up, 80 Hz, the thesis' 12 features of that part);
- `full`: the 48,000 pushes of cubes;
- `shapes`: random shapes, none of the catalogue among them (`dataset=shapes`).

The objects are pushed as the training set pushes. `sysid` needs no training; it is told what the
tip can touch of the object, seen from above, and the size of its outline, whose c it takes as a
belief. Pushes that lose contact before their end are left out, of training and test alike. Stores
are made under data/ where they are missing. Figure: errors.
"""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import matplotlib.pyplot as plt
import numpy as np

from mjx_inertia import runtime
from mjx_inertia.dataset import (
    ShapesProtocol,
    SimulatedSettings,
    Source,
    simulated_source,
)
from mjx_inertia.estimators import ESTIMATORS, Estimate, EstimateStatus
from mjx_inertia.evaluation import percent_difference
from mjx_inertia.experiment import experiment
from mjx_inertia.features import take_examples
from mjx_inertia.objects import load_catalogue
from mjx_inertia.pushing import PushStatus
from mjx_inertia.settings import SweepSettings, compose
from mjx_inertia.sweep import tabulate

TABLE_3_2 = ("elliptic_prism", "hexagonal_prism", "triangular_prism", "saucepan", "tank", "rock")
# §3.3.2 pushes cubes half a metre; what rolls off the tip on that way is no push of an object
RUN_UP = {"approach": 0.2, "acceleration": 0.2, "speeds": (0.25,), "length": 0.35}
# c is that of what carries the object, about its CoM: the outline gives no more than a belief
SYSID = (
    "estimator.sysid.estimated=[mass,inertia,com_x,com_y,friction,tip_friction,"
    "tip_time_constant,friction_radius]"
)
TRAINING: dict[str, tuple[list[str], dict[str, Any]]] = {
    "cubes30": (
        ["experiment=cubes30", "dataset.protocol.length=0.35",
         "dataset.path=data/cubes30-short.zarr", "estimator.boosted.features=moments",
         "estimator.names=[mean,forest,boosted]"],
        RUN_UP,
    ),
    "full": (["dataset=full", "estimator.names=[mean,forest,boosted,mlp]"], {}),
    "shapes": (["dataset=shapes", "estimator.names=[mean,forest,boosted,mlp]"], {}),
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    pushes: int = 20  # of each object
    sysid: int = 8  # of them for `sysid`
    shapes: int = 4800  # that the third training set draws


def source_of(settings: SimulatedSettings) -> Source:
    """The pushes of a dataset, simulated where they are missing."""
    source = simulated_source(dataclasses.replace(settings, splits=()))
    if source is None:
        raise ValueError(f"{settings.generate.path}: other shards are missing")
    return source


def novel(
    settings: SimulatedSettings, names: tuple[str, ...], pushes: int, changes: dict[str, Any]
) -> SimulatedSettings:
    """Pushes of catalogue objects in the manner of a training set."""
    generate = settings.generate
    protocol = ShapesProtocol(
        names=names, pushes_per_object=pushes, tip_radius=generate.protocol.tip_radius, **changes
    )
    path = Path(f"data/novel-{settings.name if changes else 'slow'}-{pushes}.zarr")
    return dataclasses.replace(
        settings, generate=dataclasses.replace(generate, path=path, protocol=protocol, block=300)
    )


def errors(source: Source, estimate: Estimate) -> np.ndarray:
    """Percent differences of mass and I_zz, (n, 2); NaN where there is no answer."""
    truth = np.stack([source.truth.mass, source.truth.inertia], 1)
    found = np.asarray(estimate.mean)[:, :2]
    fine = np.asarray(estimate.status) == EstimateStatus.OK
    return np.where(fine[:, None], np.asarray(percent_difference(truth, found)), np.nan)


def by_object(source: Source, error: np.ndarray, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Errors of each object's pushes."""
    number = np.asarray(source.conditions.object_id)
    return {name: error[number == i] for i, name in enumerate(names)}


def summary(errors: dict[str, np.ndarray]) -> dict[str, float | int]:
    """Over the objects of Table 3.2 (all their pushes, and one of each), and over the others."""

    def mean(rows: list[np.ndarray], column: int) -> float:
        return round(float(np.nanmean(np.abs(np.concatenate(rows))[:, column])), 2)

    answered = {name: e[np.isfinite(e[:, 0])] for name, e in errors.items()}
    six = [answered[name] for name in TABLE_3_2]
    rest = [e for name, e in answered.items() if name not in TABLE_3_2]
    one = [e[:1] for e in six]
    return {
        "mass_abs_mean_percent": mean(six, 0),
        "inertia_abs_mean_percent": mean(six, 1),
        "one_push_mass_abs_mean_percent": mean(one, 0),
        "one_push_inertia_abs_mean_percent": mean(one, 1),
        "pushing_mass_abs_mean_percent": mean(rest, 0),
        "pushing_inertia_abs_mean_percent": mean(rest, 1),
        "pushes": sum(map(len, six)) + sum(map(len, rest)),
        "no_answer": sum(int((~np.isfinite(e[:, 0])).sum()) for e in errors.values()),
    }


def learned(
    settings: SweepSettings, names: tuple[str, ...], pushes: int, changes: dict[str, Any]
) -> dict[str, dict[str, np.ndarray]]:
    """Errors by estimator and object after training on one dataset."""
    data = settings.dataset
    assert isinstance(data, SimulatedSettings)
    training = source_of(data)
    tables, _ = tabulate(training, settings)
    test = source_of(novel(data, names, pushes, changes))
    novel_tables, _ = tabulate(test, settings)
    found = {}
    for name, choice in settings.estimators.items():
        estimator = ESTIMATORS[name].factory(choice)
        features = getattr(choice, "features", None) or "onset"
        fitted = estimator.fit(tables[features], key=jax.random.key(settings.seed))
        estimate = estimator.predict(fitted, novel_tables[features])
        found[name] = by_object(test, errors(test, estimate), names)
    return found


def identified(
    settings: SweepSettings, names: tuple[str, ...], pushes: int, each: int
) -> dict[str, np.ndarray]:
    """Errors of `sysid` by object, on the first `each` whole pushes of each."""
    data = settings.dataset
    assert isinstance(data, SimulatedSettings)
    test = source_of(dataclasses.replace(novel(data, names, pushes, {}), floor=1.0))
    tables, _ = tabulate(test, settings)
    table = tables["onset"]
    number = np.asarray(test.conditions.object_id)
    whole = np.asarray(table.status) == PushStatus.OK
    rows = np.concatenate([np.flatnonzero(whole & (number == i))[:each] for i in range(len(names))])
    estimator = ESTIMATORS["sysid"].factory(settings.estimators["sysid"])
    chosen = take_examples(table, rows)
    estimate = estimator.predict(estimator.fit(chosen, key=jax.random.key(0)), chosen)
    truth, conditions = (
        jax.tree.map(lambda x: np.asarray(x)[rows], part) for part in (test.truth, test.conditions)
    )
    picked = dataclasses.replace(test, truth=truth, conditions=conditions)
    return by_object(picked, errors(picked, estimate), names)


def draw(results: dict[str, dict[str, np.ndarray]], path: Path) -> None:
    """Mean errors of mass and I_zz by object and method (thesis Fig. 3.9)."""
    figure, axes = plt.subplots(2, 1, figsize=(9, 6), sharex=True, layout="constrained")
    width = 0.8 / len(results)
    for column, (axis, label) in enumerate(zip(axes, ("mass", "I_zz"), strict=True)):
        for i, (method, errors) in enumerate(results.items()):
            means = [np.nanmean(np.abs(errors[name][:, column])) for name in TABLE_3_2]
            axis.bar(np.arange(6) + (i - 0.5 * len(results)) * width, means, width, label=method)
        axis.set_ylabel(f"{label}: mean |error|, %")
        axis.set_xticks(np.arange(6), [name.replace("_", "\n") for name in TABLE_3_2])
    axes[0].legend(fontsize=8, ncols=3)
    figure.savefig(path)
    plt.close(figure)


@experiment(Options, prefix="novel")
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Prints errors by object and writes the figure."""
    runtime.configure()
    pushing = tuple(load_catalogue(category="Pushing"))
    names = (*TABLE_3_2, *(name for name in pushing if name not in TABLE_3_2))
    results: dict[str, dict[str, np.ndarray]] = {}
    for training, (overrides, changes) in TRAINING.items():
        more = list(overrides)
        if training == "shapes" and options.shapes != Options.shapes:
            more += [f"dataset.protocol.objects={options.shapes}",
                     f"dataset.path=data/shapes-{options.shapes}.zarr"]  # fmt: skip
        settings = compose([*more, "progress=false"])
        for name, found in learned(settings, names, options.pushes, changes).items():
            results[f"{training}.{name}"] = found
    settings = compose(["dataset=full", "estimator=sysid", "estimator.names=[sysid]", SYSID])
    results["sysid"] = identified(settings, names, options.pushes, options.sysid)
    for method, errors in results.items():
        print(f"{method}: mean |error| of mass and I_zz, % (pushes with an answer)")
        for name, e in errors.items():
            mass, inertia = np.nanmean(np.abs(e), axis=0)
            print(f"  {name:18} {mass:6.1f} {inertia:6.1f}  ({np.isfinite(e[:, 0]).sum()})")
    shown = {m: e for m, e in results.items() if not m.endswith("mean")}
    draw(shown, folder / "errors.svg")
    headline = {method: summary(errors) for method, errors in results.items()}
    mass = "mass_abs_mean_percent"
    shares = {
        f"shapes_over_full_{name}": round(
            headline[f"shapes.{name}"][mass] / headline[f"full.{name}"][mass], 3
        )
        for name in ("forest", "boosted", "mlp")
    }
    return {"experiment": "novel_objects", **headline, **shares}


if __name__ == "__main__":
    main()
