"""What a robot measures during one push, simulated or real, and what is known before it.

In: signals of a simulation or of a file; a plan. Out: `PushRecord`; `PushSetup` with the motion of
the tip, a pytree with a start and a velocity. No inertial parameter is in either. Length and status
of simulated pushes are judged from their signals alone.
"""

import enum
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.spatial import AnyArray

_LEAST_SAMPLES = 96  # of records that continue to few lengths
_SERIES = ("time", "force", "moment", "pose", "twist", "tip_position", "tip_velocity")
_LOST_AFTER = 0.1  # s without any force after which contact counts as lost
_STILL = 0.003  # m; an object that moved less did not move
_FAR = 5.0  # m; nothing on a table gets there
_EXCESSIVE_FORCE = 1e4  # N


class PushStatus(enum.IntEnum):
    """Why a push may not be used; `OK` pushes only are fitted and evaluated."""

    OK = 0
    LOST_CONTACT = 1  # the tip left the object before the push was over
    NEVER_MOVED = 2  # the object moved less than 3 mm
    DIVERGED = 3  # a signal is not finite or far outside the table; a push that cannot be
    FROZEN_FORCE = 4  # the force signal repeats one value
    TRACKING_JUMP = 5  # the tracked pose jumps faster than an object can move
    CLOCK_JUMP = 6  # the stamps of a signal leap or repeat: when it was measured is not known
    FORCE_PULLS = 7  # the force points from the object to the tip, which cannot pull
    FORCE_LATE = 8  # the force begins long after the object moves, or ends long after it rests


@struct.dataclass
class PushRecord:
    """One push (or, with a leading axis, many) as a robot measures it.

    Frames: world axes, z up; the object frame is the one that its tracker follows (its origin is
    *not* the CoM in general). Samples are at one fixed rate; beyond `length` they repeat the last
    valid one.
    """

    time: Float[AnyArray, "*n t"]  # s since the first sample, at the end of each sampling interval
    # contact force on the object, N, world axes, averaged over the sampling interval
    force: Float[AnyArray, "*n t 2"]
    moment: Float[AnyArray, "*n t"]  # moment of that force about the object-frame origin, N m
    # x, y (m) and yaw (rad, unwrapped) of the object frame in the world
    pose: Float[AnyArray, "*n t 3"]
    # velocity of the object-frame origin (m/s, world axes) and angular velocity (rad/s)
    twist: Float[AnyArray, "*n t 3"]
    tip_position: Float[AnyArray, "*n t 2"]  # centre of the pusher tip, m, world
    tip_velocity: Float[AnyArray, "*n t 2"]  # its velocity, m/s, world
    contact_point: Float[AnyArray, "*n 2"]  # first contact point, m, world
    contact_normal: Float[AnyArray, "*n 2"]  # inward unit normal of the object there, world axes
    length: Int[AnyArray, "*n"]  # number of valid samples
    status: Int[AnyArray, "*n"]  # a `PushStatus`


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


def with_few_lengths(records: PushRecord) -> PushRecord:
    """Records of n pushes, continued to 96, 384, 1,536, ... samples by repeating the last one.

    A function that is compiled for every number of samples is then compiled for few of them.
    """
    wanted = _LEAST_SAMPLES
    while wanted < records.time.shape[1]:
        wanted *= 4
    return with_samples(records, wanted)


@partial(jax.jit, static_argnames="count")
def with_samples(records: PushRecord, count: int) -> PushRecord:
    """Records of n pushes, continued to `count` samples by repeating the last one."""

    def continued(x: jax.Array) -> jax.Array:
        more = ((0, 0), (0, count - x.shape[1]), *((0, 0),) * (x.ndim - 2))
        return jnp.pad(x, more, mode="edge")

    return records.replace(**{name: continued(getattr(records, name)) for name in _SERIES})


@partial(jax.jit, static_argnames="count")
def first_samples(records: PushRecord, count: int) -> PushRecord:
    """The first samples of the records of n pushes; `length` is at most `count`."""
    return records.replace(**{name: getattr(records, name)[:, :count] for name in _SERIES})


def _valid(record: PushRecord) -> np.ndarray:
    return np.arange(record.time.shape[1]) < np.asarray(record.length)[:, None]


def _release(record: PushRecord, rate: float) -> np.ndarray:
    """Sample at which contact ends for good (the planned length where it does not), (n,)."""
    length = np.asarray(record.length)
    touching = (np.abs(np.asarray(record.force)).sum(-1) > 0) & _valid(record)
    t = touching.shape[1]
    last = t - 1 - np.argmax(touching[:, ::-1], axis=1)
    lost = touching.any(1) & (length - 1 - last > _LOST_AFTER * rate)
    return np.where(lost, last + 1, length)


def push_length(record: PushRecord, rate: float) -> Int[np.ndarray, " n"]:
    """Samples up to the end of the push or of the contact, whichever comes first."""
    return _release(record, rate).astype(np.int32)


def push_status(record: PushRecord, rate: float) -> Int[np.ndarray, " n"]:
    """Status of each simulated push; the gravest one where several apply."""
    valid = _valid(record)
    pose, force = np.asarray(record.pose), np.asarray(record.force)
    with np.errstate(invalid="ignore", over="ignore"):
        sane = np.isfinite(pose).all(-1) & np.isfinite(force).all(-1)
        sane &= (np.abs(pose[..., :2]) < _FAR).all(-1) & (np.abs(force) < _EXCESSIVE_FORCE).all(-1)
        squared = np.square(pose[..., :2] - pose[:, :1, :2]).sum(-1)
        moved = np.sqrt(np.where(valid, squared, 0.0).max(1))
    status = np.full(len(pose), int(PushStatus.OK), np.int32)
    status[_release(record, rate) < np.asarray(record.length)] = PushStatus.LOST_CONTACT
    status[moved < _STILL] = PushStatus.NEVER_MOVED
    status[~(sane | ~valid).all(1)] = PushStatus.DIVERGED
    return status
