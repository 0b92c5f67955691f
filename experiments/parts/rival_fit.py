"""The fit of `mujoco.sysid`: a push in its terms, its residual and both of its optimisers.

In: a `Problem`. Out: the estimates and the seconds that they took.
"""

import contextlib
import functools
import io
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Literal

import jax
import mujoco
import numpy as np
from jaxtyping import Float, Int
from mujoco import sysid

from mjx_inertia import runtime
from mjx_inertia.dataset import PushPlan, select_pushes
from mjx_inertia.pushing import PushParameters, Scene, build_spec, resting_height

if not hasattr(sysid, "ParameterDict"):  # without its dependencies MuJoCo leaves the module empty
    raise ModuleNotFoundError("mujoco.sysid: pip install -e '.[rival]'", name="mujoco[sysid]")

CHANNELS = ("f_x", "f_y", "m", "v_x", "v_y", "w")
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


@dataclass(frozen=True, eq=False)
class Problem:
    """Pushes to fit, n of them, and what a fit may know."""

    scene: Scene  # that they were simulated in
    plan: PushPlan  # the tips' paths; its parameters are the truth, for the errors alone
    start: PushParameters  # initial guess: outline and c are true, the unknowns are not
    # noisy `CHANNELS`, about the origin of the object frame, world axes
    measured: Float[np.ndarray, "n t 6"]
    sigma: Float[np.ndarray, "n t 6"]  # standard deviation of the noise
    length: Int[np.ndarray, " n"]  # valid samples

    def __len__(self) -> int:
        """Number of pushes."""
        return len(self.length)

    def take(self, index: np.ndarray) -> "Problem":
        """The pushes at `index`."""
        start = jax.tree.map(lambda x: x[index], self.start)
        arrays = (x[index] for x in (self.measured, self.sigma, self.length))
        return Problem(self.scene, select_pushes(self.plan, index), start, *arrays)


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
