"""Simulated pushes a second: this simulator against C MuJoCo's `mujoco.batch` on all cores.

    python experiments/throughput.py [pushes=2400] [repeats=5]

Same pushes (every n-th of the 48,000), scene, time step and signals, alternating in one process.
The rival records inside its own threads and steps each push on a model compiled for it; its tip has
a mass of 10⁹ kg, so that it needs no control. Compilation is timed apart.
"""

import os
import resource
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import mujoco
import mujoco.batch
import numpy as np

from mjx_inertia import runtime
from mjx_inertia.dataset import CubesProtocol, PushPlan, cubes_plan, provenance, select_pushes
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import cube
from mjx_inertia.pushing import (
    PushRecord,
    Scene,
    build_scene,
    recompile,
    resting_height,
    simulate,
)

FULL = 48_000


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    pushes: int = 2400  # of the 48,000
    repeats: int = 5  # of both, in turn


def ours(scene: Scene, plans: list[PushPlan]) -> list[PushRecord]:
    """All signals, one speed after the other."""
    return [
        simulate(
            scene,
            p.parameters,
            p.motion,
            contact_point=p.contact_point,
            contact_normal=p.contact_normal,
        )
        for p in plans
    ]


def rival_batches(scene: Scene, plans: list[PushPlan]) -> list[tuple[mujoco.batch.Batch, int]]:
    """One batch for each speed and its number of steps; compiling its models is not timed."""
    batches = []
    for plan in plans:
        models = []
        for i in range(len(plan)):
            model = recompile(scene, jax.tree.map(lambda x, i=i: x[i], plan.parameters))
            model.body_mass[scene.tip_body] = 1e9
            # MuJoCo's own tolerance, in the scale of the object: with the tip's mass in that scale
            # the solver would stop before it has begun
            model.opt.tolerance = 1e-8
            model.stat.meaninertia = float(plan.parameters.mass[i])
            models.append(model)
        batch = mujoco.batch.Batch(models[0], len(plan), os.cpu_count() or 1)
        batch.set_models(models)
        steps = round(float(plan.motion.duration[0]) / scene.settings.timestep)
        batches.append((batch, steps))
    return batches


def rival(
    scene: Scene, plans: list[PushPlan], batches: list[tuple[mujoco.batch.Batch, int]]
) -> list[dict[str, np.ndarray]]:
    """The same signals: mean force of the tip, pose, twist, tip position and velocity."""
    results = []
    for plan, (batch, steps) in zip(plans, batches, strict=True):
        batch.reset()
        qpos, qvel = batch.bind("qpos"), batch.bind("qvel")
        qpos[:, 2] = resting_height(scene)
        qpos[:, -2:] = plan.motion.start
        qvel[:, -2:] = plan.motion.direction * plan.motion.speed[:, None]
        parts = []
        segment = 125 * scene.settings.substeps  # as ours: bounds the memory
        for first in range(0, steps, segment):
            n = min(segment, steps - first)
            out = batch.rollout(n, record=("qfrc_constraint", "qpos", "qvel"))
            force = -out["qfrc_constraint"][:, :, -2:]
            force = force.reshape(len(plan), -1, scene.settings.substeps, 2).mean(2)
            every = slice(scene.settings.substeps - 1, None, scene.settings.substeps)
            state = [out[k][:, every].astype(np.float32) for k in ("qpos", "qvel")]
            parts.append((force.astype(np.float32), *state))
        force, qpos_t, qvel_t = (np.concatenate(x, 1) for x in zip(*parts, strict=True))
        results.append({"force": force, "qpos": qpos_t, "qvel": qvel_t})
    return results


def timed(run: Callable[[], list]) -> tuple[float, list]:
    """Seconds and result of one run."""
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Measures, and prints all times of both."""
    pushes, repeats = options.pushes, options.repeats
    jax.config.update("jax_compilation_cache_dir", tempfile.mkdtemp())  # compile_s from cold
    runtime.configure()
    whole = cubes_plan(CubesProtocol(), seed=0)
    plan = select_pushes(whole, np.linspace(0, FULL - 1, pushes).round().astype(int))
    speeds = np.unique(plan.motion.speed)
    plans = [select_pushes(plan, np.flatnonzero(plan.motion.speed == s)) for s in speeds]
    scene = build_scene(cube(0.15, 1.0))
    first, records = timed(lambda: ours(scene, plans))
    batches = rival_batches(scene, plans)
    _, theirs = timed(lambda: rival(scene, plans, batches))
    for record, other in zip(records, theirs, strict=True):
        t = other["qpos"].shape[1]
        pose = np.abs(record.pose[:, :t, :2] - other["qpos"][..., :2]).max(axis=(1, 2))
        print(
            f"same end poses: {1e3 * np.median(pose):.3f} mm median, {1e3 * pose.max():.2f} mm max"
        )
    seconds: dict[str, list[float]] = {"ours": [], "rival": []}
    for _ in range(repeats):
        seconds["ours"].append(timed(lambda: ours(scene, plans))[0])
        seconds["rival"].append(timed(lambda: rival(scene, plans, batches))[0])
    rate = {k: pushes / statistics.median(v) for k, v in seconds.items()}
    for name, values in seconds.items():
        print(f"{name}: {[round(v, 2) for v in values]} s for {pushes} pushes")
    return {
        "pushes_per_s": round(rate["ours"], 1),
        "rival_pushes_per_s": round(rate["rival"], 1),
        "ratio": round(rate["ours"] / rate["rival"], 3),
        "compile_s": round(first - statistics.median(seconds["ours"]), 1),
        "full_dataset_minutes": round(FULL / rate["ours"] / 60, 2),
        "peak_rss_gib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 2),
        "device": provenance()["device"],
    }


if __name__ == "__main__":
    main()
