"""Rigid-body dynamics of an arm: torques, mass matrix, bias forces, accelerations.

In: an `Arm` and one state (joint positions rad or m, velocities, accelerations). Out: joint torques
(N m, or N where prismatic) and the joint-space mass matrix. `over_states` runs them over many.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.robots.arm import Arm, check_joints
from mjx_inertia.robots.chain import unstack
from mjx_inertia.robots.recursions import composite_bodies, newton_euler, zeros
from mjx_inertia.spatial.components import minus, stacked
from mjx_inertia.spatial.small_cholesky import factorize, solve_lower, solve_upper


def inverse_dynamics(
    arm: Arm, q: Float[Array, " n"], qd: Float[Array, " n"], qdd: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Joint torques that give the accelerations `qdd`: the recursive Newton-Euler algorithm."""
    check_joints(arm, q=q, qd=qd, qdd=qdd)
    return stacked(newton_euler(arm, unstack(q), unstack(qd), unstack(qdd)), q.dtype)


def bias_force(arm: Arm, q: Float[Array, " n"], qd: Float[Array, " n"]) -> Float[Array, " n"]:
    """Coriolis, centrifugal and gravity torques: those of zero joint acceleration."""
    check_joints(arm, q=q, qd=qd)
    return stacked(newton_euler(arm, unstack(q), unstack(qd), zeros(arm)), q.dtype)


def gravity_torque(arm: Arm, q: Float[Array, " n"]) -> Float[Array, " n"]:
    """Joint torques that hold the arm still."""
    check_joints(arm, q=q)
    return stacked(newton_euler(arm, unstack(q), zeros(arm), zeros(arm)), q.dtype)


def mass_matrix(arm: Arm, q: Float[Array, " n"]) -> Float[Array, "n n"]:
    """Joint-space mass matrix, armature included: the composite rigid body algorithm."""
    check_joints(arm, q=q)
    return stacked(composite_bodies(arm, unstack(q)), q.dtype)


def coriolis_matrix(arm: Arm, q: Float[Array, " n"], qd: Float[Array, " n"]) -> Float[Array, "n n"]:
    """C with C q̇ the Coriolis and centrifugal torque and Ṁ - 2C skew: Christoffel's symbols.

    Costs n derivatives of the mass matrix; where only C q̇ is wanted, take `bias_force`.
    """
    check_joints(arm, q=q, qd=qd)
    slope = jax.jacfwd(lambda q: mass_matrix(arm, q))(q)  # ∂M_ij/∂q_k
    along = jnp.sum(slope * qd, -1)  # Ṁ
    across = jnp.sum(slope * qd[:, None], 1)  # Σ_j ∂M_ij/∂q_k q̇_j
    return 0.5 * (along + across - across.T)


def forward_dynamics(
    arm: Arm, q: Float[Array, " n"], qd: Float[Array, " n"], torque: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Joint accelerations (rad/s², m/s²) that `torque` causes."""
    check_joints(arm, q=q, qd=qd, torque=torque)
    bias = newton_euler(arm, unstack(q), unstack(qd), zeros(arm))
    rest = [minus(t, b) for t, b in zip(unstack(torque), bias, strict=True)]
    factor = factorize(composite_bodies(arm, unstack(q)))
    return stacked(solve_upper(factor, solve_lower(factor, rest)), q.dtype)
