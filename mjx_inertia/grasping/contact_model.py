"""What soft finger pads can do to an object: forces in the friction cone, and a torsion.

A point contact pushes and rubs; a pad also resists a turn about its normal. Two point contacts can
never hold an object, because nothing resists a turn about the line between them; two pads can. So
the soft finger is the model throughout: normal force f_n, tangential force f_t and torsion m with

    (f_t / friction)² + (m / torsion)² <= f_n²  and  f_n >= 0

(Howe and Cutkosky 1996, "Practical force-motion models for sliding manipulation", IJRR 15(6)).
In: contacts. Out: the grasp map, what a contact can do at most, and force closure of two.
"""

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float

from mjx_inertia.grasping.grasp import Contacts


@struct.dataclass
class SoftFinger:
    """Friction between a pad and an object."""

    friction: Float[Array, "*n"] | float = 0.5  # Coulomb's coefficient
    # greatest moment about the normal per normal force, m. A round patch of radius r under uniform
    # pressure has 2/3 friction r; 0.003 is a patch of 9 mm at a friction of 0.5.
    torsion: Float[Array, "*n"] | float = 0.003


def grasp_map(
    contacts: Contacts, reference: Float[Array, "3"], length: Float[Array, ""] | float = 1.0
) -> Float[Array, "6 k_4"]:
    """Wrench on the object by (normal force, two tangential ones, torsion) of each contact.

    Moments are about `reference` (m, object frame; usually the CoM) and divided by `length` (m), so
    that all six rows are forces.
    """

    def columns(point: Array, normal: Array) -> Array:
        axes = jnp.concatenate([normal[None], tangents(normal)])
        moments = jnp.cross(point - reference, axes) / length
        force_columns = jnp.concatenate([axes, moments], axis=1)
        torsion_column = jnp.concatenate([jnp.zeros(3, normal.dtype), normal / length])
        return jnp.concatenate([force_columns, torsion_column[None]])

    each = [columns(p, n) for p, n in zip(contacts.points, contacts.normals, strict=True)]
    return jnp.concatenate(each).T


def tangents(normal: Float[Array, "3"]) -> Float[Array, "2 3"]:
    """Two unit vectors normal to each other and to `normal`, of length 1.

    Duff et al. 2017, "Building an orthonormal basis, revisited", JCGT 6(1).
    """
    x, y, z = normal
    sign = jnp.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    return jnp.stack(
        [
            jnp.stack([1.0 + sign * x * x * a, sign * b, -sign * x]),
            jnp.stack([b, sign + y * y * a, -y]),
        ]
    )


def support(
    contacts: Contacts, pad: SoftFinger, twist: Float[Array, "6"], reference: Float[Array, "3"]
) -> Float[Array, " k"]:
    """Greatest power (W) of each contact on a twist of the object, per normal force of 1 N.

    The support function of the friction cone with f_n = 1, in closed form. The twist is the
    velocity (m/s) of `reference` (m, object frame) and the angular velocity (rad/s).
    """
    linear, angular = twist[:3], twist[3:]
    velocity = linear + jnp.cross(angular, contacts.points - reference)
    along = jnp.sum(velocity * contacts.normals, axis=1)
    across = jnp.sum(velocity**2, axis=1) - along**2
    spin = jnp.sum(angular * contacts.normals, axis=1)
    squared = pad.friction**2 * jnp.maximum(across, 0.0) + (pad.torsion * spin) ** 2
    return along + jnp.sqrt(squared)


def antipodal_margin(contacts: Contacts, pad: SoftFinger) -> Float[Array, ""]:
    """Angle (rad) by which the line between two contacts is inside both cones; negative outside."""
    across = contacts.points[1] - contacts.points[0]
    along = jnp.stack(
        [jnp.sum(contacts.normals[0] * across), -jnp.sum(contacts.normals[1] * across)]
    )
    sideways = jnp.linalg.norm(jnp.cross(contacts.normals, across), axis=1)
    return jnp.arctan(jnp.asarray(pad.friction)) - jnp.max(jnp.arctan2(sideways, along))


def is_force_closure(contacts: Contacts, pad: SoftFinger) -> Bool[Array, ""]:
    """Whether two soft fingers can resist every wrench if they squeeze hard enough.

    They can exactly where the line between them is inside both friction cones and the pads resist
    torsion (Nguyen 1988, "Constructing force-closure grasps", IJRR 7(3), Corollary 2).
    """
    return (antipodal_margin(contacts, pad) > 0.0) & (jnp.asarray(pad.torsion) > 0.0)
