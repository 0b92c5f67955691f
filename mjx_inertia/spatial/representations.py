"""Inertial parameters as the linear objects of rigid-body dynamics, there and back.

In: `InertialParameters`. Out: the 10-vector, the 6×6 spatial inertia and the 4×4 pseudo-inertia,
all about the *origin* of the same frame and linear in each other. The way back divides by the mass
and subtracts m|c|² from the tensor; a body far from its origin loses precision there (relative
error of the tensor about eps m|c|² / I). A mass of zero gives values that are not finite, which
`check_consistency` reports.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.spatial.inertia import InertialParameters, inertia_about, point_mass_inertia
from mjx_inertia.spatial.second_moment import inertia_from_second_moment, second_moment_from_inertia

# kg, kg m, kg m²; the tensor is about the origin and its products carry their own sign
TEN_VECTOR_NAMES = ("m", "mc_x", "mc_y", "mc_z", "I_xx", "I_xy", "I_yy", "I_xz", "I_yz", "I_zz")


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


def _from_moments_about_origin(
    mass: Float[Array, ""], first_moment: Float[Array, "3"], tensor: Float[Array, "3 3"]
) -> InertialParameters:
    com = first_moment / mass
    return InertialParameters(mass, com, tensor - point_mass_inertia(mass, com))
