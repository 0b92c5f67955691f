"""Table 3.4 of the thesis on the real pushes there are, each object predicted from the others.

    python experiments/mdataset.py dataset.root=PATH [overrides]

The published M-dataset has 11 objects and over 200,000 pushes; what lies below PATH may be a small
subset of it, and the report says how many pushes and objects it read. Beside the table: mass, I_zz
and CoM by the simulation driven by the measured force; the mass from Newton's law on the measured
motion of single pushes, with the CoM known; and the CoM from many slow pushes
(`mcube_quasistatic.npz`, `three_point_block/` below PATH, where they are).
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from matplotlib.figure import Figure

from mjx_inertia.dataset import (
    MeasuredSettings,
    PushBatch,
    load_mcube_folder,
)
from mjx_inertia.estimators import (
    NewtonSettings,
    WrenchTwistGuess,
    com_from_wrench_twist,
    fit_newton,
    predict_newton,
)
from mjx_inertia.evaluation import Section
from mjx_inertia.experiment import experiment, sweep_result
from mjx_inertia.objects import ObjectModel, friction_radius, load_mcube_objects
from mjx_inertia.settings import SweepSettings
from mjx_inertia.sweep import SweepResult
from parts.leave_one_object_out import leave_one_object_out
from parts.quasistatic_files import SlowPushes, load_block, load_quasistatic

SETTINGS = NewtonSettings()
INFORMATIVE = 0.15  # predicted standard deviation over the estimate
WITHIN = 5e-3  # m
BLOCK_OUTLINE = np.array([[0.0, 0.0], [0.15, 0.0], [0.0, 0.15]])  # m, Zhou et al. 2016
BLOCK_COM = np.array([0.05, 0.05])  # m, from the right-angle corner


@dataclasses.dataclass(frozen=True)
class MassTable:
    """Masses of single pushes, each of an object that the instrument was not calibrated on, kg."""

    name: np.ndarray  # of the object
    estimate: Float[np.ndarray, " n"]  # of the mass
    # its predicted standard deviation; infinite where the push tells nothing
    deviation: Float[np.ndarray, " n"]
    truth: Float[np.ndarray, " n"]  # the mass
    baseline: Float[np.ndarray, " n"]  # training mean
    probe_mass: Float[np.ndarray, " n"]  # calibrated on the other objects

    @property
    def percent(self) -> Float[np.ndarray, " n"]:
        """Relative error."""
        return 100.0 * (self.estimate / self.truth - 1.0)

    @property
    def baseline_percent(self) -> Float[np.ndarray, " n"]:
        """Relative error of the training mean."""
        return 100.0 * (self.baseline / self.truth - 1.0)

    @property
    def deviation_percent(self) -> Float[np.ndarray, " n"]:
        """Predicted; infinite for an estimate that is not positive."""
        positive = np.where(self.estimate > 0.0, self.estimate, 1.0)
        return np.where(self.estimate > 0.0, 100.0 * self.deviation / positive, np.inf)


def masses(root: Path, objects: dict[str, ObjectModel]) -> MassTable:
    """Every usable push that slides, predicted by the instrument calibrated on other objects."""
    folder = load_mcube_folder(root, objects, rate=SETTINGS.balance.rate, progress=False)
    batch, ids = folder.batch, np.asarray(folder.batch.conditions.object_id)
    models = [objects[name] for name in folder.objects]
    coms = np.array([np.asarray(model.inertial.com)[:2] for model in models])
    radii = np.array([friction_radius(m.outline, com) for m, com in zip(models, coms, strict=True)])
    parts: list[tuple[np.ndarray, ...]] = []
    for held_out in np.unique(ids):
        train, test = np.flatnonzero(ids != held_out), np.flatnonzero(ids == held_out)
        known = _rows(batch, train)
        fitted = fit_newton(
            known.records, coms[ids[train]], radii[ids[train]], known.truth, SETTINGS
        )
        pushes = _rows(batch, test)
        found = predict_newton(fitted, pushes.records, coms[ids[test]], radii[ids[test]], SETTINGS)
        deviation = np.sqrt(np.asarray(found.covariance)[:, 0, 0])
        usable = np.isfinite(deviation)
        values = np.stack(
            [
                np.asarray(found.mean)[:, 0],
                deviation,
                np.asarray(pushes.truth.mass),
                np.full(len(test), float(fitted.mean[0])),
                np.full(len(test), float(fitted.probe_mass)),
            ]
        )
        parts.append((np.full(usable.sum(), folder.objects[held_out]), *values[:, usable]))
    return MassTable(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _rows(batch: PushBatch, indices: Int[np.ndarray, " m"]) -> PushBatch:
    return jax.tree.map(lambda leaf: np.asarray(leaf)[indices], batch)


def summary(table: MassTable, rows: Bool[np.ndarray, " n"]) -> dict[str, float | int]:
    """Figures of some pushes: of the informative ones, and how many there are."""
    chosen = rows & (table.deviation_percent < 100.0 * INFORMATIVE)
    if not chosen.any():
        return {"usable": int(rows.sum()), "informative": 0}
    error = table.percent[chosen]
    figures = {
        "median_abs_mass_percent_informative": np.median(np.abs(error)),
        "signed_mean_percent": error.mean(),
        "predicted_sd_percent": np.median(table.deviation_percent[chosen]),
        "z_rms": np.sqrt(np.mean((error / table.deviation_percent[chosen]) ** 2)),
        "baseline_median_abs_percent": np.median(np.abs(table.baseline_percent[chosen])),
        "median_abs_percent_usable": np.median(np.abs(table.percent[rows])),
    }
    counts = {"usable": int(rows.sum()), "informative": int(chosen.sum())}
    return {**counts, **{name: round(float(value), 3) for name, value in figures.items()}}


def masses_figure(table: MassTable) -> Figure:
    """Estimates over truths, with two predicted standard deviations; informative ones filled."""
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.subplots()
    chosen = table.deviation_percent < 100.0 * INFORMATIVE
    spread = np.random.default_rng(0).uniform(-0.012, 0.012, len(chosen))
    for rows, face, label in ((chosen, "C0", "informative"), (~chosen, "none", "others")):
        axes.errorbar(
            (table.truth + spread)[rows],
            table.estimate[rows],
            yerr=2.0 * table.deviation[rows],
            fmt="o",
            markersize=4,
            linewidth=0.6,
            color="C0",
            markerfacecolor=face,
            label=label,
        )
    top = 1.6 * table.truth.max()
    axes.plot([0.0, top], [0.0, top], color="0.6", linewidth=0.8)
    axes.set(
        xlim=(0.6 * table.truth.min(), 1.15 * table.truth.max()),
        ylim=(0.0, top),
        xlabel="true mass, kg (scattered a little)",
        ylabel="mass from one push, kg",
    )
    axes.legend()
    return figure


def com_errors(
    sets: Sequence[Sequence[SlowPushes]], truth: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, " n"]:
    """Distance of the CoM found in each set of pushes from the true one, m; nothing is assumed."""
    loads = [np.concatenate([part.load for part in parts]) for parts in sets]
    twists = [np.concatenate([part.twist for part in parts]) for parts in sets]
    longest = max(map(len, loads))

    def padded(rows: list[np.ndarray]) -> jnp.ndarray:
        return jnp.asarray(
            [np.pad(r, [(0, longest - len(r)), *[(0, 0)] * (r.ndim - 1)]) for r in rows],
            dtype=jnp.float32,
        )

    guess = WrenchTwistGuess(jnp.zeros(2))
    fit = jax.jit(jax.vmap(com_from_wrench_twist, in_axes=(0, 0, 0, None)))(
        padded(loads), padded(twists), padded([np.ones(len(load)) for load in loads]), guess
    )
    return np.linalg.norm(np.asarray(fit.com) - truth, axis=1)


def slow_pushes(root: Path, objects: dict[str, ObjectModel]) -> dict[str, float]:
    """CoM error in mm by set, `<surface>.<object>`, of the slow pushes below a folder."""
    file = root / "mcube_quasistatic.npz"
    if not file.is_file():
        return {}
    sets: dict[str, list[SlowPushes]] = {}
    for pushes in load_quasistatic(file, objects):
        if pushes.live:
            sets.setdefault(f"{pushes.surface}.{pushes.shape}", []).append(pushes)
    truth = [np.asarray(objects[s[0].shape].inertial.com)[:2] for s in sets.values()]
    return _in_mm(list(sets), com_errors(list(sets.values()), np.array(truth)))


def block_pushes(root: Path) -> dict[str, float]:
    """CoM error in mm of the block on each set of support points below a folder."""
    blocks = [load_block(p, BLOCK_OUTLINE) for p in sorted(root.glob("three_point_block/*.npz"))]
    if not blocks:
        return {}
    found = com_errors([[block] for block in blocks], np.tile(BLOCK_COM, (len(blocks), 1)))
    return _in_mm([block.surface for block in blocks], found)


def _in_mm(names: list[str], errors: Float[np.ndarray, " n"]) -> dict[str, float]:
    return {name: round(1e3 * float(error), 2) for name, error in zip(names, errors, strict=True)}


def real_pushes(
    settings: SweepSettings, result: SweepResult, folder: Path
) -> tuple[tuple[Section, ...], dict[str, Any]]:
    """Sections and headline entries of the two methods that need no training on features."""
    del result, folder
    assert isinstance(settings.dataset, MeasuredSettings)
    objects = load_mcube_objects(settings.dataset.objects)
    table = masses(settings.dataset.root, objects)
    everything = summary(table, np.ones(len(table.name), dtype=bool))
    by_object: dict[str, dict[str, float | int]] = {}
    for name in np.unique(table.name):
        rows = table.name == name
        probe = {"probe_mass_kg": round(float(table.probe_mass[rows][0]), 3)}
        by_object[str(name)] = {**summary(table, rows), **probe}
    entries: dict[str, Any] = {f"newton_{key}": value for key, value in everything.items()}
    driven = leave_one_object_out(settings.dataset.root, objects).figures()
    entries |= {f"sysid_{key}": value for key, value in driven.items()}
    entries |= {f"newton.{name}": values for name, values in by_object.items()}
    errors = slow_pushes(settings.dataset.root, objects)
    block = block_pushes(settings.dataset.root)
    for prefix, found in (("com", errors), ("block_com", block)):
        if found:
            entries |= {
                f"{prefix}_within_5mm": sum(error < 1e3 * WITHIN for error in found.values()),
                f"{prefix}_sets": len(found),
                f"{prefix}_median_mm": round(float(np.median(list(found.values()))), 2),
                f"{prefix}_mm": found,
            }
    lines = [f"{name}: {values}" for name, values in [*by_object.items(), ("all", everything)]]
    caption = (
        "Newton's law on the measured motion, friction unknown, CoM and outline known. The "
        "instrument is calibrated on the other objects; bars are two predicted standard deviations."
    )
    sections = (
        Section("Mass from one push, by Newton's law", masses_figure(table), caption),
        Section(
            "Mass, I_zz and CoM by the simulation driven by the measured force",
            "\n".join(f"{key}: {value}" for key, value in driven.items()),
            "The other objects calibrate the instrument of each; CoM known for single pushes.",
        ),
        Section("The same in numbers", "\n".join(lines), f"Informative: below {INFORMATIVE:.0%}."),
        Section(
            "CoM from many slow pushes",
            "\n".join(f"{name}: {error} mm" for name, error in (errors | block).items()),
            "Distance from the true CoM; limit-surface laws, no object of known CoM needed.",
        ),
    )
    return sections, entries


@experiment(SweepSettings)
def main(settings: SweepSettings, folder: Path) -> dict[str, Any]:
    """Runs the main job and the methods that need no training on features."""
    return sweep_result("mdataset", settings, folder, real_pushes)


if __name__ == "__main__":
    main()
