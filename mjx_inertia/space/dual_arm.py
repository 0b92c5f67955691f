"""Two hands on one object: how they share what moves it, and the dynamics felt at the object.

In: a robot, what it holds, a motion without momentum. Out: grasp map, wrench of each hand on the
object, joint torques; Λ_tot and μ_tot with Λ_tot ẍ + μ_tot = F_tot (thesis Eqs 7.9 to 7.11,
corrected, errata 24).

A robot with two hands on one object can press it without moving it: the torques that move the
joints alone do not say how the hands share the load. Hand wrenches are exerted on the object, in
the axes of the base, about the hand's origin. The object's wrench and twist ẋ, against the inertial
world, are about its CoM in the axes that the base has at this instant.
"""

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.robots import Robot
from mjx_inertia.robots.links import unstack
from mjx_inertia.robots.recursions import (
    base_jacobian_rows,
    frames_at,
    hand_frame,
    scatter_axes,
    select_axes,
)
from mjx_inertia.space.capture import Capture, held_frames, with_capture
from mjx_inertia.space.dynamics import (
    floating_base_inverse_dynamics,
    generalized_jacobian,
    hand_jacobians,
    inertias,
    momentum_map,
    reduced_inertia,
)
from mjx_inertia.space.instant import Node, node
from mjx_inertia.spatial.components import add, apply, components, cross, stacked, subtract


@struct.dataclass
class ObjectDynamics:
    """Terms of Eq. 7.9 at one instant."""

    inertia: Float[Array, "k k"]  # Λ_tot
    velocity_wrench: Float[Array, " k"]  # μ_tot, N and N m


def dual_arm_grasp_map(
    robot: Robot, capture: Capture, q: Float[Array, " n"]
) -> Float[Array, "k m"]:
    """G: from both hands' wrenches to the one about the object's CoM, in the base's axes.

    Murray, Li and Sastry 1994, Sec. 5.2; thesis Eq. 7.9.
    """
    links = frames_at(robot, q)
    held = held_frames(robot, capture, links)[0]
    com = add(held.origin, apply(held.rotation, components(capture.inertial.com)))
    # wrenches go from the hands to the CoM as twists go from the CoM to the hands: the transpose
    levers = [subtract(hand_frame(robot, links, k).origin, com) for k in range(len(robot.hands))]
    return jnp.concatenate([stacked(base_jacobian_rows(robot, r), q.dtype) for r in levers], 1)


def distribute_wrench(
    grasp: Float[Array, "k m"],
    wrench: Float[Array, " k"],
    squeeze: Float[Array, " m"] | None = None,
) -> Float[Array, " m"]:
    """Hands' wrenches that together exert `wrench`: thesis Eq. 7.16, F = G⁺ F_tot + (I - G⁺ G) k.

    G⁺ is the pseudo-inverse in SI units: of all pairs of wrenches the least in N² + (N m)².

    Args:
      grasp: G.
      wrench: about the object's CoM.
      squeeze: k; only its part in the null space of G is added. Zero if None.
    """
    inverse = jnp.linalg.pinv(grasp)
    moving = inverse @ wrench
    return moving if squeeze is None else moving + squeeze - inverse @ (grasp @ squeeze)


def hand_wrenches(
    robot: Robot,
    capture: Capture,
    q: Float[Array, " n"],
    instant: Node,
    squeeze: Float[Array, " m"] | None = None,
) -> Float[Array, "2 k"]:
    """What each hand exerts on the object at an instant.

    Args:
      robot: the tree.
      capture: the object.
      q: joint positions at which both hands hold the object.
      instant: `node` at them.
      squeeze: k of Eq. 7.16, in the base's axes about the hands; zero if None.
    """
    total = _in_base(robot, instant.object_rotation, instant.object_wrench)
    return distribute_wrench(dual_arm_grasp_map(robot, capture, q), total, squeeze).reshape(2, -1)


