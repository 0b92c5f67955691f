"""An object in the hand: the arm's joint-space and operational-space dynamics with a payload.

In: an arm with its payload (`robots.with_payload`), whose mass matrix, bias forces and torques are
those of the augmented object (Khatib 1987). Out: what the hand feels of it. Redundant arms go
through Λ = (J M⁻¹ Jᵀ)⁻¹ and the dynamically consistent inverse (errata 13).
Operational quantities are at the hand's origin, or at another point of the hand, in world axes;
twists and wrenches are (linear, angular). At a singular configuration Λ has no finite value.
"""

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.robots.links import Frame, Joint, joints_at, unstack
from mjx_inertia.robots.recursions import (
    composite_inertias,
    hand_point,
    jacobian_columns,
    jacobian_rate_twist,
    link_frames,
    newton_euler,
    zeros,
)
from mjx_inertia.robots.robot import Robot, check_joints
from mjx_inertia.spatial.small_cholesky import cholesky
from mjx_inertia.spatial.unrolled import (
    Matrix,
    SymmetricMatrix,
    Vector,
    components,
    computed_once,
    stacked,
)

Point = Float[Array, "3"] | None


@struct.dataclass
class OperationalDynamics:
    """Dynamics of an arm as its hand feels it: F = Λ ẍ + μ + p, with F and ẍ of r rows.

    r is 6 (linear, angular), or 3 for the translation alone.
    """

    inertia: Float[Array, "r r"]  # Λ, the pseudo kinetic energy matrix (kg, kg m, kg m²)
    jacobian: Float[Array, "r n"]  # J, ẋ = J q̇
    # J̄ = M⁻¹ Jᵀ Λ, the inverse of J that takes least kinetic energy
    consistent_inverse: Float[Array, "n r"]
    coriolis: Float[Array, " r"]  # μ = J̄ᵀ (Coriolis torque) - Λ J̇ q̇
    gravity: Float[Array, " r"]  # p = J̄ᵀ (gravity torque)


def operational_inertia(
    arm: Robot,
    q: Float[Array, " n"],
    point: Float[Array, "3"] | None = None,
    *,
    translation: bool = False,
) -> Float[Array, "r r"]:
    """Λ = (J M⁻¹ Jᵀ)⁻¹: the inertia of the arm, its payload included, as the hand feels it.

    With `translation` it is (J_v M⁻¹ J_vᵀ)⁻¹, 3 × 3, of a hand free to turn. That is not the upper
    left block of Λ, which is that of a hand kept from turning.
    """
    check_joints(arm, q=q)
    joints = joints_at(arm, unstack(q))
    factor = cholesky(_mass_matrix(arm, joints))
    jacobian = _jacobian(arm, link_frames(arm, joints), point, translation)
    half = Matrix(factor.solve_lower(row) for row in jacobian)  # L⁻¹ Jᵀ, transposed
    return stacked(cholesky(computed_once(half.gram())).inverse(), q.dtype)


def effective_mass(
    arm: Robot,
    q: Float[Array, " n"],
    direction: Float[Array, "3"],
    point: Float[Array, "3"] | None = None,
) -> Float[Array, ""]:
    """Mass (kg) that a body feels which hits the hand: 1 / (uᵀ J_v M⁻¹ J_vᵀ u).

    `direction` is u, a unit vector in world axes (Khatib 1995; thesis Sec. 5.2).
    """
    check_joints(arm, q=q)
    joints = joints_at(arm, unstack(q))
    jacobian = _jacobian(arm, link_frames(arm, joints), point, translation=True)
    along = computed_once(jacobian.T @ components(direction))
    half = cholesky(_mass_matrix(arm, joints)).solve_lower(along)
    return jnp.asarray(1.0 / (half @ half), q.dtype)


def operational_dynamics(
    arm: Robot,
    q: Float[Array, " n"],
    qd: Float[Array, " n"],
    point: Float[Array, "3"] | None = None,
    *,
    translation: bool = False,
) -> OperationalDynamics:
    """Λ, J, J̄, μ and p in one state; Khatib 1987, Eqs 49 to 51.

    With `translation` of the translation alone (r = 3) rather than of the twist (r = 6).
    """
    check_joints(arm, q=q, qd=qd)
    # Λ = (J M⁻¹ Jᵀ)⁻¹, with M = L Lᵀ
    joints = joints_at(arm, unstack(q))
    frames = link_frames(arm, joints)
    jacobian = _jacobian(arm, frames, point, translation)
    factor = cholesky(_mass_matrix(arm, joints))
    half = Matrix(factor.solve_lower(row) for row in jacobian)  # L⁻¹ Jᵀ, transposed
    inertia = cholesky(computed_once(half.gram())).inverse()
    # J̄ᵀ = Λ J M⁻¹
    responses = Matrix(factor.solve_upper(row) for row in half)
    consistent = computed_once(inertia @ responses)
    # μ and p from the torques of the same state, and at rest
    weight = Vector(newton_euler(arm, joints, zeros(arm), zeros(arm)).joints)
    bias = Vector(newton_euler(arm, joints, unstack(qd), zeros(arm)).joints)
    columns = jacobian_columns(arm, frames, hand_point(arm, frames, point))
    linear, angular = jacobian_rate_twist(columns, unstack(qd))
    drift = Vector((*linear, *angular))[: len(jacobian)]
    gravity = consistent @ weight
    return OperationalDynamics(
        inertia=stacked(inertia, q.dtype),
        jacobian=stacked(jacobian, q.dtype),
        consistent_inverse=stacked(consistent.T, q.dtype),
        coriolis=stacked(consistent @ bias - gravity - inertia @ drift, q.dtype),
        gravity=stacked(gravity, q.dtype),
    )


def _jacobian(arm: Robot, frames: list[Frame], point: Point, translation: bool) -> Matrix:
    """The hand's Jacobian."""
    columns = jacobian_columns(arm, frames, hand_point(arm, frames, point))
    jacobian = Matrix((*linear, *angular) for linear, angular in columns).T
    return Matrix(jacobian[:3]) if translation else jacobian


def _mass_matrix(arm: Robot, joints: list[Joint]) -> SymmetricMatrix:
    return SymmetricMatrix(composite_inertias(arm, joints).joints)
