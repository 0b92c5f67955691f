"""A manoeuvre: from rest to rest with the object, and what it does to base, object and hands.

In: robot, object, end configurations, target. Out: `Manoeuvre`, and `Course` of one decision: the
signals at the nodes of a quadrature, the final base, the hands' errors, a status. The base starts
in the world's frame at rest. Written for one decision.

Two kinds of motion (errata 27). "consistent": the leading joints have free coefficients, the others
follow from the grasp. "independent": every joint has its own, as printed, and the hands drift
apart, which `Course.closure` reports.
"""

import enum

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.robots import Robot
from mjx_inertia.robots.dynamics import pose_of
from mjx_inertia.robots.recursions import center_of_mass, frames_at, hand_frame
from mjx_inertia.space.base_attitude import attitude
from mjx_inertia.space.capture import Capture, with_capture
from mjx_inertia.space.closure import closed_chain_motion, closure_error
from mjx_inertia.space.instant import Node, node
from mjx_inertia.space.quadrature import Rule, gauss_legendre, integrate, unresolved
from mjx_inertia.space.trajectory import COEFFICIENTS, JointMotion, joint_motion
from mjx_inertia.spatial import AnyArray, Pose
from mjx_inertia.spatial.components import root, stacked
from mjx_inertia.spatial.extremes import greatest


class CourseStatus(enum.IntEnum):
    """What became of a decision; of several reasons the first."""

    OK = 0
    NOT_FINITE = 1  # a leading joint's end is outside its limits, or J_g is singular on the way
    NOT_HELD = 2  # the hands cannot hold the object together on the way
    JOINT_LIMIT = 3  # of a joint that follows
    UNRESOLVED = 4  # the signals vary faster than the nodes can tell


@struct.dataclass
class Manoeuvre:
    """What is to be done."""

    robot: Robot  # the tree
    capture: Capture  # the object that both hands hold
    # joint positions at the start, in which the hands hold the object
    q_start: Float[AnyArray, " n"]
    q_end: Float[AnyArray, " n"]  # joint positions at the end
    T_world_obj: Pose  # target of the object; the base starts as the world's frame
    duration: float = struct.field(pytree_node=False, default=50.0)  # t_f, s
    # joints that have coefficients; all for "independent" motion
    leading: tuple[int, ...] = struct.field(pytree_node=False, default=())
    # "system" or "robot", see `instant.py`
    momentum: str = struct.field(pytree_node=False, default="system")
    nodes: int = struct.field(pytree_node=False, default=32)  # of the quadrature
    # greatest distance (m) and angle (rad) between the hands' objects; None reports them only
    closure_limit: float | None = struct.field(pytree_node=False, default=1e-6)

    @property
    def consistent(self) -> bool:
        """Whether some joints follow from the grasp."""
        return len(self.leading) < self.robot.dof

    @property
    def following(self) -> tuple[int, ...]:
        """Joints without coefficients."""
        return tuple(i for i in range(self.robot.dof) if i not in self.leading)

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return COEFFICIENTS * len(self.leading)

    @property
    def rule(self) -> Rule:
        """The quadrature."""
        return gauss_legendre(self.nodes)


@struct.dataclass
class Course:
    """What one decision does."""

    motion: JointMotion  # of the joints at the nodes
    nodes: Node  # one entry a node
    base_place: Float[Array, "3"]  # of the base at the end, m, in the world
    base_turn: Float[Array, "3"]  # rotation vector of the base at the end, rad
    # position (m) of the right and the left hand against where they should be, world
    hand_error: Float[Array, "2 3"]
    hand_turn: Float[Array, "2 3"]  # rotation vector of the same, rad
    # greatest distance (m) and angle (rad) between the objects of the two hands, on the way and in
    # `q_start` and `q_end` as they are given
    closure: Float[Array, "2"]
    limit_excess: Float[Array, ""]  # how far a following joint goes beyond its limits, rad (m)
    # share of the total wrench that the nodes do not resolve; without it, of torques and the
    # object's wrench
    unresolved: Float[Array, ""]
    status: Int[Array, ""]  # a `CourseStatus`


