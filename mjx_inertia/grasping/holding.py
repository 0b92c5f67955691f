"""How hard a parallel jaw must squeeze to hold a payload, at one moment and through a whole task.

In: contacts, the payload's inertial parameters, how it moves or its `ObjectPath`. Out: the wrench
that the fingers must exert, and the least force of the jaw.
"""

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.grasping.contact_model import SoftFinger
from mjx_inertia.grasping.grasp import Contacts
from mjx_inertia.grasping.task_path import ObjectPath, moving_frame_twist, object_pose_at
from mjx_inertia.grasping.two_soft_fingers import least_squeeze
from mjx_inertia.spatial import AnyArray, InertialParameters

_UNIT = 1e-2  # by which the squared length of a unit normal may be off


@struct.dataclass
class ObjectMotion:
    """How an object frame moves at one moment (with leading axes: at many), in world axes."""

    R_world_obj: Float[AnyArray, "*n 3 3"]  # rotation matrix of the object frame
    acceleration: Float[Array, "*n 3"]  # of the origin of the object frame, m/s²
    angular_velocity: Float[Array, "*n 3"]  # rad/s
    angular_acceleration: Float[Array, "*n 3"]  # rad/s²


def holding_wrench(
    payload: InertialParameters, motion: ObjectMotion, gravity: Float[AnyArray, "3"]
) -> Float[Array, "6"]:
    """Force (N) and moment (N m) about the CoM that hold a payload, in the axes of the object.

    Newton-Euler about the CoM: m (a_com - g) and I α + ω × I ω. The payload is in the object frame,
    `gravity` (m/s²) in world axes.
    """
    turned = motion.R_world_obj.T
    spin = jnp.sum(turned * motion.angular_velocity, axis=1)
    spin_up = jnp.sum(turned * motion.angular_acceleration, axis=1)
    free = jnp.sum(turned * (motion.acceleration - gravity), axis=1)
    offset = payload.com
    specific = free + jnp.cross(spin_up, offset) + jnp.cross(spin, jnp.cross(spin, offset))
    momentum = jnp.sum(payload.inertia * spin, axis=1)
    moment = jnp.sum(payload.inertia * spin_up, axis=1) + jnp.cross(spin, momentum)
    return jnp.concatenate([payload.mass * specific, moment])


def gripping_force(
    contacts: Contacts,
    pad: SoftFinger,
    payload: InertialParameters,
    motion: ObjectMotion,
    gravity: Float[AnyArray, "3"],
) -> Float[Array, ""]:
    """Least force (N) of a parallel jaw that holds a payload at one moment.

    It depends on the mass, on the CoM (a lever about the line between the pads loads them with
    torsion) and, in fast turns, on the inertia tensor. Infinite where the two contacts are not in
    force closure, where their normals are not of length 1 and where the mass is negative or NaN.
    Contacts and payload are in the object frame, `gravity` (m/s²) in world axes.
    """
    wrench = holding_wrench(payload, motion, gravity)
    squared = jnp.sum(jnp.square(contacts.normals), axis=-1)
    possible = jnp.all(jnp.abs(squared - 1.0) <= _UNIT) & (payload.mass >= 0.0)
    return jnp.where(possible, least_squeeze(contacts, pad, wrench, payload.com), jnp.inf)


def object_motion(path: ObjectPath) -> ObjectMotion:
    """Velocities and accelerations of the object frame at the waypoints of a path."""

    def at(move: Array, s: Array, rate: Array, acceleration: Array) -> ObjectMotion:
        pose, xi, bend = moving_frame_twist(lambda s: object_pose_at(path, move, s), s)
        change = acceleration * xi + rate**2 * bend
        return ObjectMotion(pose.rotation, change[:3], rate * xi[3:], change[3:])

    return jax.vmap(at)(path.move, path.s, path.rate, path.acceleration)


@jax.jit
def greatest_gripping_force(
    contacts: Contacts,
    pad: SoftFinger,
    payload: InertialParameters,
    path: ObjectPath,
    gravity: Float[AnyArray, "3"],
) -> Float[Array, " n"]:
    """The greatest `gripping_force` (N) along a path, for the contacts of n grasps."""
    moments = object_motion(path)

    def along(one: Contacts) -> Float[Array, ""]:
        at = jax.vmap(lambda moment: gripping_force(one, pad, payload, moment, gravity))
        return jnp.max(at(moments))

    return jax.vmap(along)(contacts)
