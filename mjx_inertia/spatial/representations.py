"""Inertial parameters in the forms of rigid-body dynamics and identification, there and back.

In: `InertialParameters`. Out: the 10-vector, the 6×6 spatial inertia and the 4×4 pseudo-inertia,
all about the *origin* of the same frame and linear in each other; principal moments and axes; and
log-Cholesky parameters, ten unconstrained numbers that always describe a consistent body.

The way back from the linear forms divides by the mass and subtracts m|c|² from the tensor; a body
far from its origin loses precision there (relative error of the tensor about eps m|c|² / I). A mass
of zero gives values that are not finite, which `check_consistency` reports.

Sources: Wensing, Kim and Slotine 2018, "Linear matrix inequalities for physically consistent
inertial parameter identification", IEEE RA-L 3(1). Rucker and Wensing 2022, "Smooth
parameterization of rigid-body inertia", IEEE RA-L 7(2).
"""

import jax.numpy as jnp
import jaxlie
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.spatial.inertia import (
    InertialParameters,
    change_frame,
    inertia_about,
    point_mass_inertia,
)

# kg, kg m, kg m²; the tensor is about the origin and its products carry their own sign
TEN_VECTOR_NAMES = ("m", "mc_x", "mc_y", "mc_z", "I_xx", "I_xy", "I_yy", "I_xz", "I_yz", "I_zz")
LOG_CHOLESKY_NAMES = ("alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")


