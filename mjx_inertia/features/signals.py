"""The eight signals of a push (thesis Eq. 3.11), seen from its first contact.

In: one `PushRecord`. Out: `Signals` in the contact frame: fixed in the world at the first contact,
x along the inward contact normal, y to its left. So one push looks alike from any side, and a frame
of the world that someone chose leaves no trace.
"""

from dataclasses import dataclass
from typing import Literal

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.pushing import PushRecord, PushStatus
from mjx_inertia.spatial import planar_cross, planar_rotate

SIGNALS = {
    "tracked": ("f_x", "f_y", "m", "u_x", "u_y", "w", "u_px", "u_py"),
    "contact": ("f_x", "f_y", "m_c", "u_cx", "u_cy", "w", "u_px", "u_py"),
}
MIN_SAMPLES = 3  # one in each window


@dataclass(frozen=True)
class FeatureSettings:
    """What the motion of the object refers to, and where contact starts."""

    # the reference point: "tracked" is the tracker's origin, "contact" the material point that was
    # touched first. Velocity u is that of the point, moment m is about it. A tracker at the CoM
    # would give the CoM away; the contact does not tell where the tracker's frame is.
    reference: Literal["tracked", "contact"] = "contact"
    # contact starts at the first sample whose force and whose tip speed exceed this fraction of
    # their 95th percentile over the record
    contact_fraction: float = 0.05

    def __post_init__(self) -> None:
        """Raises ValueError for an unknown reference or a fraction outside [0, 1)."""
        if self.reference not in SIGNALS:
            raise ValueError(f"reference={self.reference!r} is not one of {sorted(SIGNALS)}")
        if not 0 <= self.contact_fraction < 1:
            raise ValueError(f"contact_fraction={self.contact_fraction} is not in [0, 1)")


@struct.dataclass
class Signals:
    """Signals of one push in the contact frame; zero outside contact."""

    # f_x, f_y (N), m (N m), u_x, u_y (m/s), w (rad/s), u_px, u_py (m/s)
    values: Float[Array, "t 8"]
    # x, y (m) and yaw (rad) of the reference point since the start of contact
    displacement: Float[Array, "t 3"]
    tip_path: Float[Array, ""]  # length of the tip's path since the start of contact, m
    valid: Bool[Array, " t"]  # samples from the start of contact to the end of the record
    # s since the start of contact, at the beginning of each sampling interval
    elapsed: Float[Array, " t"]
    interval: Float[Array, ""]  # sampling interval, s
    # whether the record is `OK` and has at least `MIN_SAMPLES` samples in contact
    usable: Bool[Array, ""]


def _percentile_95(values: Float[Array, " t"], inside: Bool[Array, " t"]) -> Float[Array, ""]:
    ordered = jnp.sort(jnp.where(inside, values, jnp.inf))
    rank = jnp.int32(0.95 * (jnp.sum(inside) - 1))
    return jnp.where(jnp.any(inside), ordered[jnp.maximum(rank, 0)], 0.0)


def _contact_start(
    record: PushRecord, fraction: float, inside: Bool[Array, " t"]
) -> Int[Array, ""]:
    """First sample of contact, 0 where there is none; `fraction` as in `FeatureSettings`."""
    force = jnp.linalg.norm(record.force, axis=-1)
    speed = jnp.linalg.norm(record.tip_velocity, axis=-1)
    touching = inside & (force > fraction * _percentile_95(force, inside))
    return jnp.argmax(touching & (speed > fraction * _percentile_95(speed, inside)))


def signals(record: PushRecord, settings: FeatureSettings) -> Signals:
    """Signals of one push; finite for any record that is finite in its valid samples."""
    # samples from the start of contact to the end of the record
    steps = jnp.arange(record.time.shape[0])
    inside = steps < record.length
    start = _contact_start(record, settings.contact_fraction, inside)
    valid = inside & (steps >= start)
    last = jnp.maximum(record.length - 1, 1)
    interval = jnp.maximum((record.time[last] - record.time[0]) / last, 1e-6)

    # the contact frame: x along the inward normal, y to its left
    normal = record.contact_normal
    normal = normal / jnp.maximum(jnp.linalg.norm(normal), 1e-6)
    R_contact_world = jnp.stack([normal, jnp.stack([-normal[1], normal[0]])])

    # motion of the reference point, and the moment about it
    position, yaw = record.pose[:, :2], record.pose[:, 2]
    velocity, w = record.twist[:, :2], record.twist[:, 2]
    moment = record.moment
    if settings.reference == "contact":
        # The object rests until it is touched, so its first pose is the one at first contact.
        arm_obj = planar_rotate(-yaw[0], record.contact_point - position[0])
        arm = planar_rotate(yaw, arm_obj)  # world axes
        position = position + arm
        velocity = velocity + w[:, None] * jnp.stack([-arm[:, 1], arm[:, 0]], axis=-1)
        moment = moment - planar_cross(arm, record.force)

    # in the axes of the contact frame, zero outside contact
    planar = [record.force, velocity, record.tip_velocity, position - position[start]]
    force, velocity, tip_velocity, moved = (part @ R_contact_world.T for part in planar)
    columns = [force, moment[:, None], velocity, w[:, None], tip_velocity]
    values = jnp.where(valid[:, None], jnp.concatenate(columns, axis=-1), 0.0)
    displacement = jnp.concatenate([moved, (yaw - yaw[start])[:, None]], axis=-1)
    return Signals(
        values=values,
        displacement=jnp.where(valid[:, None], displacement, 0.0),
        tip_path=interval * jnp.sum(jnp.linalg.norm(values[:, 6:8], axis=-1)),
        valid=valid,
        elapsed=(steps - start) * interval,
        interval=interval,
        usable=(record.status == PushStatus.OK) & (jnp.sum(valid) >= MIN_SAMPLES),
    )
