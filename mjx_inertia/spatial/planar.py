"""What a push on a table can see of a body: its mass, I_zz and the CoM in the plane.

In: `InertialParameters` in a frame with z up. Out: `PlanarInertia`, and a way back that has to
assume what the plane does not show. Vectors of the plane: their cross product and rotation.
"""

import dataclasses

import jax.numpy as jnp
import jaxlie
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.spatial.arrays import AnyArray
from mjx_inertia.spatial.inertia import InertialParameters


@struct.dataclass
class PlanarInertia:
    """Inertial parameters of motion in the x-y plane of a named frame."""

    mass: Float[Array, "*n"]  # kg
    inertia: Float[Array, "*n"]  # I_zz about the centre of mass, kg m²
    com: Float[Array, "*n 2"]  # x and y of the centre of mass, m, in the frame


def to_planar(params: InertialParameters) -> PlanarInertia:
    """The body seen along the z axis of its frame."""
    return PlanarInertia(params.mass, params.inertia[2, 2], params.com[:2])


def from_planar(
    planar: PlanarInertia,
    *,
    height: Float[Array, ""] | float = 0.0,
    com_z: Float[Array, ""] | float = 0.0,
) -> InertialParameters:
    """A body with the given planar parameters: a prism whose section is alike in x and y.

    Of all bodies with these planar parameters it is the upright prism with I_xx = I_yy, as for
    every section with at least three-fold symmetry. In-plane motion does not depend on the choice.

    Args:
      planar: in the x-y plane of a frame with z up.
      height: extent along z, m; with 0 the body is a plate, on the boundary of consistency.
      com_z: height of the centre of mass, m.

    Returns:
      Parameters in that frame; `to_planar` gives `planar` back exactly.
    """
    # A lamina has I_xx + I_yy = I_zz; its extrusion adds m h²/12 to both (parallel axes).
    transverse = 0.5 * planar.inertia + planar.mass * height**2 / 12.0
    com_z = jnp.asarray(com_z, planar.com.dtype)
    return InertialParameters(
        mass=planar.mass,
        com=jnp.append(planar.com, com_z),
        inertia=jnp.diag(jnp.stack([transverse, transverse, planar.inertia])),
    )


def change_frame_planar(planar: PlanarInertia, T_new_old: jaxlie.SE2) -> PlanarInertia:
    """Planar parameters in frame `new` of a body that `planar` describes in frame `old`."""
    return dataclasses.replace(planar, com=T_new_old.apply(planar.com))


def planar_cross(a: Float[AnyArray, "*n 2"], b: Float[AnyArray, "*n 2"]) -> Float[AnyArray, "*n"]:
    """The z component of a × b: moment of a force b at a."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def planar_rotate(angle: Float[AnyArray, "*n"], p: Float[AnyArray, "2"]) -> Float[Array, "*n 2"]:
    """One vector turned counterclockwise by each angle (rad)."""
    cos, sin = jnp.cos(angle), jnp.sin(angle)
    return jnp.stack([cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]], axis=-1)
