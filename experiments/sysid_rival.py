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

import contextlib
import functools
import io
import statistics
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import jax
import mujoco
import numpy as np
from absl import logging
from mujoco import sysid

from mjx_inertia import runtime
from mjx_inertia.dataset import CubesProtocol, SensorNoise, cubes_plan, provenance
from mjx_inertia.dataset.plan import PushPlan, known_setup, select_pushes
from mjx_inertia.estimators.sysid import (
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
    Scene,
    build_scene,
    build_spec,
    resting_height,
    simulate,
)

if not hasattr(sysid, "ParameterDict"):  # without its dependencies MuJoCo leaves the module empty
    raise ModuleNotFoundError("mujoco.sysid: pip install -e '.[rival]'", name="mujoco[sysid]")

SPREAD = 0.05  # of the noise: three standard deviations over the value
NOISE = SensorNoise(SPREAD, 1.0)
FLOOR = np.array([0.02, 0.02, 2e-4, 2e-4, 2e-4, 2e-3])  # f_x, f_y N, m N m, v_x, v_y m/s, ω rad/s
CHANNELS = ("f_x", "f_y", "m", "v_x", "v_y", "w")
TURNS = 2  # of both: the rival's pushes in so many parts, ours whole after each
OFF = (0.12, 0.25)  # how far off a fit starts; the CoM: as a share of half the edge
Optimizer = Literal["mujoco", "scipy_parallel_fd"]
OPTIMIZERS: tuple[Optimizer, ...] = ("mujoco", "scipy_parallel_fd")  # "scipy": as the second
# With this relative step, differences are right to 1e-4; with the default, 1.5e-8, to some 1 %.
FD_STEP = 1e-6
MAX_ITERATIONS = 50
MU_FACTOR = 10**0.5  # of "mujoco": its default, 10**0.1, takes three times as long to give up
TOLERANCE = 1e-6  # relative change of the unknowns, or of the cost, at which a fit is done
RIVAL_TIP_MASS = 1e9  # kg; its tip keeps the speed that it starts with
# With the default, 1e-8, and so heavy a tip the solver stops before its first iteration and forces
# are wrong by many times the noise; 0 gives the forces of 1e-18 and takes three times as long.
RIVAL_SOLVER_TOLERANCE = 1e-18


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    pushes: int = 64
    rival_pushes: int = 8  # of them
    speed: float | Literal["all"] = 0.04  # m/s
    seed: int = 1  # of noise and starting values


@dataclass(frozen=True, eq=False)
class Problem:
    """Pushes to fit, n of them, and what a fit may know.

    Attributes:
      scene: that they were simulated in.
      plan: the tips' paths; its parameters are the truth, for the errors alone.
      start: initial guess: outline and c are true, the unknowns are not.
      measured: (n, t, 6) noisy `CHANNELS`, about the origin of the object frame, world axes.
      sigma: (n, t, 6) standard deviation of the noise.
      length: (n,) valid samples.
    """

    scene: Scene
    plan: PushPlan
    start: PushParameters
    measured: np.ndarray
    sigma: np.ndarray
    length: np.ndarray

    def __len__(self) -> int:
        """Number of pushes."""
        return len(self.length)

    def take(self, index: np.ndarray) -> "Problem":
        """The pushes at `index`."""
        start = jax.tree.map(lambda x: x[index], self.start)
        arrays = (x[index] for x in (self.measured, self.sigma, self.length))
        return Problem(self.scene, select_pushes(self.plan, index), start, *arrays)


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


# --- ours -----------------------------------------------------------------------------------------


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
    known = observed(record_of(problem), settings), setup, np.zeros(2), settings
    begin = time.perf_counter()
    found = fit(scene, z, *known, key=jax.random.key(0))
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


# --- the rival ------------------------------------------------------------------------------------


