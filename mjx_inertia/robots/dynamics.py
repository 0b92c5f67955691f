"""Kinematics and dynamics of a robot: where its links and hands are, torques, mass matrix.

In: a `Robot` and one state (joint positions rad, m where prismatic; velocities, accelerations).
Out: poses, Jacobians, joint torques (N m, or N where prismatic), accelerations. `over_states` runs
them over many. Poses and twists are in the world; of a robot with a free base, in its base. A
hand's twist is (linear, angular), linear of the hand's origin or of another point of it.

Torques and accelerations here are those of a robot on a fixed base; `mjx_inertia.space` has those
of a base that floats.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.robots.links import Frame, joints_at, unstack
from mjx_inertia.robots.recursions import (
    Columns,
    composite_inertias,
    frames_at,
    hand_frame,
    hand_point,
    jacobian_columns,
    jacobian_rate_twist,
    newton_euler,
    zeros,
)
from mjx_inertia.robots.robot import Robot, check_joints
from mjx_inertia.spatial import Pose
from mjx_inertia.spatial.components import minus, stacked
from mjx_inertia.spatial.small_cholesky import factorize, solve_lower, solve_upper


def link_poses(robot: Robot, q: Float[Array, " n"]) -> Pose:
    """Poses of the n links."""
    check_joints(robot, q=q)
    frames = frames_at(robot, q)
    rotation = stacked([f.rotation for f in frames], q.dtype)
    return Pose(rotation, stacked([f.origin for f in frames], q.dtype))


def hand_pose(robot: Robot, q: Float[Array, " n"], hand: int = 0) -> Pose:
    """`T_world_hand` of a hand by its number."""
    check_joints(robot, q=q)
    T = hand_frame(robot, frames_at(robot, q), hand)
    return pose_of(T, q.dtype)


def pose_of(frame: Frame, dtype: jnp.dtype) -> Pose:
    """A frame as arrays."""
    return Pose(stacked(frame.rotation, dtype), stacked(frame.origin, dtype))


def hand_jacobian(
    robot: Robot, q: Float[Array, " n"], point: Float[Array, "3"] | None = None, hand: int = 0
) -> Float[Array, "6 n"]:
    """Twist of a hand for unit joint velocities.

    Args:
      robot: the robot.
      q: joint positions.
      point: of the hand whose velocity is meant, m, in the hand's frame; its origin if None.
      hand: number of the hand.
    """
    check_joints(robot, q=q)
    columns = _columns(robot, q, point, hand)
    rows = zip(*((*linear, *angular) for linear, angular in columns), strict=True)
    return stacked(list(rows), q.dtype)


def jacobian_rate_product(
    robot: Robot,
    q: Float[Array, " n"],
    qd: Float[Array, " n"],
    point: Float[Array, "3"] | None = None,
    hand: int = 0,
) -> Float[Array, "6"]:
    """J̇ q̇: a hand's acceleration at zero joint acceleration; arguments as of `hand_jacobian`."""
    check_joints(robot, q=q, qd=qd)
    linear, angular = jacobian_rate_twist(_columns(robot, q, point, hand), unstack(qd))
    return stacked([*linear, *angular], q.dtype)


def inverse_dynamics(
    robot: Robot, q: Float[Array, " n"], qd: Float[Array, " n"], qdd: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Joint torques that give the accelerations `qdd`: the recursive Newton-Euler algorithm."""
    _check(robot, q=q, qd=qd, qdd=qdd)
    forces = newton_euler(robot, joints_at(robot, unstack(q)), unstack(qd), unstack(qdd))
    return stacked(forces.joints, q.dtype)


def bias_force(robot: Robot, q: Float[Array, " n"], qd: Float[Array, " n"]) -> Float[Array, " n"]:
    """Coriolis, centrifugal and gravity torques: those of zero joint acceleration."""
    _check(robot, q=q, qd=qd)
    forces = newton_euler(robot, joints_at(robot, unstack(q)), unstack(qd), zeros(robot))
    return stacked(forces.joints, q.dtype)


def gravity_torque(robot: Robot, q: Float[Array, " n"]) -> Float[Array, " n"]:
    """Joint torques that hold the robot still."""
    _check(robot, q=q)
    forces = newton_euler(robot, joints_at(robot, unstack(q)), zeros(robot), zeros(robot))
    return stacked(forces.joints, q.dtype)


def mass_matrix(robot: Robot, q: Float[Array, " n"]) -> Float[Array, "m m"]:
    """Mass matrix, armature included: the composite rigid body algorithm.

    Of a fixed base it is that of the n joints; of a free one the entries `robot.axes` of the base's
    twist, in its axes, come first.
    """
    check_joints(robot, q=q)
    matrix = composite_inertias(robot, joints_at(robot, unstack(q)))
    joints = stacked(matrix.joints, q.dtype)
    if robot.base is None:
        return joints
    base, coupling = stacked(matrix.base, q.dtype), stacked(matrix.coupling, q.dtype)
    return jnp.block([[base, coupling.T], [coupling, joints]])


def coriolis_matrix(
    robot: Robot, q: Float[Array, " n"], qd: Float[Array, " n"]
) -> Float[Array, "n n"]:
    """C with C q̇ the Coriolis and centrifugal torque and Ṁ - 2C skew: Christoffel's symbols.

    Costs n derivatives of the mass matrix; where only C q̇ is wanted, take `bias_force`.
    """
    _check(robot, q=q, qd=qd)
    slope = jax.jacfwd(lambda q: mass_matrix(robot, q))(q)  # ∂M_ij/∂q_k
    along = jnp.sum(slope * qd, -1)  # Ṁ
    across = jnp.sum(slope * qd[:, None], 1)  # Σ_j ∂M_ij/∂q_k q̇_j
    return 0.5 * (along + across - across.T)


def forward_dynamics(
    robot: Robot, q: Float[Array, " n"], qd: Float[Array, " n"], torque: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Joint accelerations (rad/s², m/s²) that `torque` causes."""
    _check(robot, q=q, qd=qd, torque=torque)
    joints = joints_at(robot, unstack(q))
    bias = newton_euler(robot, joints, unstack(qd), zeros(robot)).joints
    rest = [minus(t, b) for t, b in zip(unstack(torque), bias, strict=True)]
    factor = factorize(composite_inertias(robot, joints).joints)
    return stacked(solve_upper(factor, solve_lower(factor, rest)), q.dtype)


def _columns(
    robot: Robot, q: Float[Array, " n"], point: Float[Array, "3"] | None, hand: int
) -> Columns:
    frames = frames_at(robot, q)
    return jacobian_columns(robot, frames, hand_point(robot, frames, point, hand), hand)


def _check(robot: Robot, **vectors: Float[Array, " n"]) -> None:
    if robot.base is not None:
        raise ValueError(
            f"`robot` {robot.name or 'given'} has a free base, which its joints move too: take the "
            "functions of `mjx_inertia.space`, such as `floating_base_inverse_dynamics`"
        )
    check_joints(robot, **vectors)
