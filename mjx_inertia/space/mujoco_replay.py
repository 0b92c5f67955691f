"""A manoeuvre in C MuJoCo, which knows nothing of our formulas: does what was predicted come true?

In: a manoeuvre of joints that obey the grasp, and a decision. Out: `Replay`: predicted and
simulated signals, and `Disagreement`: how far they are apart. MuJoCo starts at rest and gets joint
torques alone: those that `manoeuvre_path.py` computes in advance, and a weak control on the joints'
motion. Base, object and sensors show the rest.
"""

import dataclasses

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from mjx_inertia.robots.mjcf import SIDES
from mjx_inertia.space.manoeuvre import CourseStatus, Manoeuvre, course
from mjx_inertia.space.manoeuvre_path import ManoeuvrePath, path
from mjx_inertia.space.mjcf import capture_spec
from mjx_inertia.spatial import AnyArray, Pose

_STILL = 1e-9  # m, rad: less than that is no displacement to compare with


@dataclasses.dataclass(frozen=True)
class ReplaySettings:
    """How MuJoCo runs."""

    step: float = 0.002  # s, at most; made to fit the samples
    samples: int = 250  # instants of the signals beside the first, evenly over the duration
    knots: int = 400  # instants at which torques are computed; cubic splines join them
    # of the joints' control, as a rate, 1/s; at 1 an error acts as on a spring on which the joint's
    # own inertia oscillates with 1 rad/s
    stiffness: float = 0.3
    # time constant of the weld at the second hand, in steps; MuJoCo takes 2 or more
    weld_time: float = 4.0

    def __post_init__(self) -> None:
        """Raises ValueError for what cannot be run."""
        for name, least in (("step", 1e-5), ("samples", 2), ("knots", 8), ("weld_time", 2.0)):
            if not getattr(self, name) >= least:
                raise ValueError(f"`{name}` is {getattr(self, name)}: expected {least} or more")
        if not self.stiffness >= 0.0:
            raise ValueError(f"`stiffness` is {self.stiffness} 1/s: expected zero or more")


@dataclasses.dataclass(frozen=True)
class ReplaySignals:
    """What can be measured, at t times."""

    T_world_base: Pose  # the base
    T_world_obj: Pose  # the object
    # of the right and the left hand on the object, in the hands' axes about their origins, N and N
    # m
    hand_wrenches: Float[ndarray, "t 2 6"]
    # of both together, about the object's CoM in its axes, N and N m
    object_wrench: Float[ndarray, "t 6"]


@dataclasses.dataclass(frozen=True)
class Replay:
    """A manoeuvre as predicted and as MuJoCo simulates it, at t times."""

    time: Float[ndarray, " t"]  # s
    predicted: ReplaySignals  # by the manoeuvre's model
    simulated: ReplaySignals  # by MuJoCo
    joint_error: Float[ndarray, "t n"]  # simulated joint positions less those wanted, rad (m)
    # simulated, of robot and object in world axes, angular about their CoM; kg m/s and kg m²/s
    momentum: Float[ndarray, "t 6"]
    energy: Float[ndarray, " t"]  # simulated, kinetic, J


@dataclasses.dataclass(frozen=True)
class Disagreement:
    """Prediction against simulation; shares are of the simulated figure, NaN where that is zero."""

    base_place: float  # of the base at the end, m
    base_place_share: float  # the same against how far the base went
    base_turn: float  # angle between the base's attitudes at the end, rad
    base_turn_share: float  # the same against how far the base turned
    force: float  # of the object over the whole time: relative L2 error
    moment: float  # of the object about its CoM, likewise
    hand_forces: tuple[float, float]  # of the right and the left hand, likewise
    hand_moments: tuple[float, float]  # about the hands' origins, likewise


