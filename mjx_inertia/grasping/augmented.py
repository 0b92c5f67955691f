"""An object in the hand: the arm's joint-space and operational-space dynamics with a payload.

In: an `Arm`, the object's `InertialParameters` and how the hand holds it, both of which may be
traced. Out: the arm with that payload, whose mass matrix, bias forces and torques are then those of
the augmented object (Khatib 1987), and what the hand feels of it. Redundant arms go through
Λ = (J M⁻¹ Jᵀ)⁻¹ and the dynamically consistent inverse (errata 13).
Operational quantities are at the hand's origin, or at another point of the hand, in world axes;
twists and wrenches are (linear, angular). At a singular configuration Λ has no finite value.
"""

import jax.numpy as jnp
import jaxlie
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.robots.arm import Arm, check_joints
from mjx_inertia.robots.chain import Frame, unstack
from mjx_inertia.robots.recursions import (
    composite_bodies,
    hand_point,
    jacobian_columns,
    jacobian_rate_twist,
    link_frames,
    newton_euler,
    zeros,
)
from mjx_inertia.spatial import (
    InertialParameters,
    change_frame,
    combine,
    inertia_about,
    skew,
)
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


def with_payload(arm: Arm, payload: InertialParameters, T_hand_obj: jaxlie.SE3) -> Arm:
    """The arm that holds an object, together with what it held before.

    Args:
      arm: the arm.
      payload: of the object, in the object's frame.
      T_hand_obj: the object in the hand.
    """
    T_link_obj = arm.T_link_hand.to_se3() @ T_hand_obj
    held = change_frame(payload, T_link_obj)
    if arm.payload is not None:
        held = combine(_pair(arm.payload, held))
    return arm.replace(payload=held)


def operational_inertia(
    arm: Arm,
    q: Float[Array, " n"],
    point: Float[Array, "3"] | None = None,
    *,
    translation: bool = False,
) -> Float[Array, "r r"]:
    """Λ = (J M⁻¹ Jᵀ)⁻¹: the inertia of the arm, its payload included, as the hand feels it.

    Args:
      arm: the arm.
      q: joint positions.
      point: of the hand at which it is meant, m, in the hand's frame; its origin if None.
      translation: (J_v M⁻¹ J_vᵀ)⁻¹ of the translation alone, 3 × 3: the hand free to turn. It is
        not the upper left block of Λ, which is that of a hand kept from turning.
    """
    check_joints(arm, q=q)
    factor = cholesky(_mass_matrix(arm, q))
    jacobian = _jacobian(arm, link_frames(arm, unstack(q)), point, translation)
    half = Matrix(factor.solve_lower(row) for row in jacobian)  # L⁻¹ Jᵀ, transposed
    return stacked(cholesky(computed_once(half.gram())).inverse(), q.dtype)


def effective_mass(
    arm: Arm,
    q: Float[Array, " n"],
    direction: Float[Array, "3"],
    point: Float[Array, "3"] | None = None,
) -> Float[Array, ""]:
    """Mass (kg) that a body feels which hits the hand: 1 / (uᵀ J_v M⁻¹ J_vᵀ u).

    Khatib 1995; thesis Sec. 5.2.

    Args:
      arm: the arm.
      q: joint positions.
      direction: u, of the impact, of length 1, in world axes.
      point: of the hand that is hit, m, in the hand's frame; its origin if None.
    """
    check_joints(arm, q=q)
    jacobian = _jacobian(arm, link_frames(arm, unstack(q)), point, translation=True)
    along = computed_once(jacobian.T @ components(direction))
    half = cholesky(_mass_matrix(arm, q)).solve_lower(along)
    return jnp.asarray(1.0 / (half @ half), q.dtype)


def operational_dynamics(
    arm: Arm,
    q: Float[Array, " n"],
    qd: Float[Array, " n"],
    point: Float[Array, "3"] | None = None,
    *,
    translation: bool = False,
) -> OperationalDynamics:
    """Λ, J, J̄, μ and p in one state; Khatib 1987, Eqs 49 to 51.

    Args:
      arm: the arm.
      q: joint positions.
      qd: joint velocities.
      point: of the hand at which they are meant, m, in the hand's frame; its origin if None.
      translation: of the translation alone (r = 3) rather than of the twist (r = 6).
    """
    check_joints(arm, q=q, qd=qd)
    # Λ = (J M⁻¹ Jᵀ)⁻¹, with M = L Lᵀ
    frames = link_frames(arm, unstack(q))
    jacobian = _jacobian(arm, frames, point, translation)
    factor = cholesky(_mass_matrix(arm, q))
    half = Matrix(factor.solve_lower(row) for row in jacobian)  # L⁻¹ Jᵀ, transposed
    inertia = cholesky(computed_once(half.gram())).inverse()
    # J̄ᵀ = Λ J M⁻¹
    responses = Matrix(factor.solve_upper(row) for row in half)
    consistent = computed_once(inertia @ responses)
    # μ and p from the torques of the same state, and at rest
    weight = Vector(newton_euler(arm, unstack(q), zeros(arm), zeros(arm)))
    bias = Vector(newton_euler(arm, unstack(q), unstack(qd), zeros(arm)))
    columns = jacobian_columns(arm, frames, hand_point(arm, frames[-1], point))
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


def object_inertia(
    payload: InertialParameters, T_world_hand: jaxlie.SE3, T_hand_obj: jaxlie.SE3
) -> Float[Array, "6 6"]:
    """Λ_o: a held object's spatial inertia at the hand's origin, in world axes.

    Λ of an arm with the object is Λ of the arm plus this: v_com = v + ω × r with r from the hand to
    the CoM, so Λ_o = Tᵀ diag(m 1, R I R^T) T with T = [[1, -[r]×], [0, 1]] (errata 14).
    """
    T_world_obj = T_world_hand @ T_hand_obj
    placed = change_frame(payload, T_world_obj)
    r = placed.com - T_world_hand.translation()
    across = placed.mass * skew(r)
    about_hand = inertia_about(placed, T_world_hand.translation())
    unit = jnp.eye(3, dtype=r.dtype)
    return jnp.block([[placed.mass * unit, -across], [across, about_hand]])


def _jacobian(arm: Arm, frames: list[Frame], point: Point, translation: bool) -> Matrix:
    """The hand's Jacobian."""
    columns = jacobian_columns(arm, frames, hand_point(arm, frames[-1], point))
    jacobian = Matrix((*linear, *angular) for linear, angular in columns).T
    return Matrix(jacobian[:3]) if translation else jacobian


def _mass_matrix(arm: Arm, q: Float[Array, " n"]) -> SymmetricMatrix:
    return SymmetricMatrix(composite_bodies(arm, unstack(q)))


def _pair(a: InertialParameters, b: InertialParameters) -> InertialParameters:
    return InertialParameters(
        jnp.stack([a.mass, b.mass]),
        jnp.stack([a.com, b.com]),
        jnp.stack([a.inertia, b.inertia]),
    )
