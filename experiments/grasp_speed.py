"""Metrics of ten thousand grasps along a task: this package against Pinocchio on the same cores.

    pip install -e ".[test]"
    python experiments/grasp_speed.py [grasps=10000] [waypoints=50] [repeats=5]

Baxter's left arm picks and places an object of 0.4 kg; hands are drawn around it. Joint motions are
planned once and given to both. Each then computes effort (Eq. 4.20 of the thesis), effective mass
along the path (6.8) and velocity manipulability (6.4); each grasp has its own payload in the last
link. Ours is one compiled program in which the payload is an argument, in float64 and in float32.

The rival is Pinocchio's C++ from Python in float64, one process a core that holds its data before
the clock starts, in the fastest way that its Python interface was found to offer: one call of
`rneaInParallel` for the waypoints of a grasp, `crba` in the world's axes, which leaves the Jacobian
ready for `getFrameJacobian`, and batched NumPy for the small sums. With `rnea` and
`computeFrameJacobian` called waypoint by waypoint it takes longer (`rival_plain_s`). The two
alternate, each with one run that is not timed before the one that is; compilation is timed apart,
from a cold cache.
"""

import dataclasses
import functools
import itertools
import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia import runtime
from mjx_inertia.dataset import provenance
from mjx_inertia.experiment import experiment
from mjx_inertia.grasping import (
    TASKS,
    GraspMotion,
    ReachSettings,
    grasp_costs,
    object_path,
    plan_motion,
)
from mjx_inertia.robots import Robot, baxter, over_states
from mjx_inertia.spatial import InertialParameters, Pose

NAMES = ("effort", "effective_mass", "inverse_manipulability")
TASK = TASKS["pick_and_place_1"]
PLACE = np.array([0.65, 0.3, -0.05])  # of the object in the world, m
STATES = 400  # grasps times waypoints of a block: its intermediate arrays stay in a core's cache
PARTS = 4  # of the rival's work for each process, so that none waits for the other
TOGETHER = 20  # grasps whose small sums the rival takes at once; more or fewer are slower


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    grasps: int = 10_000
    waypoints: int = 50  # of each grasp
    repeats: int = 5  # of every way, in turn


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """Grasps whose joint motions are known, on the host."""

    arm: Robot  # without the object
    payload: InertialParameters  # of the object, in its own frame
    hands: Pose  # T_obj_hand of n grasps
    motion: GraspMotion  # of each


def payload() -> InertialParameters:
    """An object of 0.4 kg that is not symmetric."""
    tensor = np.array([[4e-3, 1e-4, 0.0], [1e-4, 3e-3, 2e-4], [0.0, 2e-4, 2e-3]])
    return InertialParameters(jnp.asarray(0.4), jnp.array([0.03, -0.02, 0.04]), jnp.asarray(tensor))


def random_hands(count: int, seed: int) -> Pose:
    """Hands within 5 cm of the object's origin, up to 30° from pointing down, turned by up to 90°.

    Args:
      count: of hands.
      seed: of the draw.
    """
    rng = np.random.default_rng(seed)
    turn, lean, side = rng.uniform((-90.0, 0.0, -180.0), (90.0, 30.0, 180.0), (count, 3)).T
    down = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    axes = np.stack([np.cos(np.radians(side)), np.sin(np.radians(side)), 0.0 * side], 1)
    leaning = Rotation.from_rotvec(axes * lean[:, None], degrees=True)
    turned = Rotation.from_euler("z", turn[:, None], degrees=True) * leaning * down
    place = rng.uniform(-0.05, 0.05, (count, 3))
    return Pose(jnp.asarray(turned.as_matrix()), jnp.asarray(place))


