"""What a robot measures during one push: one type for simulated and real pushes.

In: signals of a simulation or of a file. Out: `PushRecord`, without any truth in it.
"""

import enum
from functools import partial

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Float, Int

from mjx_inertia.spatial import AnyArray


class PushStatus(enum.IntEnum):
    """Why a push may not be used; `OK` pushes only are fitted and evaluated."""

    OK = 0
    LOST_CONTACT = 1  # the tip left the object before the push was over
    NEVER_MOVED = 2  # the object moved less than 3 mm
    DIVERGED = 3  # a signal is not finite or far outside the table
    FROZEN_FORCE = 4  # the force signal repeats one value
    TRACKING_JUMP = 5  # the tracked pose jumps faster than an object can move


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


_LEAST_SAMPLES = 96
_SERIES = ("time", "force", "moment", "pose", "twist", "tip_position", "tip_velocity")


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
