"""What is known about a measured push beside its signals: truth and conditions.

In: a record, the model of its object and its file name. Out: `PushTruth` and `PushConditions`.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.batch import PushConditions, PushTruth
from mjx_inertia.dataset.mcube_name import McubePush
from mjx_inertia.objects import ObjectModel, closest_on_outline
from mjx_inertia.pushing import PushRecord

FACE = 0.1  # of the perimeter: a shorter edge of an outline is part of a curve, not a face


def mcube_truth(record: PushRecord, model: ObjectModel) -> PushTruth:
    """True mass, I_zz and CoM of one push, the CoM in the frame of its first contact."""
    inertial = model.inertial
    pose = np.asarray(record.pose, dtype=np.float64)[0]
    com_world = rotation_matrix(pose[2]) @ np.asarray(inertial.com, dtype=np.float64)[:2] + pose[:2]
    normal = np.asarray(record.contact_normal, dtype=np.float64)
    left = np.array([-normal[1], normal[0]])
    from_contact = com_world - np.asarray(record.contact_point, dtype=np.float64)
    return PushTruth(
        mass=jnp.asarray(inertial.mass, dtype=jnp.float32),
        inertia=jnp.asarray(inertial.inertia[2, 2], dtype=jnp.float32),
        com=jnp.asarray(np.array([normal @ from_contact, left @ from_contact]), dtype=jnp.float32),
    )


def mcube_conditions(
    record: PushRecord, model: ObjectModel, push: McubePush, object_id: int
) -> PushConditions:
    """Conditions of one push.

    Friction is NaN: that of one surface varies twofold between objects. Size is the diameter of
    the circle with the footprint's area; speed that of the file name, for an accelerated push the
    one it ends with. The contact offset runs from -1 to 1 along the touched edge of the outline,
    positive to the left of the inward normal, and is NaN on a curve.
    """

    def single(value: float) -> jnp.ndarray:
        return jnp.asarray(value, dtype=jnp.float32)

    return PushConditions(
        object_id=jnp.asarray(object_id, dtype=jnp.int32),
        friction=single(np.nan),
        size=single(model.mean_diameter),
        speed=single(push.nominal_speed),
        contact_offset=single(_contact_offset(record, model)),
        angle=single(push.angle),
    )


def _contact_offset(record: PushRecord, model: ObjectModel) -> float:
    pose = np.asarray(record.pose, dtype=np.float64)[0]
    contact = np.asarray(record.contact_point, dtype=np.float64)
    contact_obj = rotation_matrix(pose[2]).T @ (contact - pose[:2])
    outline = model.outline
    edge = closest_on_outline(outline, contact_obj[None]).edge[0]
    steps = np.roll(outline, -1, axis=0) - outline
    lengths = np.linalg.norm(steps, axis=1)
    if lengths[edge] < FACE * lengths.sum():
        return float("nan")
    middle = outline[edge] + 0.5 * steps[edge]
    # Counter-clockwise, the edge runs to the right of the inward normal.
    right = steps[edge] / lengths[edge]
    return float(-right @ (contact_obj - middle) / (0.5 * lengths[edge]))


def rotation_matrix(yaw: float) -> Float[ndarray, "2 2"]:
    """R_world_obj of an object turned by `yaw`, rad."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin], [sin, cos]])