def compiled(run: Callable[..., Any], *arguments: Any) -> tuple[Callable[..., Any], float]:
    """The program for these arguments, and the seconds that it took to compile."""
    start = time.perf_counter()
    program = jax.jit(run).lower(*arguments).compile()
    return program, time.perf_counter() - start


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds of one run, finished, and what came out."""
    start = time.perf_counter()
    result = jax.block_until_ready(run())
    return time.perf_counter() - start, result


def planned(arm: Robot, count: int, waypoints: int) -> tuple[Problem, dict[str, float]]:
    """The grasps with their joint motions, and what planning took."""
    body, hands = payload(), random_hands(count, seed=0)
    path = object_path(TASK, Pose(np.eye(3), PLACE), body.com, waypoints)
    plan = over_states(lambda hand: plan_motion(arm, hand, path), 128)
    program, compile_s = compiled(plan, hands)
    seconds, motion = timed(lambda: program(hands))
    problem = jax.tree.map(np.asarray, (body, hands, motion))
    error, reach = problem[2].error, ReachSettings()
    reached = error < np.array([reach.position_tolerance, reach.angle_tolerance])
    return Problem(arm, *problem), {
        "planning_s": round(seconds, 2),
        "planning_compile_s": round(compile_s, 1),
        "reached": round(float(np.mean(reached.all(axis=(1, 2)))), 4),
    }


def our_costs(arm: Robot, waypoints: int) -> Callable[..., Any]:
    """The metrics of all grasps, as a function of payload, hands and motions."""

    def run(body: InertialParameters, hands: Pose, motion: GraspMotion) -> Float[jax.Array, "n 3"]:
        def one(hand: Pose, motion: GraspMotion) -> Float[jax.Array, "3"]:
            return grasp_costs(arm, body, hand, motion, NAMES)[0]

        return over_states(one, max(1, STATES // waypoints))(hands, motion)

    return run


def ours(problem: Problem, *, float64: bool) -> tuple[Callable[[], Float[ndarray, "n 3"]], float]:
    """A run of the metrics on data that JAX holds, and the seconds to compile it."""
    dtype = np.float64 if float64 else np.float32
    known = (problem.payload, problem.hands, problem.motion)
    each = NamedSharding(Mesh(np.array(jax.devices()), "grasps"), PartitionSpec("grasps"))
    with jax.enable_x64(float64):
        body, *grasps = jax.tree.map(lambda x: jnp.asarray(x, dtype), known)
        held = (body, *jax.device_put(grasps, each))  # on the device that works on them
        waypoints = problem.motion.time.shape[1]
        program, compile_s = compiled(our_costs(problem.arm, waypoints), *held)
    return lambda: np.asarray(program(*held)), compile_s


# --- the rival ------------------------------------------------------------------------------------


def pinocchio_model(arm: Robot) -> tuple[pinocchio.Model, int]:
    """The arm as Pinocchio sees it, and the number of the hand's frame."""
    model, parent = pinocchio.Model(), 0
    model.gravity.linear = np.asarray(arm.gravity)
    place = pinocchio.SE3(*_of(arm.T_world_base))
    for i in range(arm.dof):
        rotation, offset = (x[i] for x in _of(arm.T_parent_joint))
        # a joint about z is Pinocchio's fastest
        if arm.prismatic[i] or not np.array_equal(arm.axis[i], [0.0, 0.0, 1.0]):
            raise ValueError(f"joint {i} of {arm.name}: expected one that turns about its z")
        place = place * pinocchio.SE3(rotation, offset)
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), place, str(i))
        link = jax.tree.map(lambda x, i=i: np.asarray(x)[i], arm.links)
        body = pinocchio.Inertia(float(link.mass), link.com, link.inertia)
        place = pinocchio.SE3.Identity()
        model.appendBodyToJoint(parent, body, place)
    model.armature = np.asarray(arm.armature)
    hand = pinocchio.SE3(*_of(arm.T_link_hand[0]))
    frame = pinocchio.Frame("hand", parent, hand, pinocchio.FrameType.OP_FRAME)
    return model, model.addFrame(frame)


def _of(pose: Pose) -> tuple[ndarray, ndarray]:
    return np.asarray(pose.rotation, np.float64), np.asarray(pose.translation, np.float64)


class Worker:
    """What a process of the rival holds."""

    def __init__(self, problem: Problem) -> None:
        model, self.frame = pinocchio_model(problem.arm)
        self.pool = pinocchio.ModelPool(model, 1)
        self.model = self.pool.getModels()[0]  # what it carries is changed grasp by grasp
        self.data = self.model.createData()
        self.bare = self.model.inertias[model.njoints - 1].copy()
        self.hand = pinocchio.SE3(*_of(problem.arm.T_link_hand[0]))
        body = problem.payload
        self.payload = pinocchio.Inertia(float(body.mass), body.com, body.inertia)
        self.hands, self.motion = problem.hands, problem.motion

    def costs(self, part: slice, *, plain: bool) -> Float[ndarray, "n 3"]:
        """The metrics of some grasps."""
        marks = [*range(part.start, part.stop, TOGETHER), part.stop]
        blocks = [slice(*ends) for ends in itertools.pairwise(marks)]
        return np.concatenate([self.block(some, plain=plain) for some in blocks])

    def block(self, grasps: slice, *, plain: bool) -> Float[ndarray, "n 3"]:
        """Effort, mean effective mass and inverse manipulability of a few grasps."""
        motion, signals = self.motion, self.plain if plain else self.fast
        n, (k, dof) = grasps.stop - grasps.start, motion.q.shape[1:]
        torque, jacobian = np.empty((n, k, dof)), np.empty((n, k, 3, dof))
        mass = np.empty((n, k, dof, dof))
        for to, i in enumerate(range(grasps.start, grasps.stop)):
            T_obj_hand = pinocchio.SE3(self.hands.rotation[i], self.hands.translation[i])
            held = (self.hand * T_obj_hand.inverse()).act(self.payload)
            self.model.inertias[self.model.njoints - 1] = self.bare + held
            q, qd, qdd = (np.asarray(x[i]) for x in (motion.q, motion.qd, motion.qdd))
            signals(q, qd, qdd, torque[to], mass[to], jacobian[to])
        linear = motion.tangent[grasps, :, :3]
        u = linear / np.sqrt((linear * linear).sum(-1, keepdims=True))
        row = u[..., None, :] @ jacobian  # uᵀ J of each waypoint
        effective = 1.0 / (row @ np.linalg.solve(mass, row.mT))[..., 0, 0]
        gram = jacobian @ jacobian.mT
        radius = 1.0 / (u[..., None, :] @ np.linalg.solve(gram, u[..., None]))[..., 0, 0]
        weight = motion.weight[grasps]
        effort = np.sqrt((torque * torque).sum((1, 2)))
        return np.stack([effort, (weight * effective).sum(1), 1.0 / (weight * radius).sum(1)], 1)

    def fast(
        self,
        q: ndarray,
        qd: ndarray,
        qdd: ndarray,
        torque: ndarray,
        mass: ndarray,
        jacobian: ndarray,
    ) -> None:
        """Fills in torques, mass matrices and Jacobians with the fewest calls."""
        torque[:] = pinocchio.rneaInParallel(1, self.pool, q.T, qd.T, qdd.T).T
        crba, jacobian_of = pinocchio.crba, pinocchio.getFrameJacobian
        model, data, frame = self.model, self.data, self.frame
        world, axes = pinocchio.Convention.WORLD, pinocchio.LOCAL_WORLD_ALIGNED
        for state, m, j in zip(q, mass, jacobian, strict=True):
            m[:] = crba(model, data, state, world)
            j[:] = jacobian_of(model, data, frame, axes)[:3]

    def plain(
        self,
        q: ndarray,
        qd: ndarray,
        qdd: ndarray,
        torque: ndarray,
        mass: ndarray,
        jacobian: ndarray,
    ) -> None:
        """The same by the usual functions, one call a waypoint for each."""
        model, data, frame = self.model, self.data, self.frame
        axes = pinocchio.LOCAL_WORLD_ALIGNED
        for i in range(len(q)):
            torque[i] = pinocchio.rnea(model, data, q[i], qd[i], qdd[i])
            mass[i] = pinocchio.crba(model, data, q[i])
            whole = pinocchio.computeFrameJacobian(model, data, q[i], frame, axes)
            jacobian[i] = whole[:3]