RESOLVED = 5e-4  # share of the wrench; it moves the norm by about its square (docs/space.md)


def course(manoeuvre: Manoeuvre, coefficients: Float[Array, " c"], total: bool = True) -> Course:
    """What a decision does.

    Args:
      manoeuvre: what is to be done.
      coefficients: normalised p and q of the first leading joint, then of the next (Eq. 7.22).
      total: with the total wrench and manipulability, which are NaN without. A motion through a
        singular J_g, where that wrench is infinite, then is as good as any other, and a robot in
        space compiles in half the time.

    Raises:
      ValueError: another number of coefficients than the leading joints have, no leading joint, or
        a duration or a mass of the object that is not positive.
    """
    m = manoeuvre
    _check(m)
    if coefficients.shape != (m.size,):
        raise ValueError(
            f"`coefficients` has shape {coefficients.shape}; {len(m.leading)} leading joints have "
            f"({m.size},)"
        )
    tau = np.append(m.rule.nodes, 1.0)
    joints = motion_at(m, tau, coefficients)
    motion, q_end = jax.tree.map(lambda x: x[:-1], joints), joints.q[-1]
    at = jax.vmap(lambda q, qd, qdd: node(m.robot, m.capture, q, qd, qdd, m.momentum, total))
    signals = at(motion.q, motion.qd, motion.qdd)
    T_world_base, turn = _final_base(m, signals.base_twist, q_end)
    place, angle = _hand_errors(m, T_world_base, q_end)
    closure = greatest(jnp.concatenate([signals.closure, _gaps(m, coefficients.dtype)]))
    excess = _limit_excess(m, joints.q) if m.consistent else jnp.zeros(())
    read = [signals.total_wrench] if total else [signals.object_wrench, signals.torque]
    coarse = greatest(jnp.stack([unresolved(signal, m.rule) for signal in read]))
    base_place = jnp.asarray(T_world_base.translation)
    figures = (base_place, turn, place, angle, closure, excess, coarse)
    status = _status(m, figures, [*read, signals.torque])
    return Course(motion, signals, *figures, status=status)


def _check(m: Manoeuvre) -> None:
    """What a manoeuvre that was not planned may have wrong, as far as it is known in tracing."""
    if not m.leading:
        raise ValueError("`leading` is empty: name the joints that have coefficients")
    if not 0.0 < m.duration < np.inf:
        raise ValueError(f"`duration` is {m.duration} s: expected more than zero")
    mass = m.capture.inertial.mass
    if not isinstance(mass, jax.core.Tracer) and not float(np.asarray(mass)) > 0.0:
        raise ValueError(f"`capture` has a mass of {mass} kg: expected more than zero")


def _gaps(m: Manoeuvre, dtype: jnp.dtype) -> Float[Array, "g 2"]:
    """Distance and angle between the hands' objects at both ends of a consistent motion."""
    if not m.consistent:
        return jnp.zeros((0, 2), dtype)
    linear = sum(axis < 3 for axis in m.robot.axes)
    apart = [
        closure_error(m.robot, m.capture, jnp.asarray(q, dtype))[0] for q in (m.q_start, m.q_end)
    ]
    parts = [jnp.stack([root(jnp.sum(x**2)) for x in (g[:linear], g[linear:])]) for g in apart]
    return jnp.stack(parts)


def base_at(manoeuvre: Manoeuvre, rotation: Float[AnyArray, "3 3"], q: Float[Array, " n"]) -> Pose:
    """T_world_base at attitude `rotation` and joints `q`: the centre of mass has not moved."""
    com = [_com(manoeuvre, jnp.asarray(x)) for x in (manoeuvre.q_start, q)]
    return Pose(rotation, com[0] - rotation @ com[1])


