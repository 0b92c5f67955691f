"""Mass of real objects from learners that have seen simulated pushes only.

    python experiments/sim_to_real.py [root=PATH] [pushes=12000] [seed=0]

Boosted trees and a network are trained on simulated pushes of boxes in which masses, sizes,
friction, contact and the instrument are drawn widely (`SlidersProtocol`), and then read the
measured pushes below PATH (`MJX_INERTIA_DATA` if none is given), of which no mass is used but to
tell the error.

How far the training mean is off depends on which masses are drawn, so two sets are: `wide`, 0.3 to
6 kg, whose mean is far from the real objects, and `near`, the part of it from 0.4 to 2.5 kg.
Headline: `wide`.
"""

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from mjx_inertia import runtime
from mjx_inertia.dataset import (
    McubeFolder,
    PushBatch,
    SensorNoise,
    add_noise,
    load_mcube_folder,
)
from mjx_inertia.dataset.mcube import velocities
from mjx_inertia.dataset.mcube_file import Signal
from mjx_inertia.estimators import ESTIMATORS, BoostedSettings, MeanSettings, MlpSettings
from mjx_inertia.experiment import experiment
from mjx_inertia.features import Examples, examples, take_examples
from mjx_inertia.objects import cuboid
from mjx_inertia.pushing import PushRecord, SceneSettings, build_scene, simulate
from parts.slider_plan import (
    Instrument,
    SliderPlan,
    SlidersProtocol,
    SwingingMotion,
    sliders_plan,
)

RATE = 100.0  # Hz, of what the learners see
RAW_RATE = 200.0  # Hz, of the simulation: one step a sample
SETS = {"wide": (0.3, 6.0), "near": (0.4, 2.5)}  # kg
INFORMATIVE = 0.05, 0.75  # at least m/s, at most rad from the normal: `physics-notes`, not tuned
TRACKING = 2e-5, 3e-4  # m, rad: noise of one pose
VALIDATION = 0.1  # share of the simulated pushes that is predicted and not fitted
LEARNERS: dict[str, tuple[str, Any]] = {
    "boosted": ("onset", BoostedSettings(depth=6, learning_rate=0.05)),
    "mlp": ("series", MlpSettings(epochs=40, width=192)),
    "mean": ("moments", MeanSettings()),
}


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    root: str | None = None  # of the real pushes; None: `MJX_INERTIA_DATA`
    pushes: int = 12_000  # simulated
    seed: int = 0


@dataclass(frozen=True)
class Errors:
    """Masses of many pushes, predicted and true, kg, with predicted standard deviations."""

    estimate: Float[np.ndarray, " n"]
    deviation: Float[np.ndarray, " n"]
    truth: Float[np.ndarray, " n"]

    @property
    def percent(self) -> Float[np.ndarray, " n"]:
        """Relative error."""
        return 100.0 * (self.estimate / self.truth - 1.0)

    def rows(self, chosen: np.ndarray) -> "Errors":
        """Some of the pushes."""
        return Errors(self.estimate[chosen], self.deviation[chosen], self.truth[chosen])

    def figures(self) -> dict[str, float | int]:
        """Errors and coverage in percent."""
        error = self.percent
        if not len(error):
            return {"n": 0}
        covered = np.abs(self.estimate - self.truth) < 1.96 * self.deviation
        values = {
            "abs_mean": np.abs(error).mean(),
            "abs_median": np.median(np.abs(error)),
            "signed_mean": error.mean(),
            "covered_95": 100.0 * covered.mean(),
        }
        return {"n": len(error), **{k: round(float(v), 1) for k, v in values.items()}}


def slope_kernel() -> Float[np.ndarray, " k"]:
    """Weights by which the reader of real pushes takes a velocity, at the raw rate, 1/s."""
    reach = 9
    impulses = Signal(np.arange(-reach, reach + 1) / RAW_RATE, np.eye(2 * reach + 1))
    return velocities(impulses, np.zeros(1))[0]


