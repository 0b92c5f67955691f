"""An object in the hand: the arm's joint-space and operational-space dynamics with a payload.

In: an arm with its payload (`robots.with_payload`), whose mass matrix, bias forces and torques are
those of the augmented object (Khatib 1987). Out: what the hand feels of it. Redundant arms go
through Λ = (J M⁻¹ Jᵀ)⁻¹ and the dynamically consistent inverse (errata 13).
Operational quantities are at the hand's origin, or at another point of the hand, in world axes;
twists and wrenches are (linear, angular). At a singular configuration Λ has no finite value.
"""

from collections.abc import Sequence

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.robots.links import Frame, joints_at, unstack
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
from mjx_inertia.spatial.components import Component, components, minus, once, stacked
from mjx_inertia.spatial.small_cholesky import (
    Row,
    factorize,
    inner,
    inverse,
    solve_lower,
    solve_upper,
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
    factor = factorize(composite_inertias(arm, joints).joints)
    rows = _rows(arm, link_frames(arm, joints), point, translation)
    half = [solve_lower(factor, j) for j in rows]
    return stacked(inverse(factorize(_gram(half))), q.dtype)


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
    rows = _rows(arm, link_frames(arm, joints), point, translation=True)
    u = components(direction)
    along = [once(inner(u, column)) for column in zip(*rows, strict=True)]
    half = solve_lower(factorize(composite_inertias(arm, joints).joints), along)
    return jnp.asarray(1.0 / inner(half, half), q.dtype)


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
    joints = joints_at(arm, unstack(q))
    frames = link_frames(arm, joints)
    rows = _rows(arm, frames, point, translation)
    factor = factorize(composite_inertias(arm, joints).joints)
    half = [solve_lower(factor, j) for j in rows]
    inertia = inverse(factorize(_gram(half)))
    # J̄ᵀ = Λ J M⁻¹, with J M⁻¹ from the halves L⁻¹ Jᵀ that are there
    responses = [solve_upper(factor, h) for h in half]
    consistent = [
        [once(inner(line, column)) for line in inertia] for column in zip(*responses, strict=True)
    ]
    # joint torques of gravity, and of gravity with Coriolis forces
    weight = newton_euler(arm, joints, zeros(arm), zeros(arm)).joints
    bias = newton_euler(arm, joints, unstack(qd), zeros(arm)).joints
    columns = jacobian_columns(arm, frames, hand_point(arm, frames, point))
    linear, angular = jacobian_rate_twist(columns, unstack(qd))
    drift = [*linear, *angular][: len(rows)]
    # μ = J̄ᵀ (bias - weight) - Λ J̇ q̇
    by_hand = list(zip(*consistent, strict=True))
    coriolis = [
        minus(minus(inner(line, bias), inner(line, weight)), inner(inertia[i], drift))
        for i, line in enumerate(by_hand)
    ]
    return OperationalDynamics(
        inertia=stacked(inertia, q.dtype),
        jacobian=stacked(rows, q.dtype),
        consistent_inverse=stacked(consistent, q.dtype),
        coriolis=stacked(coriolis, q.dtype),
        gravity=stacked([inner(line, weight) for line in by_hand], q.dtype),
    )


def _rows(arm: Robot, frames: list[Frame], point: Point, translation: bool) -> Sequence[Row]:
    """The hand's Jacobian."""
    columns = jacobian_columns(arm, frames, hand_point(arm, frames, point))
    rows = zip(*((*linear, *angular) for linear, angular in columns), strict=True)
    return list(rows)[: 3 if translation else 6]


def _gram(half: Sequence[Row]) -> list[list[Component]]:
    """J M⁻¹ Jᵀ, its lower half, from rows L⁻¹ jᵀ."""
    return [[once(inner(a, b)) for b in half[: i + 1]] for i, a in enumerate(half)]