@functools.cache
def _held() -> list[Worker]:
    return []


def _hold(problem: Problem) -> None:
    _held().append(Worker(problem))


def _part(part: slice, plain: bool) -> Float[ndarray, "n 3"]:
    return _held()[0].costs(part, plain=plain)


def rival_costs(pool: Any, parts: list[slice], *, plain: bool = False) -> Float[ndarray, "n 3"]:
    """All grasps, on all processes."""
    return np.concatenate(pool.starmap(_part, [(part, plain) for part in parts], chunksize=1))


# --- both -----------------------------------------------------------------------------------------


def relative(costs: ndarray, reference: ndarray) -> float:
    """The largest relative difference of any metric of any grasp."""
    return float(np.max(np.abs(costs / reference - 1.0)))


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Plans, times both in turn, and compares them."""
    count, waypoints = options.grasps, options.waypoints
    jax.config.update("jax_compilation_cache_dir", tempfile.mkdtemp())  # compile_s from cold
    runtime.configure(float64=True)
    problem, planning = planned(baxter(), count, waypoints)
    double, compile_s = ours(problem, float64=True)
    single, _ = ours(problem, float64=False)
    cores = runtime.cores()
    marks = np.linspace(0, count, PARTS * cores + 1).round().astype(int).tolist()
    parts = [slice(*ends) for ends in itertools.pairwise(marks)]
    context = multiprocessing.get_context("spawn")  # JAX's threads do not survive a fork
    with context.Pool(cores, initializer=_hold, initargs=(problem,)) as pool:
        runs: dict[str, Callable[[], ndarray]] = {
            "ours": double,
            "rival": lambda: rival_costs(pool, parts),
            "ours_float32": single,
            "rival_plain": lambda: rival_costs(pool, parts, plain=True),
        }
        costs = {name: run() for name, run in runs.items()}  # what comes first is not timed
        seconds: dict[str, list[float]] = {name: [] for name in runs}
        for _ in range(options.repeats):
            for name, run in runs.items():
                run()  # after a pause of seconds a run of 0.2 s takes up to twice as long
                seconds[name].append(timed(run)[0])
    for name, values in seconds.items():
        print(f"{name}: {[round(v, 3) for v in values]} s")
    middle = {name: statistics.median(values) for name, values in seconds.items()}
    print("pinocchio", pinocchio.__version__)
    return {
        "grasps": count,
        "waypoints": waypoints,
        **{f"{name}_s": round(value, 3) for name, value in middle.items()},
        "ratio": round(middle["rival"] / middle["ours"], 2),
        "ratio_float32": round(middle["rival"] / middle["ours_float32"], 2),
        "max_relative_difference": relative(costs["ours"], costs["rival"]),
        "max_relative_difference_float32": relative(costs["ours_float32"], costs["rival"]),
        "rival_ways_difference": relative(costs["rival_plain"], costs["rival"]),
        "compile_s": round(compile_s, 1),
        "states_per_s": round(count * waypoints / middle["ours"]),
        **planning,
        "device": provenance()["device"],
    }


if __name__ == "__main__":
    main()