def read_by_instrument(
    raw: PushRecord, plan: SliderPlan, protocol: SlidersProtocol, key: jax.Array
) -> PushRecord:
    """Simulated signals as the sensors would give them and the reader of real files take them.

    The force gains what the probe's inertia adds and, while the probe bends without moving the
    object, its preload and bending; the tip is seen where the drive is; velocities are slopes of
    noisy poses; force and motion are out of step by a lag.
    """
    motion, tool = plan.pushes.motion, plan.instrument
    assert isinstance(motion, SwingingMotion)
    count, rng = raw.time.shape[1], np.random.default_rng(int(jax.random.bits(key)))
    time_of = np.arange(1, count + 1) / RAW_RATE
    driven = np.asarray(jax.vmap(motion.__class__.driven, (0, None))(motion, time_of))
    force = _sensed_force(raw, motion, tool, driven, time_of)
    tip = np.asarray(motion.start)[:, None] + driven[:, :, None] * motion.direction[:, None]
    noise = np.array([TRACKING[0]] * 2 + [TRACKING[1]] + [TRACKING[0]] * 2)
    track = np.concatenate([raw.pose, tip], -1)
    track = track + noise * rng.standard_normal(track.shape)

    kernel = slope_kernel()
    inside = np.lib.stride_tricks.sliding_window_view(track, len(kernel), axis=1)
    rate = inside @ kernel
    every, edge = round(RAW_RATE / RATE), len(kernel) // 2
    kept = np.arange(edge + edge % every + 1, count - edge, every)
    rate, track = rate[:, kept - edge], track[:, kept]
    averaged = 0.5 * (force[:, kept] + force[:, kept - 1])
    half = np.asarray(plan.pushes.parameters.half_extents)[:, None, :2]
    arm = _closest_on_box(track[..., :3], track[..., 3:], half)
    whole = np.floor((np.asarray(motion.duration) - protocol.trail) * RATE).astype(np.int32)
    length = np.minimum(whole - int(kept[0] / every), len(kept)).astype(np.int32)
    length = np.minimum(length, np.ceil(np.asarray(raw.length) / every).astype(np.int32))
    single = np.float32
    record = PushRecord(
        time=np.broadcast_to((np.arange(len(kept)) + 1) / RATE, (len(tip), len(kept))).astype(
            single
        ),
        force=averaged.astype(single),
        moment=(arm[..., 0] * averaged[..., 1] - arm[..., 1] * averaged[..., 0]).astype(single),
        pose=track[..., :3].astype(single),
        twist=rate[..., :3].astype(single),
        tip_position=track[..., 3:].astype(single),
        tip_velocity=rate[..., 3:].astype(single),
        contact_point=raw.contact_point,
        contact_normal=raw.contact_normal,
        length=length,
        status=raw.status,
    )
    sensors = SensorNoise(spread=0.05, floor=1.0, velocity=0.0, spin=0.0, position=0.0, yaw=0.0)
    return add_noise(record, np.arange(len(tip), dtype=np.uint32), sensors, key=key)


def _sensed_force(
    raw: PushRecord,
    motion: SwingingMotion,
    tool: Instrument,
    driven: Float[np.ndarray, "n t"],
    time_of: Float[np.ndarray, " t"],
) -> Float[np.ndarray, "n t 2"]:
    """The force at the sensor: that on the object and what the probe adds, late and off, N."""
    acceleration = np.gradient(np.asarray(raw.tip_velocity), 1.0 / RAW_RATE, axis=1)
    force = raw.force + np.asarray(tool.probe_mass)[:, None, None] * acceleration
    held = time_of < np.asarray(motion.lead + motion.held())[:, None]
    bent = np.asarray(tool.stiffness)[:, None] * np.maximum(driven - tool.gap[:, None], 0.0)
    bending = bent[:, :, None] * motion.direction[:, None]
    bending = bending + (np.asarray(tool.preload)[:, None] * raw.contact_normal)[:, None]
    force = np.where(held[:, :, None], bending, force)
    shift = np.asarray(tool.lag)[:, None, None] * RAW_RATE  # of one sample, below 1
    before, after = np.roll(force, 1, 1), np.roll(force, -1, 1)
    late = force + np.maximum(shift, 0) * (before - force) + np.maximum(-shift, 0) * (after - force)
    return np.asarray(tool.gain)[:, None, None] * late + np.asarray(tool.bias)[:, None]


def _closest_on_box(
    pose: Float[np.ndarray, "n t 3"], tip: Float[np.ndarray, "n t 2"], half: np.ndarray
) -> Float[np.ndarray, "n t 2"]:
    """From the object frame's origin to the box's point that is closest to the tip, m, world."""
    cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = np.moveaxis(tip - pose[..., :2], -1, 0)
    inside = np.clip(np.stack([cos * x + sin * y, cos * y - sin * x], -1), -half, half)
    # The drive runs ahead of the tip into the box: the touched face is the one at -x.
    inside[..., 0] = np.where(np.abs(inside[..., 1]) < half[..., 1], -half[..., 0], inside[..., 0])
    u, v = np.moveaxis(inside, -1, 0)
    return np.stack([cos * u - sin * v, sin * u + cos * v], -1)


