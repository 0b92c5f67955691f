"""What an experimenter knows of a push before it: where things were and how the tip goes.

A motion of the tip is a pytree with a start and a velocity; the simulation asks one for its
velocity, averaged over a step, so the tip follows the path exactly. In: a plan or a measured
record. Out: a motion, `PushSetup`; no inertial parameter is in it.
"""

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.pushing.record import PushRecord
from mjx_inertia.spatial import AnyArray


@struct.dataclass
class StraightMotion:
    """A straight path at constant speed, after a ramp of constant acceleration."""

    start: Float[AnyArray, "*n 2"]  # centre of the tip at time 0, m, world
    direction: Float[AnyArray, "*n 2"]  # unit vector of the path
    speed: Float[AnyArray, "*n"]  # reached after the ramp, m/s
    ramp: Float[AnyArray, "*n"]  # duration of the acceleration from rest, s (0: full speed at once)
    duration: Float[AnyArray, "*n"]  # after which the tip stands still, s

    def velocity(self, time: Float[Array, ""], step: float) -> Float[Array, "2"]:
        """Mean velocity from `time` to `time + step`, m/s (the midpoint, exact on a ramp)."""
        middle = time + 0.5 * step
        share = jnp.where(self.ramp > 0, middle / jnp.where(self.ramp > 0, self.ramp, 1.0), 1.0)
        moving = middle < self.duration
        return jnp.asarray(self.direction) * (self.speed * jnp.minimum(share, 1.0) * moving)


@struct.dataclass
class SampledMotion:
    """A path through sampled positions, straight between them: one measured in a file, say."""

    start: Float[AnyArray, "*n 2"]  # centre of the tip at time 0, m, world
    offsets: Float[AnyArray, "*n k 2"]  # (knots, 2) positions minus `start`, m
    # time between knots, s; after the last one the tip stands still
    interval: Float[AnyArray, "*n"]
    duration: Float[AnyArray, "*n"]  # s

    def velocity(self, time: Float[Array, ""], step: float) -> Float[Array, "2"]:
        """Mean velocity from `time` to `time + step`, m/s."""
        knots = jnp.arange(self.offsets.shape[0])

        def at(t: Float[Array, ""]) -> Float[Array, "2"]:
            x = t / self.interval
            return jnp.stack([jnp.interp(x, knots, self.offsets[:, i]) for i in range(2)])

        return (at(time + step) - at(time)) / step


Motion = StraightMotion | SampledMotion


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
