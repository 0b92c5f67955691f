"""Dynamics of a free-floating robot without thrust: thesis Eqs 7.1 to 7.8, for any tree.

In: a `Robot` on a free base, and one state. Out: inertia matrices, velocity forces, the base's
motion that follows from zero momentum, the Generalised Jacobian, reduced dynamics. Twists, wrenches
and accelerations are in the axes of the base, (linear, angular), six entries or, for a planar
robot, the three of `robot.axes`. An object that moves with the hands counts if it is the robot's
payload (`with_capture`); the thesis leaves it out of Eqs 7.1 to 7.8.
"""

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.robots.links import LinkMotion, joints_at, unstack
from mjx_inertia.robots.recursions import (
    base_jacobian_rows,
    composite_inertias,
    frames_at,
    hand_frame,
    jacobian_columns,
    newton_euler,
    scatter_axes,
    select_axes,
)
from mjx_inertia.robots.robot import Robot, check_free_base, check_joints
from mjx_inertia.spatial.components import stacked


@struct.dataclass
class Inertias:
    """Mass matrix of the tree in blocks: thesis Eq. 7.1; k is 3 for a planar robot, else 6."""

    base: Float[Array, "k k"]  # H_b
    coupling: Float[Array, "k n"]  # H_bm
    joints: Float[Array, "n n"]  # H_m, of all joints


@struct.dataclass
class Forces:
    """Wrench at the base's origin, in its axes (N, N m), and torques (N m, or N)."""

    base: Float[Array, " k"]
    joints: Float[Array, " n"]


def inertias(robot: Robot, q: Float[Array, " n"]) -> Inertias:
    """H_b, H_bm and H_m at joint positions `q`."""
    check_free_base(robot)
    check_joints(robot, q=q)
    matrix = composite_inertias(robot, joints_at(robot, unstack(q)))
    return Inertias(
        stacked(matrix.base, q.dtype),
        stacked(matrix.coupling, q.dtype).T,
        stacked(matrix.joints, q.dtype),
    )


def floating_base_inverse_dynamics(
    robot: Robot,
    q: Float[Array, " n"],
    base: tuple[Float[Array, " k"], Float[Array, " k"]],
    rates: tuple[Float[Array, " n"], Float[Array, " n"]],
) -> Forces:
    """What a motion takes: the recursive Newton-Euler algorithm from a base that moves.

    Args:
      robot: the tree.
      q: joint positions.
      base: twist of the base, and its acceleration (that of its origin, in its axes).
      rates: joint velocities and accelerations.
    """
    check_free_base(robot)
    check_joints(robot, q=q, qd=rates[0], qdd=rates[1])
    _, omega = scatter_axes(robot, unstack(base[0]))
    linear, alpha = scatter_axes(robot, unstack(base[1]))
    joints, qd, qdd = joints_at(robot, unstack(q)), unstack(rates[0]), unstack(rates[1])
    forces = newton_euler(robot, joints, qd, qdd, LinkMotion(omega, alpha, linear))
    return Forces(stacked(forces.base, q.dtype), stacked(forces.joints, q.dtype))


def velocity_forces(
    robot: Robot,
    q: Float[Array, " n"],
    base_twist: Float[Array, " k"],
    qd: Float[Array, " n"],
) -> Forces:
    """c_b and c_m of Eq. 7.1: Coriolis and centrifugal forces."""
    still = jnp.zeros_like(base_twist), jnp.zeros_like(qd)
    return floating_base_inverse_dynamics(robot, q, (base_twist, still[0]), (qd, still[1]))


def momentum_map(matrix: Inertias) -> Float[Array, "k n"]:
    """J_a of Eq. 7.3: twist of the base for joint rates without momentum, -H_b⁻¹ H_bm."""
    return -jnp.linalg.solve(matrix.base, matrix.coupling)


def hand_jacobians(
    robot: Robot, q: Float[Array, " n"]
) -> tuple[Float[Array, "2 k k"], Float[Array, "2 k n"]]:
    """J_b and J_e of Eq. 7.4: twists of both hands for those of the base and of the joints."""
    check_free_base(robot)
    if len(robot.hands) != 2:
        raise ValueError(f"`robot` {robot.name} has {len(robot.hands)} hands; expected two")
    check_joints(robot, q=q)
    links = frames_at(robot, q)
    places = [hand_frame(robot, links, k).origin for k in (0, 1)]
    of_base = [base_jacobian_rows(robot, place) for place in places]
    of_joints = [
        [select_axes(robot, *column) for column in jacobian_columns(robot, links, place, k)]
        for k, place in enumerate(places)
    ]
    return (
        stacked(of_base, q.dtype).swapaxes(1, 2),
        stacked(of_joints, q.dtype).swapaxes(1, 2),
    )


def generalized_jacobian(robot: Robot, q: Float[Array, " n"]) -> Float[Array, "m n"]:
    """J_g of Eq. 7.5: twists of the right and the left hand for joint rates without momentum.

    Umetani and Yoshida 1989; errata 22.
    """
    of_base, of_joints = hand_jacobians(robot, q)
    both = of_joints + of_base @ momentum_map(inertias(robot, q))
    return both.reshape(-1, robot.dof)


def reduced_inertia(matrix: Inertias) -> Float[Array, "n n"]:
    """H_el of Eqs 7.6 and 7.7 (errata 23): what the joints feel of a base that is free."""
    return matrix.joints + matrix.coupling.T @ momentum_map(matrix)


def reduced_forces(matrix: Inertias, forces: Forces) -> Float[Array, " n"]:
    """c_el of Eq. 7.8 (errata 23): c_m - H_bmᵀ H_b⁻¹ c_b."""
    return forces.joints + momentum_map(matrix).T @ forces.base


def floating_base_forward_dynamics(
    robot: Robot,
    q: Float[Array, " n"],
    base_twist: Float[Array, " k"],
    qd: Float[Array, " n"],
    torque: Float[Array, " n"],
) -> tuple[Float[Array, " k"], Float[Array, " n"]]:
    """Accelerations that `torque` causes: of the base (its origin, in its axes), of the joints."""
    matrix = inertias(robot, q)
    forces = velocity_forces(robot, q, base_twist, qd)
    qdd = jnp.linalg.solve(reduced_inertia(matrix), torque - reduced_forces(matrix, forces))
    return -jnp.linalg.solve(matrix.base, forces.base + matrix.coupling @ qdd), qdd
