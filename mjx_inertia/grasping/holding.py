"""How hard a jaw must squeeze at the hardest moment of a whole task.

In: grasps, a payload, an `ObjectPath`. Out: the object's accelerations along the path, and one
gripping force for each grasp.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.grasping.contact_model import SoftFinger
from mjx_inertia.grasping.grasp import Contacts
from mjx_inertia.grasping.jaw_force import ObjectMotion, gripping_force
from mjx_inertia.grasping.task_path import ObjectPath, moving_frame_twist, object_pose_at
from mjx_inertia.spatial import AnyArray, InertialParameters


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
    """The greatest of the least forces (N) that hold a payload along a path, for n grasps.

    Args:
      contacts: of n grasps, in the object frame.
      pad: friction.
      payload: in the object frame.
      path: of the object.
      gravity: m/s², in world axes.

    Returns:
      Infinite where the contacts are no force closure.
    """
    moments = object_motion(path)

    def along(one: Contacts) -> Float[Array, ""]:
        at = jax.vmap(lambda moment: gripping_force(one, pad, payload, moment, gravity))
        return jnp.max(at(moments))

    return jax.vmap(along)(contacts)
