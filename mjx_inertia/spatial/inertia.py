"""Mass, centre of mass and inertia tensor of a rigid body, and their algebra.

In: inertial parameters in a named frame. Out: the same in another frame, about another point, of
several bodies joined, and the kinetic energy. Matrix products ask for full precision, because on
a GPU the default one rounds float32 to ten bits.
"""

import jax.numpy as jnp
import jaxlie
from flax import struct
from jaxtyping import Array, Float


@struct.dataclass
class InertialParameters:
    """Inertial parameters of one rigid body (or, with leading axes, of many) in a named frame."""

    mass: Float[Array, "*n"]  # kg
    com: Float[Array, "*n 3"]  # centre of mass, m, from the origin of the frame in its axes
    # inertia tensor about the *centre of mass*, kg m², in the axes of the frame
    inertia: Float[Array, "*n 3 3"]


def point_mass_inertia(mass: Float[Array, ""], offset: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Inertia tensor (kg m²) about the origin of a point `mass` (kg) at `offset` (m)."""
    # Featherstone 2008, Eq. 2.63, the part that the parallel-axis theorem adds: m (c·c 1 - c cᵀ)
    squared = jnp.sum(offset * offset)
    return mass * (squared * jnp.eye(3, dtype=offset.dtype) - jnp.outer(offset, offset))


def inertia_about(params: InertialParameters, point: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Inertia tensor (kg m²) about `point` (m, in the frame of `params`), in the same axes.

    The parallel-axis theorem (Featherstone 2008, Eq. 2.63).
    """
    return params.inertia + point_mass_inertia(params.mass, params.com - point)


def change_frame(params: InertialParameters, T_new_old: jaxlie.SE3) -> InertialParameters:
    """Parameters in frame `new` of a body that `params` describes in frame `old`.

    The tensor stays about the centre of mass, so only its axes turn: I_new = R I_old Rᵀ.
    """
    rotation = T_new_old.rotation().as_matrix()
    return InertialParameters(
        mass=params.mass,
        com=T_new_old.apply(params.com),
        inertia=jnp.einsum("ij,jk,lk->il", rotation, params.inertia, rotation, precision="highest"),
    )


def combine(bodies: InertialParameters) -> InertialParameters:
    """One body made of several that are rigidly joined.

    Bodies of no mass add their tensor only, so all-zero rows are padding; a body of negative mass
    and tensor is a cavity. A total of no mass has its centre of mass at the origin, and
    `check_consistency` tells.

    Args:
      bodies: parameters with one leading axis, all in one frame.

    Returns:
      Parameters without that axis, in the same frame.

    Raises:
      ValueError: `bodies` has not exactly one leading axis.
    """
    if jnp.ndim(bodies.mass) != 1:
        raise ValueError(
            f"`bodies` must have one leading axis, but its mass has shape "
            f"{jnp.shape(bodies.mass)}; stack the bodies, and vmap over further axes"
        )
    mass = jnp.sum(bodies.mass)
    first_moment = jnp.sum(bodies.mass[:, None] * bodies.com, axis=0)
    com = first_moment / jnp.where(mass == 0.0, 1.0, mass)
    # Parallel axes to the joint CoM: sum of Iᵢ + mᵢ (dᵢ·dᵢ 1 - dᵢ dᵢᵀ). Offsets from the joint CoM,
    # not from the origin, keep float32 accurate when the frame is far away.
    offset = bodies.com - com
    squared = jnp.sum(offset * offset, axis=-1)[:, None, None]
    outer = offset[:, :, None] * offset[:, None, :]
    shifts = bodies.mass[:, None, None] * (squared * jnp.eye(3, dtype=offset.dtype) - outer)
    return InertialParameters(mass, com, jnp.sum(bodies.inertia + shifts, axis=0))


def kinetic_energy(params: InertialParameters, twist: Float[Array, "6"]) -> Float[Array, ""]:
    """Kinetic energy (J) of a body whose frame moves with `twist`.

    Args:
      params: the body, in a frame fixed to it.
      twist: velocity of the frame's origin (m/s) and angular velocity (rad/s), in its axes.
    """
    linear, angular = twist[:3], twist[3:]
    com_velocity = linear + jnp.cross(angular, params.com)
    rotational = jnp.einsum("i,ij,j->", angular, params.inertia, angular, precision="highest")
    return 0.5 * (params.mass * jnp.sum(com_velocity**2) + rotational)