def replay(
    manoeuvre: Manoeuvre,
    coefficients: Float[AnyArray, " c"],
    settings: ReplaySettings | None = None,
) -> Replay:
    """Runs a decision in MuJoCo.

    Args:
      manoeuvre: with joints that follow from the grasp.
      coefficients: as of `course`, whose status they must leave OK.
      settings: of the simulation.

    Raises:
      ValueError: joints that do not obey the grasp, which two hands on a rigid object cannot move,
        a course that is not OK, or a simulation that diverges, with the time.
    """
    m, s = manoeuvre, settings or ReplaySettings()
    if not m.consistent:
        raise ValueError(
            "`manoeuvre` moves all joints independently: its hands drift apart, and a rigid object "
            'holds them together; plan it with motion="consistent"'
        )
    status = jax.jit(lambda c: course(m, c, total=False).status)(jnp.asarray(coefficients))
    if int(status) != CourseStatus.OK:
        raise ValueError(
            f"`coefficients` lead to a course whose status is {CourseStatus(int(status)).name}; "
            "there is nothing to compare a simulation with"
        )
    tau = np.linspace(0.0, 1.0, s.knots + 1)
    wanted = path(m, coefficients, tau, total=False)
    time = np.linspace(0.0, m.duration, s.samples + 1)
    simulated, states = _simulated(m, wanted, time, s)
    q, momentum, energy = states
    error = q - CubicSpline(wanted.time, wanted.motion.q)(time)
    return Replay(time, _predicted(m, wanted, time), simulated, error, momentum, energy)


def disagreement(replay: Replay) -> Disagreement:
    """How far the simulation is from the prediction."""
    a, b = replay.predicted, replay.simulated
    wanted, reached = a.T_world_base[-1], b.T_world_base[-1]
    apart, between = _between(wanted, reached)
    went, turned = _between(b.T_world_base[0], reached)

    def hands(part: slice) -> tuple[float, float]:
        shares = [_share(a.hand_wrenches[:, k, part], b.hand_wrenches[:, k, part]) for k in (0, 1)]
        return shares[0], shares[1]

    return Disagreement(
        base_place=apart,
        base_place_share=apart / went if went > _STILL else np.nan,
        base_turn=between,
        base_turn_share=between / turned if turned > _STILL else np.nan,
        force=_share(a.object_wrench[:, :3], b.object_wrench[:, :3]),
        moment=_share(a.object_wrench[:, 3:], b.object_wrench[:, 3:]),
        hand_forces=hands(slice(0, 3)),
        hand_moments=hands(slice(3, 6)),
    )


def _simulated(
    m: Manoeuvre, wanted: ManoeuvrePath, time: Float[ndarray, " t"], s: ReplaySettings
) -> tuple[ReplaySignals, tuple[ndarray, ndarray, ndarray]]:
    per_sample = int(np.ceil((time[1] - time[0]) / s.step))
    step = (time[1] - time[0]) / per_sample
    model = _model(m, step, s.weld_time)
    data = mujoco.MjData(model)
    n = m.robot.dof
    data.qpos[-n:] = wanted.motion.q[0]
    mujoco.mj_forward(model, data)
    # of each joint with the others held, so that the control is equally weak at all of them
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    inertia = np.diag(mass)[-n:]
    spring, damper = inertia * s.stiffness**2, 2.0 * inertia * s.stiffness
    instants = np.arange(per_sample * s.samples) * step
    knots = [wanted.torque, wanted.motion.q, wanted.motion.qd]
    torque, q, qd = (CubicSpline(wanted.time, knot) for knot in knots)
    middle, q_wanted, qd_wanted = torque(instants + step / 2.0), q(instants), qd(instants)
    at_samples = torque(time)

    def control(torque: Float[ndarray, " n"], i: int) -> None:
        errors = q_wanted[i] - data.qpos[-n:], qd_wanted[i] - data.qvel[-n:]
        data.qfrc_applied[-n:] = torque + spring * errors[0] + damper * errors[1]

    rows = []
    for k in range(s.samples + 1):
        first = min(k * per_sample, len(instants) - 1)
        control(at_samples[k], first)
        mujoco.mj_forward(model, data)
        rows.append(_reading(model, data, n))
        if k == s.samples:
            break
        for i in range(first, first + per_sample):
            control(middle[i], i)
            mujoco.mj_step(model, data)  # its torque is held over the step
        if (
            not np.isfinite(data.qpos).all()
            or data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number
        ):
            raise ValueError(
                f"the simulation diverges after {time[k]:.3g} s; take a smaller `step`, or see "
                "whether the status of the course is OK"
            )
    return _signals(m, rows)


def _model(m: Manoeuvre, step: float, weld_time: float) -> mujoco.MjModel:
    spec = capture_spec(m.robot, m.capture)
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    weld = spec.equalities[0]
    weld.solref = [weld_time * step, 1.0]
    weld.solimp = [0.9999, 0.9999, 0.001, 0.5, 2.0]  # as hard as MuJoCo has it
    return spec.compile()


