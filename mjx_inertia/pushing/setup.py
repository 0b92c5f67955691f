"""What an experimenter knows of a push before it: where things were and how the tip went.

In: a plan or a measured record. Out: `PushSetup`; no inertial parameter is in it.
"""

import jax.numpy as jnp
from flax import struct
from jaxtyping import Float, Int

from mjx_inertia.pushing.motion import Motion, SampledMotion
from mjx_inertia.pushing.record import PushRecord
from mjx_inertia.spatial import AnyArray


@struct.dataclass
class PushSetup:
    """The known part of one push (or, with a leading axis, of many)."""

    motion: Motion  # of the tip
    pose: Float[AnyArray, "*n 3"]  # x, y (m) and yaw (rad) of the object frame at the start, world
    # of the object's bounding box, m: what a camera sees of it
    half_extents: Float[AnyArray, "*n 3"]
    # c of the limit surface that the outline has under uniform pressure, m
    friction_radius: Float[AnyArray, "*n"]
    shape: Int[AnyArray, "*n"]  # which of the known outlines the object has
    # what the tip meets of the object if it is not that outline, m (`plan_view`)
    polygons: Float[AnyArray, "*n m k 2"] | None = None


def measured_motion(record: PushRecord) -> SampledMotion:
    """The measured path of the tip, from one sampling interval before the first sample.

    Args:
      record: of one push, or of many with a leading axis; the tip is taken to move at its first
        velocity until the first sample.
    """
    time, tip = jnp.asarray(record.time), jnp.asarray(record.tip_position)
    interval = time[..., 1] - time[..., 0]
    start = tip[..., 0, :] - jnp.asarray(record.tip_velocity)[..., 0, :] * interval[..., None]
    offsets = jnp.concatenate([jnp.zeros_like(start)[..., None, :], tip - start[..., None, :]], -2)
    return SampledMotion(
        start=start,
        offsets=offsets,
        interval=interval,
        duration=interval * jnp.asarray(record.length),
    )