def motion_at(
    manoeuvre: Manoeuvre, tau: Float[np.ndarray, " t"], coefficients: Float[Array, " c"]
) -> JointMotion:
    """Motion of all joints at shares `tau` of the duration, ascending from near the start."""
    m, robot = manoeuvre, manoeuvre.robot
    full = jnp.zeros((robot.dof, COEFFICIENTS), coefficients.dtype)
    full = full.at[np.array(m.leading)].set(coefficients.reshape(-1, COEFFICIENTS))
    start, end = (jnp.asarray(q, coefficients.dtype) for q in (m.q_start, m.q_end))
    motion = joint_motion(tau, m.duration, (start, end), (robot.lower, robot.upper), full)
    if m.consistent:
        return closed_chain_motion(robot, m.capture, motion, start, m.following)
    return motion


def _final_base(
    m: Manoeuvre, twist: Float[Array, "t k"], q_end: Float[Array, " n"]
) -> tuple[Pose, Float[Array, "3"]]:
    """T_world_base at the end and its rotation vector."""
    if m.robot.planar:
        angle = integrate(twist[:, 2], m.rule, m.duration)
        turn = jnp.zeros(3, twist.dtype).at[2].set(angle)
        return base_at(m, _about_z(angle), q_end), turn
    rotation = attitude(twist[:, 3:], m.duration)
    return base_at(m, rotation, q_end), jaxlie.SO3.from_matrix(rotation).log()


def _hand_errors(
    m: Manoeuvre, T_world_base: Pose, q_end: Float[Array, " n"]
) -> tuple[Float[Array, "2 3"], Float[Array, "2 3"]]:
    links = frames_at(m.robot, q_end)
    hands = [hand_frame(m.robot, links, k) for k in (0, 1)]
    reached = [T_world_base @ pose_of(hand, q_end.dtype) for hand in hands]
    wanted = [m.T_world_obj @ m.capture.T_hand_obj[k].inverse() for k in (0, 1)]
    place = [a.translation - b.translation for a, b in zip(reached, wanted, strict=True)]
    between = [a.rotation @ b.rotation.T for a, b in zip(reached, wanted, strict=True)]
    return jnp.stack(place), jnp.stack([rotation_vector(m.robot, R) for R in between])


def rotation_vector(robot: Robot, R: Float[AnyArray, "3 3"]) -> Float[Array, "3"]:
    """Axis times angle (rad, at most π) of a rotation that the robot can make."""
    if robot.planar:
        return jnp.zeros(3, R.dtype).at[2].set(jnp.arctan2(R[1, 0], R[0, 0]))
    return jaxlie.SO3.from_matrix(jnp.asarray(R)).log()


def _about_z(angle: Float[Array, ""]) -> Float[Array, "3 3"]:
    c, s = jnp.cos(angle), jnp.sin(angle)
    zero, one = jnp.zeros_like(c), jnp.ones_like(c)
    return jnp.stack([c, -s, zero, s, c, zero, zero, zero, one]).reshape(3, 3)


def _com(m: Manoeuvre, q: Float[Array, " n"]) -> Float[Array, "3"]:
    robot = with_capture(m.robot, m.capture, m.momentum)
    return stacked(center_of_mass(robot, frames_at(robot, q)), q.dtype)


def _limit_excess(m: Manoeuvre, q: Float[Array, "t n"]) -> Float[Array, ""]:
    """Of the joints that follow: the others cannot leave their limits, but for rounding."""
    q = jnp.concatenate([jnp.asarray(m.q_start, q.dtype)[None], q])
    beyond = jnp.maximum(q - m.robot.upper, m.robot.lower - q)[:, np.array(m.following)]
    return jnp.maximum(greatest(beyond.ravel()), 0.0)


def _status(m: Manoeuvre, figures: tuple[Array, ...], signals: list[Array]) -> Int[Array, ""]:
    *_, closure, excess, coarse = figures
    limit = jnp.inf if m.closure_limit is None else m.closure_limit
    finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in [*figures, *signals]]))
    checks = [~finite, jnp.any(closure > limit), excess > 0.0, coarse > RESOLVED]
    names = [
        CourseStatus.NOT_FINITE,
        CourseStatus.NOT_HELD,
        CourseStatus.JOINT_LIMIT,
        CourseStatus.UNRESOLVED,
    ]
    return jnp.select(checks, [jnp.asarray(int(name)) for name in names], int(CourseStatus.OK))