def simulated(protocol: SlidersProtocol, seed: int) -> PushBatch:
    """Simulated pushes as the instrument reads them, with their truth."""
    plan = sliders_plan(protocol, seed)
    scene = build_scene(
        cuboid((0.1, 0.1, 0.1), 1.0), SceneSettings(rate=RAW_RATE, tip_radius=protocol.tip_radius)
    )
    pushes = plan.pushes
    raw = simulate(
        scene,
        pushes.parameters,
        pushes.motion,
        contact_point=pushes.contact_point,
        contact_normal=pushes.contact_normal,
    )
    records = read_by_instrument(raw, plan, protocol, jax.random.key(seed))
    truth = jax.tree.map(lambda x: np.asarray(x, np.float32), pushes.truth)
    return PushBatch(records, truth, pushes.conditions)


def mass_errors(fitted: Any, name: str, rows: Examples) -> Errors:
    """Masses that a learner answers, for all rows; NaN where a push is not usable."""
    found = ESTIMATORS[name].factory(LEARNERS[name][1]).predict(fitted, rows)
    assert rows.truth is not None
    variance = np.asarray(found.covariance)[:, 0, 0]
    return Errors(np.asarray(found.mean)[:, 0], np.sqrt(variance), np.asarray(rows.truth.mass))


def trained_and_tested(
    batch: PushBatch, real: McubeFolder, seed: int, sets: Sequence[str] = tuple(SETS)
) -> dict[str, dict[str, Any]]:
    """Figures by `<set>.<learner>`, then by which pushes: simulated ones, real ones, objects."""
    conditions = real.batch.conditions
    names = np.array(real.objects)[np.asarray(conditions.object_id)]
    informative = np.asarray(conditions.speed) >= INFORMATIVE[0] - 1e-6
    informative &= np.abs(np.asarray(conditions.angle)) <= INFORMATIVE[1]
    mass = np.asarray(batch.truth.mass)
    aside = np.random.default_rng(seed).random(len(mass)) < VALIDATION
    figures: dict[str, dict[str, Any]] = {}
    for learner, (feature_set, settings) in LEARNERS.items():
        seen, unseen = examples(batch, feature_set), examples(real.batch, feature_set)
        for part in sets:
            inside = (mass >= SETS[part][0]) & (mass <= SETS[part][1])
            estimator = ESTIMATORS[learner].factory(settings)
            fitted = estimator.fit(take_examples(seen, inside & ~aside), key=jax.random.key(seed))
            checked = mass_errors(fitted, learner, take_examples(seen, inside & aside))
            found = mass_errors(fitted, learner, unseen)
            usable = np.isfinite(found.estimate)
            figures[f"{part}.{learner}"] = {
                "simulated": checked.rows(np.isfinite(checked.estimate)).figures(),
                "real": found.rows(usable).figures(),
                "real, fast and central": found.rows(usable & informative).figures(),
                **{
                    o: found.rows(usable & (names == o)).figures() for o in np.unique(names[usable])
                },
            }
    return figures


def headline(figures: dict[str, dict[str, Any]]) -> dict[str, float | int]:
    """The figures that are published: on all usable real pushes, `wide` without a prefix."""
    entries: dict[str, float | int] = {"n": figures["wide.mean"]["real"]["n"]}
    for name, by_rows in figures.items():
        part, learner = name.split(".")
        prefix = "" if part == "wide" else f"{part}_"
        label = "baseline" if learner == "mean" else learner
        for statistic in ("abs_mean", "abs_median", "signed_mean"):
            entries[f"{prefix}{label}_{statistic}_mass_percent"] = by_rows["real"][statistic]
        entries[f"{prefix}{label}_covered_95_percent"] = by_rows["real"]["covered_95"]
    return entries


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Simulates, trains, tests and prints."""
    start = time.perf_counter()
    root = options.root or os.environ.get("MJX_INERTIA_DATA")
    if not root:
        raise ValueError("no real pushes: give root=PATH or set MJX_INERTIA_DATA to it")
    runtime.configure()
    real = load_mcube_folder(Path(root), rate=RATE, progress=False)
    batch = simulated(SlidersProtocol(pushes=options.pushes), options.seed)
    figures = trained_and_tested(batch, real, options.seed)
    for name, by_rows in figures.items():
        for rows, values in by_rows.items():
            print(f"{name:14s} {rows:24s} {values}")
    seconds = round(time.perf_counter() - start, 1)
    return {"experiment": "sim_to_real", "seconds": seconds, **headline(figures)}


if __name__ == "__main__":
    main()