def rival_spec(scene: Scene, half_extents: np.ndarray) -> mujoco.MjSpec:
    """The scene of one push with the sensors that the fit reads."""
    spec = build_spec(scene.object_model, scene.settings)
    spec.geom("hull0").size = half_extents
    spec.geom("hull0").pos = (0.0, 0.0, half_extents[2])
    spec.geom("tip").mass = RIVAL_TIP_MASS
    spec.option.tolerance = RIVAL_SOLVER_TOLERANCE
    data = (mujoco.mjtConDataField.mjCONDATA_FORCE, mujoco.mjtConDataField.mjCONDATA_POS)
    spec.add_sensor(
        name="contact",
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_GEOM,
        objname="tip",
        reftype=mujoco.mjtObj.mjOBJ_GEOM,
        refname="hull0",
        intprm=(sum(1 << int(d) for d in data), 3, 1),  # the data, the net force, one slot
    )
    return spec


def rival_parameters(start: PushParameters, lowest_time_constant: float) -> sysid.ParameterDict:
    """The unknowns over their starting values (the CoM: over half the edge), and what they set."""
    half, radius = np.asarray(start.half_extents), float(start.friction_radius)
    height = float(start.com[2])

    def mass(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
        spec.body("object").mass = float(start.mass) * p.value[0]

    def inertia(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
        spec.body("object").inertia = np.full(3, float(start.inertia[2]) * p.value[0])

    def com(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
        x, y = p.value * half[:2]
        spec.body("object").ipos = (x, y, height)
        spec.geom("foot0").pos = (x, y, spec.geom("foot0").size[0])

    def friction(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
        mu = float(start.friction) * p.value[0]
        spec.pair("floor0").friction = (mu, mu, mu * radius, 0.0, 0.0)

    def tip_friction(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
        mu = float(start.tip_friction) * p.value[0]
        spec.pair("tip0").friction = (mu, mu, 0.0, 0.0, 0.0)

    def tip_time_constant(spec: mujoco.MjSpec, p: sysid.Parameter) -> None:
        spec.pair("tip0").solref = (float(start.tip_time_constant) * p.value[0], 1.0)

    lowest = lowest_time_constant / float(start.tip_time_constant)
    unknowns = sysid.ParameterDict()
    unknowns.add(sysid.Parameter("mass", 1.0, 0.3, 3.0, modifier=mass))
    unknowns.add(sysid.Parameter("inertia", 1.0, 0.1, 10.0, modifier=inertia))
    begin = np.asarray(start.com)[:2] / half[:2]
    unknowns.add(sysid.Parameter("com", begin, [-0.9, -0.9], [0.9, 0.9], modifier=com))
    unknowns.add(sysid.Parameter("friction", 1.0, 0.3, 3.0, modifier=friction))
    unknowns.add(sysid.Parameter("tip_friction", 1.0, 0.1, 10.0, modifier=tip_friction))
    unknowns.add(sysid.Parameter("tip_time_constant", 1.0, lowest, 5.0, modifier=tip_time_constant))
    return unknowns


def rival_estimate(start: PushParameters, unknowns: sysid.ParameterDict) -> PushParameters:
    """The fitted unknowns as parameters."""
    x = {k: v.value for k, v in unknowns.items()}
    com = np.array(start.com)
    com[:2] = x["com"] * np.asarray(start.half_extents)[:2]
    ratios = ("mass", "inertia", "friction", "tip_friction", "tip_time_constant")
    scaled = {k: np.asarray(getattr(start, k)) * x[k].item() for k in ratios}
    return start.replace(com=com, **scaled)


def rival_residual(
    params: sysid.ParameterDict,
    predicted: sysid.TimeSeries,
    measured: sysid.TimeSeries,
    model: mujoco.MjModel,
    return_pred_all: bool,
    *,
    state: np.ndarray,
    first: np.ndarray,
    sigma: np.ndarray,
    **_: None,
) -> tuple[np.ndarray, sysid.TimeSeries, sysid.TimeSeries]:
    """Weighted errors of the `CHANNELS`, forces averaged over the steps of a sample.

    A rollout gives the state (time, q, v) after each step and the sensors of before it.
    """
    del params, return_pred_all
    force, point = predicted.data[:, :2], predicted.data[:, 3:5]
    arm = point - np.concatenate([first[None, 1:3], state[:-1, 1:3]])
    moment = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    samples = len(measured.times)
    wrench = np.c_[force, moment].reshape(samples, -1, 3).mean(1)
    last = slice(len(state) // samples - 1, None, len(state) // samples)
    twist = state[last, 1 + model.nq :][:, [0, 1, 3]]
    residual = (measured.data - np.c_[wrench, twist]) / sigma
    return residual, measured, measured  # of the series, a fit looks at the residual alone


def rival_sequence(problem: Problem, i: int) -> tuple[sysid.ModelSequences, np.ndarray]:
    """What was measured in push i, in the rival's terms, and the state at its start."""
    scene, motion = problem.scene, problem.plan.motion
    spec = rival_spec(scene, np.asarray(problem.start.half_extents)[i])
    model = spec.compile()
    qpos, qvel = np.zeros(model.nq), np.zeros(model.nv)
    qpos[2], qpos[-2:] = resting_height(scene), np.asarray(motion.start)[i]
    qvel[-2:] = np.asarray(motion.direction)[i] * np.asarray(motion.speed)[i]
    state = sysid.create_initial_state(model, qpos, qvel)
    samples, settings = int(problem.length[i]), scene.settings
    control = np.arange(samples * settings.substeps + 1) * settings.timestep
    measured = sysid.TimeSeries.from_custom_map(
        (np.arange(samples) + 1) / settings.rate, problem.measured[i, :samples], CHANNELS
    )
    sequence = sysid.ModelSequences(
        "push",
        spec,
        "push",
        state,
        sysid.TimeSeries(control, np.zeros((len(control), 0)), {}),  # nothing is controlled
        measured,
        allow_missing_sensors=True,  # its own count of sensors; ours are the channels
    )
    return sequence, state


def fit_rival_push(problem: Problem, i: int, optimizer: Optimizer, threads: int) -> PushParameters:
    """Push i fitted by one optimiser of `mujoco.sysid`, its rollouts on so many threads."""
    start = jax.tree.map(lambda x: np.asarray(x)[i], problem.start)
    sequence, state = rival_sequence(problem, i)
    samples = int(problem.length[i])
    residual = sysid.build_residual_fn(
        models_sequences=[sequence],
        modify_residual=functools.partial(
            rival_residual, first=state, sigma=problem.sigma[i, :samples]
        ),
        n_threads=threads,
        resample_true=False,
    )
    options: dict[str, Any] = {"eps": FD_STEP, "xtol": TOLERANCE, "mu_factor": MU_FACTOR}
    if optimizer != "mujoco":
        options = {"diff_step": FD_STEP, "xtol": TOLERANCE, "ftol": TOLERANCE, "gtol": None}
    unknowns = rival_parameters(start, 2 * problem.scene.settings.timestep)
    fitted, _ = sysid.optimize(
        unknowns, residual, optimizer, verbose=False, max_iters=MAX_ITERATIONS, **options
    )
    return rival_estimate(start, fitted)


def fit_rival(
    problem: Problem, optimizer: Optimizer, *, at_once: bool = True
) -> tuple[PushParameters, float]:
    """Fits all pushes on all cores.

    Args:
      problem: the pushes.
      optimizer: of `mujoco.sysid`.
      at_once: as many pushes at a time as there are cores, each on one of them, which keeps the
        cores busier than one push at a time whose rollouts share them.

    Returns:
      The estimates (NaN where a fit failed: a rollout that diverges raises) and the seconds.
    """
    cores = runtime.cores()
    workers, threads = (cores, 1) if at_once else (1, cores)

    def fit(i: int) -> PushParameters:
        try:
            return fit_rival_push(problem, i, optimizer, threads)
        except (ValueError, np.linalg.LinAlgError) as error:
            print(f"push {i}, {optimizer}: {error}", file=sys.stderr)
            return jax.tree.map(lambda x: np.nan * np.asarray(x)[i], problem.start)

    begin = time.perf_counter()
    # its optimisers cannot be told to be silent
    with contextlib.redirect_stdout(io.StringIO()), ThreadPoolExecutor(workers) as pool:
        estimates = list(pool.map(fit, range(len(problem))))
    seconds = time.perf_counter() - begin
    return jax.tree.map(lambda *x: np.stack(x), *estimates), seconds


# --- both -----------------------------------------------------------------------------------------


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
