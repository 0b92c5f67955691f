"""What the joints do while a grasped object follows its path, and whether the arm can do it.

In: a `Robot`, the hand in the object's frame, an `ObjectPath`. Out: `GraspMotion` and a status. A
grasp that fails does not affect the others of a batch. Written for one grasp.
"""

import enum
import functools

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.grasping.inverse_kinematics import JointPath, ReachSettings, follow_path, reach
from mjx_inertia.grasping.task_path import ObjectPath, moving_frame_twist, object_pose_at
from mjx_inertia.robots import Robot
from mjx_inertia.spatial import Pose


class GraspStatus(enum.IntEnum):
    """Whether a grasp can be carried out; of several reasons the first, BAD_PAYLOAD before all."""

    OK = 0
    UNREACHED = 1  # the hand is not where it should be somewhere along the path
    SINGULAR = 2  # the arm cannot move on in some direction
    JOINT_LIMIT = 3
    VELOCITY_LIMIT = 4
    TORQUE_LIMIT = 5
    BAD_PAYLOAD = 6  # no body has such inertial parameters


@struct.dataclass
class GraspMotion:
    """Joint motion at k waypoints."""

    time: Float[Array, " k"]  # s
    # of each waypoint in an integral over the path parameter of the whole task, 0 to 1
    weight: Float[Array, " k"]
    q: Float[Array, "k n"]  # joint positions, rad (m where prismatic)
    qd: Float[Array, "k n"]  # joint velocities
    qdd: Float[Array, "k n"]  # joint accelerations
    twist: Float[Array, "k 6"]  # of the hand, world axes, m/s and rad/s
    # of the hand's path: its twist per unit of s, which does not vanish at rest
    tangent: Float[Array, "k 6"]
    error: Float[Array, "k 2"]  # of the hand's pose, m and rad
    conditioning: Float[Array, " k"]  # √(det J Jᵀ), translations over 0.1 m


def hand_path(
    path: ObjectPath, T_obj_hand: Pose, move: Int[Array, ""], s: Float[Array, ""]
) -> tuple[Pose, Float[Array, "6"], Float[Array, "6"]]:
    """T_world_hand on an object's path, its twist per unit of s and that twist's s-derivative."""
    # the motion of the object is the same for all grasps; the hand's follows by its lever
    place, xi, bend = moving_frame_twist(lambda s: object_pose_at(path, move, s), s)
    spin, turn = xi[3:], bend[3:]
    lever = (place.rotation * T_obj_hand.translation).sum(-1)
    about = jnp.cross(spin, lever)
    bent = jnp.cross(turn, lever) + jnp.cross(spin, about)
    return (
        place @ T_obj_hand,
        jnp.concatenate([xi[:3] + about, spin]),
        jnp.concatenate([bend[:3] + bent, turn]),
    )


def plan_motion(
    arm: Robot, T_obj_hand: Pose, path: ObjectPath, settings: ReachSettings | None = None
) -> GraspMotion:
    """The motion of least joint speed, from the start that stays farthest from the joint limits."""
    chosen = settings or ReachSettings()
    hand = functools.partial(hand_path, path, T_obj_hand)
    moves = jnp.arange(len(path.moves.angle))
    ends = jax.vmap(lambda move, s: hand(move, s)[0])(
        jnp.append(moves[:1], moves), jnp.ones(len(moves) + 1).at[0].set(0.0)
    )
    found = follow_path(arm, reach(arm, ends, chosen), hand, path.move, path.s)
    return _timed(found, path, T_obj_hand)


def _timed(found: JointPath, path: ObjectPath, T_obj_hand: Pose) -> GraspMotion:
    rate, acceleration = path.rate[:, None], path.acceleration[:, None]
    tangent = jax.vmap(lambda move, s: hand_path(path, T_obj_hand, move, s)[1])(path.move, path.s)
    return GraspMotion(
        time=path.time,
        weight=quadrature(path),
        q=found.q,
        qd=rate * found.dq_ds,
        qdd=acceleration * found.dq_ds + rate**2 * found.d2q_ds2,
        twist=rate * tangent,
        tangent=tangent,
        error=found.error,
        conditioning=found.conditioning,
    )


def quadrature(path: ObjectPath) -> Float[Array, " k"]:
    """Weights of the trapezoidal rule over s, each move counting alike, that sum to one."""
    gap = jnp.where(path.move[1:] == path.move[:-1], jnp.diff(path.s), 0.0)
    weight = 0.5 * (jnp.append(gap, 0.0) + jnp.append(0.0, gap))
    return weight / weight.sum()


def motion_status(
    arm: Robot, motion: GraspMotion, torque: Float[Array, "k n"], settings: ReachSettings
) -> Int[Array, ""]:
    """`GraspStatus` of a motion with the joint torques (N m) along it."""
    tolerance = jnp.array([settings.position_tolerance, settings.angle_tolerance])

    def beyond(values: Array, limit: Array) -> Bool[Array, ""]:
        return jnp.any(jnp.abs(values) > limit * (1.0 + 1e-9))

    finite = jnp.all(jnp.isfinite(motion.qdd)) & jnp.all(jnp.isfinite(torque))
    checks = (
        (GraspStatus.TORQUE_LIMIT, beyond(torque, jnp.asarray(arm.torque_limit))),
        (GraspStatus.VELOCITY_LIMIT, beyond(motion.qd, jnp.asarray(arm.velocity_limit))),
        (
            GraspStatus.JOINT_LIMIT,
            jnp.any((motion.q < jnp.asarray(arm.lower)) | (motion.q > jnp.asarray(arm.upper))),
        ),
        (GraspStatus.SINGULAR, ~(jnp.min(motion.conditioning) > settings.singular)),
        (GraspStatus.UNREACHED, ~(jnp.all(motion.error < tolerance) & finite)),
    )
    # the first reason counts, so it is written last
    status = jnp.int32(GraspStatus.OK)
    for code, failed in checks:
        status = jnp.where(failed, jnp.int32(code), status)
    return status
