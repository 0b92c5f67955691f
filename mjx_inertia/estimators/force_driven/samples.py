"""Measured pushes as the filter takes them.

In: `PushRecord`s at the settings' rate, and what is known of the object: outline, CoM, I_zz / m.
Out: `PushSamples`, padded to one length; which pushes can be used.
"""

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.estimators.force_driven.prediction_errors import PushSamples
from mjx_inertia.estimators.force_driven.settings import ForceDrivenSettings
from mjx_inertia.objects import (
    ObjectModel,
    closest_on_outline,
    friction_radius,
    in_object_frame,
)
from mjx_inertia.pushing import PushRecord, PushStatus

_GRAVITY = 9.81  # m/s²
_LEAST_PUSH = 0.1  # s of samples between rest and the end of the push
_LENGTHS = (128, 256, 512, 1024, 2048, 4096)  # samples; one program serves all pushes up to one
_TOUCHED = 0.5  # N
_FIRST = 3  # samples after the first one that tell whether the object is at rest
_AT_REST = 6.0  # deviations of the noise


@dataclass(frozen=True)
class BodyPrior:
    """What is known of a pushed object before the push."""

    outline: Float[ndarray, "k 2"]  # m, tracked frame, counter-clockwise
    com: Float[ndarray, "2"]  # m, tracked frame: known, or the centre of the prior
    squared_gyration: float  # I_zz / m about the CoM, m²
    friction_radius: float  # c of the limit surface about the CoM, m

    @classmethod
    def of(cls, obj: ObjectModel, com: Float[ndarray, "2"] | None = None) -> "BodyPrior":
        """Of an object of uniform density and pressure; `com` if it is known better."""
        plane = obj.footprint
        center = plane.centroid if com is None else np.asarray(com, float)
        gyration = float(np.trace(plane.second_moment)) / plane.area
        return cls(obj.outline, center, gyration, friction_radius(obj.support, center))


def push_samples(
    record: PushRecord, prior: BodyPrior, settings: ForceDrivenSettings
) -> PushSamples | None:
    """The samples of one push from rest to just before the tip slows down; None if too few."""
    length = int(record.length)
    time = np.asarray(record.time, np.float64)[:length]
    interval = (time[-1] - time[0]) / max(length - 1, 1)
    pose = np.asarray(record.pose, np.float64)[:length]
    tip = np.asarray(record.tip_position, np.float64)[:length]
    force = np.asarray(record.force, np.float64)[:length]
    end = _slows(np.asarray(record.tip_velocity, np.float64)[:length], interval, settings)
    if int(record.status) != PushStatus.OK or end * interval < _LEAST_PUSH:
        return None
    # contact in the middle of each interval, in the object's own frame
    tip_obj = in_object_frame(pose, tip)
    middle = 0.5 * (tip_obj + np.concatenate([tip_obj[:1], tip_obj[:-1]]))
    contact = closest_on_outline(prior.outline, middle)
    tangent = np.stack([-contact.normal[:, 1], contact.normal[:, 0]], 1)
    # rough friction force: the force while the tip pushes steadily
    size = np.hypot(*force[:end].T)
    pushing = size[size > max(_TOUCHED, 0.3 * np.quantile(size, 0.9))]
    if len(pushing) == 0:
        return None
    typical = float(np.median(pushing))
    twist, twist_deviation = _first_twist(pose, interval, settings)
    return PushSamples(
        pose=pose,
        twist=twist,
        twist_deviation=twist_deviation,
        force=force,
        contact=contact.point,
        tangent=tangent,
        used=(np.arange(length) <= end).astype(float),
        interval=np.asarray(interval),
        com=prior.com,
        squared_gyration=np.asarray(prior.squared_gyration),
        friction_radius=np.asarray(prior.friction_radius),
        log_mass=np.log(typical / (0.3 * _GRAVITY)),
        log_friction_force=np.log(typical),
        probe_mass=np.zeros(()),
        contact_noise=np.zeros(()),
        deviations=np.asarray(settings.deviations),
    )


def _first_twist(
    pose: Float[ndarray, "t 3"], interval: float, settings: ForceDrivenSettings
) -> tuple[Float[ndarray, "3"], Float[ndarray, "3"]]:
    """Twist at the first sample and its deviation: at rest, or the slope of the first samples."""
    noise = np.array([settings.position_noise] * 2 + [settings.yaw_noise])
    moved = np.abs(pose[_FIRST] - pose[0])
    if np.all(moved < _AT_REST * noise):
        return np.zeros(3), settings.creep * np.array([1.0, 1.0, 20.0])
    slope = np.gradient(pose[: _FIRST + 1], interval, axis=0)[0]
    return slope, np.abs(slope) + 10.0 * settings.creep * np.array([1.0, 1.0, 20.0])


def _slows(velocity: Float[ndarray, "t 2"], interval: float, settings: ForceDrivenSettings) -> int:
    """Last sample before the tip slows down."""
    speed = np.hypot(*velocity.T)
    steady = np.median(speed[speed > 0.5 * speed.max()])
    last = int(np.flatnonzero(speed > settings.tip_share * steady)[-1])
    return last - round(settings.stop_before / interval)


def stack_samples(samples: list[PushSamples]) -> PushSamples:
    """Pushes with a leading axis, padded with unused samples to one of few lengths."""
    longest = max(len(s.used) for s in samples)
    length = next((n for n in _LENGTHS if n >= longest), longest)

    def padded(x: ndarray) -> ndarray:
        missing = length - len(x)
        return np.pad(x, [(0, missing)] + [(0, 0)] * (x.ndim - 1), mode="edge")

    def one(s: PushSamples) -> PushSamples:
        series = {k: padded(getattr(s, k)) for k in ("pose", "force", "contact", "tangent")}
        used = np.pad(s.used, (0, length - len(s.used)))
        return s.replace(used=used, **series)

    return jax.tree.map(lambda *x: np.stack(x), *map(one, samples))