def skew(vector: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """The matrix that takes the cross product: `skew(a) @ b` is a × b."""
    return jnp.cross(jnp.eye(3, dtype=vector.dtype), vector)


def to_ten_vector(params: InertialParameters) -> Float[Array, "10"]:
    """The parameters in which dynamics is linear, in the order of `TEN_VECTOR_NAMES`."""
    tensor = inertia_about(params, jnp.zeros_like(params.com))
    lower = tensor[jnp.tril_indices(3)]  # xx, yx, yy, zx, zy, zz
    return jnp.concatenate([params.mass[None], params.mass * params.com, lower])


def from_ten_vector(vector: Float[Array, "10"]) -> InertialParameters:
    """Parameters of a 10-vector in the order of `TEN_VECTOR_NAMES`."""
    xx, xy, yy, xz, yz, zz = vector[4:]
    tensor = jnp.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return _from_moments_about_origin(vector[0], vector[1:4], tensor)


def to_spatial_inertia(params: InertialParameters) -> Float[Array, "6 6"]:
    """Spatial inertia M about the origin: a twist V (linear, angular) has the energy ½ Vᵀ M V.

    Blocks in kg, kg m and kg m². Featherstone 2008, Eq. 2.63, with linear before angular.
    """
    cross = params.mass * skew(params.com)
    tensor = inertia_about(params, jnp.zeros_like(params.com))
    return jnp.block([[params.mass * jnp.eye(3, dtype=cross.dtype), -cross], [cross, tensor]])


def from_spatial_inertia(matrix: Float[Array, "6 6"]) -> InertialParameters:
    """Parameters of a spatial inertia (linear, angular); its structure is taken on trust."""
    first_moment = jnp.array([matrix[5, 1], matrix[3, 2], matrix[4, 0]])
    return _from_moments_about_origin(matrix[0, 0], first_moment, matrix[3:, 3:])


def to_pseudo_inertia(params: InertialParameters) -> Float[Array, "4 4"]:
    """Pseudo-inertia about the origin: ∫ (r, 1)(r, 1)ᵀ dm, in kg m², kg m and kg.

    Positive definite exactly for bodies of positive density in three dimensions; a change of frame
    is J_new = T J_old Tᵀ with the homogeneous matrix T (Wensing, Kim
    and Slotine 2018, Sec. III).
    """
    tensor = inertia_about(params, jnp.zeros_like(params.com))
    first_moment = (params.mass * params.com)[:, None]
    return jnp.block(
        [
            [second_moment_from_inertia(tensor), first_moment],
            [first_moment.T, params.mass[None, None]],
        ]
    )


def from_pseudo_inertia(matrix: Float[Array, "4 4"]) -> InertialParameters:
    """Parameters of a symmetric pseudo-inertia about the origin."""
    tensor = inertia_from_second_moment(matrix[:3, :3])
    return _from_moments_about_origin(matrix[3, 3], matrix[:3, 3], tensor)


def second_moment_from_inertia(inertia: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Second moment (kg m²) of a body with the given inertia tensor (kg m²)."""
    # Wensing, Kim and Slotine 2018: Σ = ½ tr(I) 1 - I
    return 0.5 * jnp.trace(inertia) * jnp.eye(3, dtype=inertia.dtype) - inertia


def inertia_from_second_moment(second_moment: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Inertia tensor (kg m²) of a body with the given second moment (kg m²)."""
    # I = tr(Σ) 1 - Σ, with I_xx = Σ_yy + Σ_zz summed as such: tr(Σ) - Σ_xx would lose the small
    # moment of a thin rod about its own axis.
    eye = jnp.eye(3, dtype=second_moment.dtype)
    spread = jnp.diagonal(second_moment)
    return jnp.diag(jnp.sum((1.0 - eye) * spread, axis=1)) - (1.0 - eye) * second_moment


@struct.dataclass
class PrincipalInertia:
    """A body in the frame of its principal axes, whose origin is the centre of mass."""

    mass: Float[Array, "*n"]  # kg (MuJoCo's `body_mass`)
    # pose of the principal frame in the frame of the body (`body_iquat`, `body_ipos`)
    T_frame_principal: jaxlie.SE3
    moments: Float[Array, "*n 3"]  # principal moments, kg m² (`body_inertia`)


def to_principal(params: InertialParameters) -> PrincipalInertia:
    """Principal moments, largest first as in MuJoCo, and a right-handed frame of their axes.

    The sign of an axis is arbitrary, and so are the axes of equal moments: there the derivative of
    the pose does not exist (NaN). The moments always have a finite derivative.
    """
    moments, axes = jnp.linalg.eigh(params.inertia)
    largest, middle = axes[:, 2], axes[:, 1]
    rotation = jnp.stack([largest, middle, jnp.cross(largest, middle)], axis=1)
    pose = jaxlie.SE3.from_rotation_and_translation(
        jaxlie.SO3.from_matrix(rotation).normalize(), params.com
    )
    return PrincipalInertia(params.mass, pose, moments[::-1])


def from_principal(principal: PrincipalInertia) -> InertialParameters:
    """Parameters in the frame in which `principal` states its pose; moments in any order."""
    aligned = InertialParameters(
        mass=principal.mass,
        com=jnp.zeros_like(principal.moments),
        inertia=jnp.diag(principal.moments),
    )
    return change_frame(aligned, principal.T_frame_principal)


def from_log_cholesky(theta: Float[Array, "10"]) -> InertialParameters:
    """The body of `theta`, in the order of `LOG_CHOLESKY_NAMES` (Rucker and Wensing 2022).

    The pseudo-inertia about the origin is U Uᵀ with

        U = e^α [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3], [0, 0, 0, 1]].

    The last column is the mass and the centre of mass (m = e^2α, c = t), and what remains is the
    second moment about the centre of mass, so neither way subtracts m|c|².

    Args:
      theta: α is ½ ln(mass / kg); e^d and s are lengths in m; t is the centre of mass in m.

    Returns:
      Parameters in the frame in which t is the centre of mass. Their tensor is consistent in exact
      arithmetic; in floating point a very thin body may round to the boundary, never beyond the
      default tolerance of `check_consistency`.
    """
    alpha, d1, d2, d3, s12, s23, s13 = theta[:7]
    zero = jnp.zeros_like(alpha)
    root = jnp.array([[jnp.exp(d1), s12, s13], [zero, jnp.exp(d2), s23], [zero, zero, jnp.exp(d3)]])
    mass = jnp.exp(2.0 * alpha)
    gyration = jnp.einsum("ij,kj->ik", root, root, precision="highest")
    return InertialParameters(mass, theta[7:], mass * inertia_from_second_moment(gyration))


def to_log_cholesky(params: InertialParameters) -> Float[Array, "10"]:
    """The `theta` of a body, in the order of `LOG_CHOLESKY_NAMES`.

    Only bodies that `check_consistency` calls `CONSISTENT` have one. d and s are NaN for a body of
    impossible moments and may be NaN on the boundary (rods, plates, points), where `thicken` first
    gives the body a thickness; α is not finite without a positive mass.
    """
    gyration = second_moment_from_inertia(params.inertia) / params.mass
    # An upper factor U Uᵀ is the lower factor of the matrix with its axes in reverse.
    root = jnp.linalg.cholesky(gyration[::-1, ::-1])[::-1, ::-1]
    alpha = 0.5 * jnp.log(params.mass)
    shears = jnp.stack([root[0, 1], root[1, 2], root[0, 2]])
    return jnp.concatenate([alpha[None], jnp.log(jnp.diagonal(root)), shears, params.com])


def _from_moments_about_origin(
    mass: Float[Array, ""], first_moment: Float[Array, "3"], tensor: Float[Array, "3 3"]
) -> InertialParameters:
    com = first_moment / mass
    return InertialParameters(mass, com, tensor - point_mass_inertia(mass, com))