def _reading(model: mujoco.MjModel, data: mujoco.MjData, n: int) -> dict[str, ndarray]:
    base, held = (data.body(name) for name in ("base", "object"))
    mujoco.mj_subtreeVel(model, data)
    wrenches = [
        np.concatenate([data.sensor(f"{kind}_{side}").data for kind in ("force", "torque")])
        for side in SIDES
    ]
    whole = base.id
    linear = model.body_subtreemass[whole] * data.subtree_linvel[whole]
    return {
        "q": data.qpos[-n:].copy(),
        "base_rotation": base.xmat.reshape(3, 3).copy(),
        "base_place": base.xpos.copy(),
        "obj_rotation": held.xmat.reshape(3, 3).copy(),
        "obj_place": held.xpos.copy(),
        "wrenches": np.array(wrenches),
        "momentum": np.concatenate([linear, data.subtree_angmom[whole]]),
        "energy": np.array(data.energy[1]),
    }


def _signals(
    m: Manoeuvre, rows: list[dict[str, ndarray]]
) -> tuple[ReplaySignals, tuple[ndarray, ndarray, ndarray]]:
    column = {key: np.stack([row[key] for row in rows]) for key in rows[0]}
    signals = ReplaySignals(
        Pose(column["base_rotation"], column["base_place"]),
        Pose(column["obj_rotation"], column["obj_place"]),
        column["wrenches"],
        _about_com(m, column["wrenches"]),
    )
    return signals, (column["q"], column["momentum"], column["energy"])


def _predicted(m: Manoeuvre, wanted: ManoeuvrePath, time: Float[ndarray, " t"]) -> ReplaySignals:
    """The path at the times of the samples."""

    def at(values: ndarray) -> ndarray:
        return CubicSpline(wanted.time, values)(time)

    def pose_at(T: Pose) -> Pose:
        nearest = Rotation.from_matrix(at(np.asarray(T.rotation))).as_matrix()
        return Pose(nearest, at(np.asarray(T.translation)))

    axes = list(m.robot.axes)
    in_base = np.zeros((*wanted.hand_wrenches.shape[:2], 6))
    in_base[..., axes] = wanted.hand_wrenches
    on_object = np.zeros((len(wanted.time), 6))
    on_object[:, axes] = wanted.nodes.object_wrench
    turns = [
        np.asarray(wanted.nodes.object_rotation) @ np.asarray(m.capture.T_hand_obj[k].rotation).T
        for k in (0, 1)
    ]  # of the hands in the base
    by_hand = np.stack([_turned_back(R, in_base[:, k]) for k, R in enumerate(turns)], 1)
    return ReplaySignals(
        pose_at(wanted.T_world_base), pose_at(wanted.T_world_obj), at(by_hand), at(on_object)
    )


def _about_com(m: Manoeuvre, wrenches: Float[ndarray, "t 2 6"]) -> Float[ndarray, "t 6"]:
    """Sum of the hands' wrenches in the object's axes about its CoM."""
    total = np.zeros((len(wrenches), 6))
    for k in (0, 1):
        T_obj_hand = m.capture.T_hand_obj[k].inverse()
        turn = np.asarray(T_obj_hand.rotation)
        force, moment = wrenches[:, k, :3] @ turn.T, wrenches[:, k, 3:] @ turn.T
        lever = np.asarray(T_obj_hand.translation) - np.asarray(m.capture.inertial.com)
        total += np.concatenate([force, moment + np.cross(lever, force)], 1)
    return total


def _turned_back(
    rotation: Float[ndarray, "t 3 3"], wrench: Float[ndarray, "t 6"]
) -> Float[ndarray, "t 6"]:
    parts = [np.einsum("tji,tj->ti", rotation, wrench[:, part : part + 3]) for part in (0, 3)]
    return np.concatenate(parts, 1)


def _between(a: Pose, b: Pose) -> tuple[float, float]:
    """Distance (m) and angle (rad) between two poses."""
    rotation = np.asarray(a.rotation).T @ np.asarray(b.rotation)
    apart = np.asarray(a.translation) - np.asarray(b.translation)
    return float(np.linalg.norm(apart)), float(Rotation.from_matrix(rotation).magnitude())


def _share(predicted: Float[ndarray, "..."], simulated: Float[ndarray, "..."]) -> float:
    size = float(np.linalg.norm(simulated))
    return float(np.linalg.norm(predicted - simulated)) / size if size > 0.0 else np.nan
