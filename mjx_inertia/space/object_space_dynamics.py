"""The robot's dynamics as felt at the object: thesis Eqs 7.9 to 7.11, corrected (errata 24).

In: a robot, what it holds, joint positions, the object's twist. Out: Λ_tot and μ_tot with
Λ_tot ẍ + μ_tot = F_tot. The object's twist ẋ is that of its CoM against the inertial world, and all
is in the axes that the base has at this instant. It must be a motion that both hands can follow.
"""

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.robots.chain import unstack
from mjx_inertia.space.dynamics import (
    generalized_jacobian,
    inertias,
    momentum_map,
    reduced_inertia,
)
from mjx_inertia.space.instant import check_momentum, node
from mjx_inertia.space.load_sharing import dual_arm_grasp_map
from mjx_inertia.space.robot import Capture, SpaceRobot
from mjx_inertia.space.tree_recursions import scatter_axes, select_axes
from mjx_inertia.spatial.components import apply, components, cross, stacked


@struct.dataclass
class ObjectDynamics:
    """Terms of Eq. 7.9 at one instant."""

    inertia: Float[Array, "k k"]  # Λ_tot
    velocity_wrench: Float[Array, " k"]  # μ_tot, N and N m


def object_dynamics(
    robot: SpaceRobot,
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
    check_momentum(momentum)
    held = capture if momentum == "system" else None
    matrix = inertias(robot, q, held)
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
    force, moment = scatter_axes(robot, unstack(instant.total_wrench))
    turn = components(instant.object_rotation)
    velocity_wrench = stacked(select_axes(robot, apply(turn, force), apply(turn, moment)), q.dtype)
    inertia = B.T @ reduced_inertia(matrix) @ B
    if momentum == "robot":
        inertia += _object_inertia(robot, capture, instant.object_rotation)
    return ObjectDynamics(inertia, velocity_wrench)


def object_to_joints(
    robot: SpaceRobot, capture: Capture, q: Float[Array, " n"], momentum: str = "system"
) -> Float[Array, "n k"]:
    """B = J_g⁻¹ Gᵀ: joint rates for the object's twist, of least kinetic energy."""
    held = capture if momentum == "system" else None
    matrix = inertias(robot, q, held)
    J_g = generalized_jacobian(robot, q, held)
    response = jnp.linalg.solve(reduced_inertia(matrix), J_g.T)
    return response @ jnp.linalg.solve(J_g @ response, dual_arm_grasp_map(robot, capture, q).T)


def _object_inertia(
    robot: SpaceRobot, capture: Capture, rotation: Float[Array, "3 3"]
) -> Float[Array, "k k"]:
    """Λ_ob about the CoM in the base's axes."""
    tensor = rotation @ jnp.asarray(capture.inertial.inertia) @ rotation.T
    zero = jnp.zeros((3, 3), tensor.dtype)
    weight = capture.inertial.mass * jnp.eye(3, dtype=tensor.dtype)
    full = jnp.block([[weight, zero], [zero, tensor]])
    index = jnp.array(robot.axes)
    return full[index][:, index]