def shared_load_torques(
    robot: Robot,
    q: Float[Array, " n"],
    rates: tuple[Float[Array, " n"], Float[Array, " n"]],
    instant: Node,
    hands: Float[Array, "2 k"],
) -> Float[Array, " n"]:
    """Torques that move the robot as at an instant while its hands exert wrenches on the object.

    They move the robot alone as it moves with the object, and pass the hands' wrenches on:
    τ = τ_robot + J_eᵀ F.

    Args:
      robot: the tree.
      q: joint positions at which both hands hold the object.
      rates: joint velocities and accelerations that keep it held.
      instant: `node` of the same with momentum "system".
      hands: `hand_wrenches` at that instant.
    """
    motion = instant.base_twist, instant.base_acceleration
    alone = floating_base_inverse_dynamics(robot, q, motion, rates)
    _, of_joints = hand_jacobians(robot, q)
    return alone.joints + of_joints.reshape(-1, robot.dof).T @ hands.ravel()


def object_dynamics(
    robot: Robot,
    capture: Capture,
    q: Float[Array, " n"],
    object_twist: Float[Array, " k"],
    momentum: str = "system",
) -> ObjectDynamics:
    """Λ_tot and μ_tot.

    Joint rates are q̇ = B ẋ with B = J_g⁻¹ Gᵀ; with more joints than the hands have freedoms, the
    dynamically consistent inverse stands for J_g⁻¹.

    Args:
      robot: the tree.
      capture: the object.
      q: joint positions in which both hands hold it.
      object_twist: ẋ, m/s and rad/s.
      momentum: "system" or "robot", see `instant.py`.
    """
    matrix = inertias(with_capture(robot, capture, momentum), q)
    B = object_to_joints(robot, capture, q, momentum)
    qd = B @ object_twist
    # the axes turn with the base: the derivative of ẋ in them at ẍ = 0 is -ω × ẋ
    omega = scatter_axes(robot, unstack(momentum_map(matrix) @ qd))[1]
    linear, angular = scatter_axes(robot, unstack(object_twist))
    turning = select_axes(robot, cross(omega, linear), cross(omega, angular))
    _, change = jax.jvp(
        lambda q: object_to_joints(robot, capture, q, momentum) @ object_twist, (q,), (qd,)
    )
    drift = change - B @ stacked(turning, q.dtype)
    instant = node(robot, capture, q, qd, drift, momentum)
    velocity_wrench = _in_base(robot, instant.object_rotation, instant.total_wrench)
    inertia = B.T @ reduced_inertia(matrix) @ B
    if momentum == "robot":
        inertia += _object_inertia(robot, capture, instant.object_rotation)
    return ObjectDynamics(inertia, velocity_wrench)


def object_to_joints(
    robot: Robot, capture: Capture, q: Float[Array, " n"], momentum: str = "system"
) -> Float[Array, "n k"]:
    """B = J_g⁻¹ Gᵀ: joint rates for the object's twist, of least kinetic energy."""
    moving = with_capture(robot, capture, momentum)
    J_g = generalized_jacobian(moving, q)
    response = jnp.linalg.solve(reduced_inertia(inertias(moving, q)), J_g.T)
    return response @ jnp.linalg.solve(J_g @ response, dual_arm_grasp_map(robot, capture, q).T)


def _object_inertia(
    robot: Robot, capture: Capture, rotation: Float[Array, "3 3"]
) -> Float[Array, "k k"]:
    """Λ_ob about the CoM in the base's axes."""
    tensor = rotation @ jnp.asarray(capture.inertial.inertia) @ rotation.T
    zero = jnp.zeros((3, 3), tensor.dtype)
    weight = capture.inertial.mass * jnp.eye(3, dtype=tensor.dtype)
    full = jnp.block([[weight, zero], [zero, tensor]])
    index = jnp.array(robot.axes)
    return full[index][:, index]


def _in_base(
    robot: Robot, rotation: Float[Array, "3 3"], wrench: Float[Array, " k"]
) -> Float[Array, " k"]:
    """A wrench in the object's axes, in those of the base."""
    force, moment = scatter_axes(robot, unstack(wrench))
    turn = components(rotation)
    return stacked(select_axes(robot, apply(turn, force), apply(turn, moment)), wrench.dtype)
