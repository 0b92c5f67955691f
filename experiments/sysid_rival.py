"""Pushes fitted a second, and how well: this package's fit against `mujoco.sysid`.

    pip install -e ".[rival]"
    python experiments/sysid_rival.py [pushes=64] [rival_pushes=8] [speed=0.04] [seed=1]

Same pushes, scene, step, noise, unknowns, starting values and cores, in one process. The truth is
simulated once, in float64; each push is then fitted by itself, from force, moment and twist at
100 Hz with the noise of `bound.py`. Unknown: mass, I_zz, CoM, both frictions and the tip contact's
time constant, started 12 to 25 % off. Known: outline, c, the pose at the start and the tip's path.
The rival sees forces averaged over a sample as ours are, and fits every n-th push only: it is slow.
`speed=all` takes pushes of every speed.
"""

import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import jax
import numpy as np
from absl import logging

from mjx_inertia import runtime
from mjx_inertia.dataset import (
    CubesProtocol,
    SensorNoise,
    cubes_plan,
    known_setup,
    provenance,
    select_pushes,
)
from mjx_inertia.estimators.sysid import (
    SysidProblem,
    SysidSettings,
    fit,
    observed,
    to_coordinates,
    to_parameters,
)
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import cube
from mjx_inertia.pushing import (
    PushParameters,
    PushRecord,
    PushStatus,
    build_scene,
    simulate,
)
from parts.rival_fit import OPTIMIZERS, Problem, fit_rival

SPREAD = 0.05  # of the noise: three standard deviations over the value
NOISE = SensorNoise(SPREAD, 1.0)
FLOOR = np.array([0.02, 0.02, 2e-4, 2e-4, 2e-4, 2e-3])  # f_x, f_y N, m N m, v_x, v_y m/s, ω rad/s
TURNS = 2  # of both: the rival's pushes in so many parts, ours whole after each
OFF = (0.12, 0.25)  # how far off a fit starts; the CoM: as a share of half the edge


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    pushes: int = 64
    rival_pushes: int = 8  # of them
    speed: float | Literal["all"] = 0.04  # m/s
    seed: int = 1  # of noise and starting values


def guesses(p: PushParameters, lowest_time_constant: float, seed: int) -> PushParameters:
    """Starting values: the truth, each unknown off by a random share within `OFF`."""
    rng, n = np.random.default_rng([seed, 1]), len(p.mass)  # not the noise's

    def off() -> np.ndarray:
        return rng.uniform(*OFF, n) * rng.choice([-1.0, 1.0], n)

    com, half = np.array(p.com), np.asarray(p.half_extents)
    com[:, 0] += off() * half[:, 0]
    com[:, 1] += off() * half[:, 1]
    contact = np.asarray(p.tip_time_constant) * (1 + off())
    return p.replace(
        mass=np.asarray(p.mass) * (1 + off()),
        inertia=np.asarray(p.inertia) * (1 + off())[:, None],
        com=com,
        friction=np.asarray(p.friction) * (1 + off()),
        tip_friction=np.asarray(p.tip_friction) * (1 + off()),
        # MuJoCo takes less than two steps as two steps: no start there, where nothing changes
        tip_time_constant=np.maximum(contact, 1.1 * lowest_time_constant),
    )


def make_problem(pushes: int, speed: float | Literal["all"], seed: int) -> Problem:
    """Draws pushes that go well, simulates them and adds noise."""
    scene = build_scene(cube(0.15, 1.0))
    plan = cubes_plan(CubesProtocol(pushes_per_cube=10), seed=1)
    if speed != "all":
        chosen = np.flatnonzero(np.isclose(plan.motion.speed, speed))
        if not len(chosen):
            raise ValueError(f"speed={speed}: there are {np.unique(plan.motion.speed).tolist()}")
        plan = select_pushes(plan, chosen)
    plan = select_pushes(plan, np.linspace(0, len(plan) - 1, pushes).round().astype(int))
    record = simulate(
        scene,
        plan.parameters,
        plan.motion,
        contact_point=plan.contact_point,
        contact_normal=plan.contact_normal,
    )
    clean = np.concatenate([record.force, record.moment[..., None], record.twist], -1)
    sigma = SPREAD / 3 * np.abs(clean) + FLOOR
    measured = clean + sigma * np.random.default_rng(seed).standard_normal(clean.shape)
    start = guesses(plan.parameters, 2 * scene.settings.timestep, seed)
    whole = Problem(scene, plan, start, measured, sigma, np.asarray(record.length))
    return whole.take(np.flatnonzero(record.status == PushStatus.OK))


