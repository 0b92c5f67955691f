"""How two hands share what moves an object, and the joint torques that make them do so.

In: a robot, what it holds, a motion without momentum. Out: grasp map, wrench of each hand on the
object, torques. A robot with two hands on one object can press it without moving it: the torques
that move the joints alone do not say how the hands share the load. Hand wrenches are exerted on the
object, in the axes of the base, about the hand's origin; the object's are about its CoM.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.robots.chain import joints_at, unstack
from mjx_inertia.space.dynamics import floating_base_inverse_dynamics, hand_jacobians
from mjx_inertia.space.instant import Node
from mjx_inertia.space.robot import Capture, SpaceRobot
from mjx_inertia.space.tree_recursions import (
    frames,
    hand_frames,
    held_frames,
    scatter_axes,
    select_axes,
)
from mjx_inertia.spatial.components import add, apply, components, cross, stacked, subtract


def dual_arm_grasp_map(
    robot: SpaceRobot, capture: Capture, q: Float[Array, " n"]
) -> Float[Array, "k m"]:
    """G: from both hands' wrenches to the one about the object's CoM, in the base's axes.

    Murray, Li and Sastry 1994, Sec. 5.2; thesis Eq. 7.9.
    """
    links = frames(robot, joints_at(robot, unstack(q)))
    held = held_frames(robot, capture, links)[0]
    com = add(held.origin, apply(held.rotation, components(capture.inertial.com)))
    blocks = []
    for hand in hand_frames(robot, links):
        lever = subtract(hand.origin, com)
        rows = []
        for unit in jnp.eye(len(robot.axes), dtype=q.dtype):
            force, moment = scatter_axes(robot, unstack(unit))
            rows.append(select_axes(robot, force, add(moment, cross(lever, force))))
        blocks.append(stacked(rows, q.dtype).T)
    return jnp.concatenate(blocks, 1)


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
    robot: SpaceRobot,
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
    force, moment = scatter_axes(robot, unstack(instant.object_wrench))
    turn = components(instant.object_rotation)
    total = stacked(select_axes(robot, apply(turn, force), apply(turn, moment)), q.dtype)
    return distribute_wrench(dual_arm_grasp_map(robot, capture, q), total, squeeze).reshape(2, -1)


def shared_load_torques(
    robot: SpaceRobot,
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
