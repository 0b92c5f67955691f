"""A body by its principal axes and moments, as MuJoCo and URDF files state it.

In: `InertialParameters`. Out: `PrincipalInertia`, and back.
"""

import jax.numpy as jnp
import jaxlie
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.spatial.inertia import InertialParameters, change_frame


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