def fit_ours(problem: Problem) -> tuple[PushParameters, float]:
    """This package's fit of all pushes.

    Returns:
      The estimates (NaN where a fit failed), and the seconds it took: at first with compilation.
    """
    scene, start = problem.scene, problem.start
    settings = SysidSettings(noise=NOISE, channels=("force", "moment", "velocity", "spin"))
    half = np.asarray(start.half_extents)
    plate = np.asarray(start.mass) * (half[:, 0] ** 2 + half[:, 1] ** 2) / 3
    values = {
        "mass": start.mass,
        "inertia": np.asarray(start.inertia)[:, 2] / plate,
        "com_x": np.asarray(start.com)[:, 0] / half[:, 0],
        "com_y": np.asarray(start.com)[:, 1] / half[:, 1],
        "friction": start.friction,
        "tip_friction": start.tip_friction,
        "tip_time_constant": start.tip_time_constant,
    }
    z = np.asarray(to_coordinates(values, settings))
    setup = known_setup(problem.plan)
    pushes = SysidProblem.of(scene, observed(record_of(problem), settings), setup, settings)
    begin = time.perf_counter()
    found = fit(pushes, z, key=jax.random.key(0))
    seconds = time.perf_counter() - begin
    to = jax.vmap(lambda z, s: to_parameters(z, s, np.zeros(2), settings)[0])
    return to(found.search.z, setup), seconds


def record_of(problem: Problem) -> PushRecord:
    """The measurements as a record whose reference point is the origin of the object frame."""
    n, t, _ = problem.measured.shape
    rate = problem.scene.settings.rate
    still = np.zeros((n, t, 2))
    return PushRecord(
        time=np.tile((np.arange(t) + 1) / rate, (n, 1)),
        force=problem.measured[..., :2],
        moment=problem.measured[..., 2],
        twist=problem.measured[..., 3:],
        pose=np.zeros((n, t, 3)),  # not measured
        tip_position=still,
        tip_velocity=still,
        contact_point=np.zeros((n, 2)),
        contact_normal=np.tile([1.0, 0.0], (n, 1)),
        length=problem.length,
        status=np.zeros(n, np.int32),
    )


def errors(problem: Problem, estimate: PushParameters) -> dict[str, float]:
    """Errors of the pushes whose fit did not fail, and how many did."""
    truth = problem.plan.parameters
    mass = 100 * (np.asarray(estimate.mass) / np.asarray(truth.mass) - 1)
    inertia = 100 * (np.asarray(estimate.inertia)[:, 2] / np.asarray(truth.inertia)[:, 2] - 1)
    com = 1e3 * np.abs(np.asarray(estimate.com) - np.asarray(truth.com))
    return {
        "mass_percent": round(float(np.nanmean(np.abs(mass))), 3),
        "inertia_median_percent": round(float(np.nanmedian(np.abs(inertia))), 3),
        "mass_median_percent": round(float(np.nanmedian(np.abs(mass))), 3),
        "com_x_mm": round(float(np.nanmean(com[:, 0])), 4),
        "com_x_median_mm": round(float(np.nanmedian(com[:, 0])), 4),
        "com_y_mm": round(float(np.nanmean(com[:, 1])), 4),
        "com_y_median_mm": round(float(np.nanmedian(com[:, 1])), 4),
        "failures": int(np.isnan(mass).sum()),
    }


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Fits, and prints a line for each fit."""
    jax.config.update("jax_compilation_cache_dir", tempfile.mkdtemp())  # compile_s from cold
    runtime.configure(float64=True)
    logging.set_verbosity(logging.ERROR)  # each sequence warns of sensors that are not measured
    problem = make_problem(options.pushes, options.speed, options.seed)
    few = min(options.rival_pushes, len(problem))
    chosen = np.linspace(0, len(problem) - 1, few).round().astype(int)
    shared = problem.take(chosen)
    print(f"{len(problem)} pushes, {len(shared)} of them for the rival; at the start:")
    print(errors(problem, problem.start))
    _, first = fit_ours(problem)
    seconds: dict[str, list[float]] = {name: [] for name in ("ours", *OPTIMIZERS)}
    found: dict[str, list[PushParameters]] = {name: [] for name in OPTIMIZERS}
    estimate = problem.start
    for turn in np.array_split(np.arange(len(shared)), min(TURNS, len(shared))):
        for optimizer in OPTIMIZERS:
            part, took = fit_rival(shared.take(turn), optimizer)
            found[optimizer].append(part)
            seconds[optimizer].append(took)
        estimate, took = fit_ours(problem)
        seconds["ours"].append(took)
    rival = {}
    for optimizer in OPTIMIZERS:
        whole = jax.tree.map(lambda *x: np.concatenate(x), *found[optimizer])
        rate = len(shared) / sum(seconds[optimizer])
        rival[optimizer] = {"pushes_per_s": round(rate, 3), **errors(shared, whole)}
        print(f"mujoco.sysid, {optimizer}: {rival[optimizer]}")
    best = max(v["pushes_per_s"] for v in rival.values())
    took = statistics.median(seconds["ours"])
    rate = len(problem) / took
    result = {
        "pushes": len(problem),
        "rival_pushes": len(shared),
        "rival_pushes_per_s": best,
        "ours_pushes_per_s": round(rate, 3),
        "ratio": round(rate / best, 2),
        "compile_s": round(first - took, 1),
        "ours": errors(problem, estimate),
        "ours_on_rival_pushes": errors(
            shared, jax.tree.map(lambda x: np.asarray(x)[chosen], estimate)
        ),
    }
    print(
        f"ours: {result['ours']}, {rate:.3g} pushes/s, {[round(s, 1) for s in seconds['ours']]} s"
    )
    return {**result, "rival": rival, "device": provenance()["device"]}


if __name__ == "__main__":
    main()
