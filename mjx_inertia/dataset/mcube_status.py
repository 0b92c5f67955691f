"""What is wrong in the signals of a measured push, told from the signals alone.

In: signals, raw and resampled. Out: the first `PushStatus` that applies, worst first.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.mcube_file import McubeSignals, Signal
from mjx_inertia.pushing import PushStatus

FARTHEST = 10.0  # m from the origin of the world
STRONGEST = 1e3  # N
MOVED = 3e-3  # m: an object whose outline moves less was not pushed
FROZEN_TIME = 0.2  # s of one repeated force value, or half the push if that is shorter
JUMP = (0.01, 0.01, 0.2)  # m, m, rad: tracking noise between two stamps stays below
FASTEST = (2.0, 2.0, 15.0)  # m/s, m/s, rad/s: nothing on the table moves faster
OVERLAP = 5e-3  # m: the tip this deep inside the outline contradicts the tracked pose
LOST_GAP = 3e-3  # m: a gap that tracking and a bending probe do not explain
NO_FORCE = 0.1  # of the largest forces of the push: none is left
LOST_TIME = 0.05  # s before the tip slows down
LATE = 0.1  # s by which a force may follow the motion; it leads by 0.02 s or more in good pushes
LOADED = 0.3  # of the largest forces of the push: the tip presses


@dataclasses.dataclass(frozen=True)
class McubeSamples:
    """Signals of a push at common times: s, m, rad, m/s, N, and the gap from tip to outline, m."""

    time: Float[ndarray, " t"]
    pose: Float[ndarray, "t 3"]
    tip_velocity: Float[ndarray, "t 2"]
    force: Float[ndarray, "t 2"]
    gap: Float[ndarray, " t"]


def mcube_push_status(
    outline: Float[ndarray, "k 2"], signals: McubeSignals, samples: McubeSamples
) -> PushStatus:
    """Checks values, clocks, tracking, the force sensor, motion, contact, and force with motion.

    Args:
      outline: of the object, m, object frame.
      signals: as read; judged between the first and the last sample.
      samples: the push.
    """
    time = samples.time
    pose, tip, force = (_within(s, time) for s in (signals.pose, signals.tip, signals.force))
    checks = (
        (PushStatus.DIVERGED, lambda: _far(pose.value[:, :2], FARTHEST)),
        (PushStatus.DIVERGED, lambda: _far(tip.value, FARTHEST)),
        (PushStatus.DIVERGED, lambda: _far(force.value, STRONGEST)),
        (PushStatus.CLOCK_JUMP, lambda: signals.clock_jumps),
        (PushStatus.TRACKING_JUMP, lambda: _jumps(pose) or _jumps(tip)),
        (PushStatus.TRACKING_JUMP, lambda: samples.gap.min() < -OVERLAP),
        (PushStatus.FROZEN_FORCE, lambda: _is_frozen(force, 0.5 * (time[-1] - time[0]))),
        (PushStatus.NEVER_MOVED, lambda: _motion(outline, samples.pose).max() < MOVED),
        (PushStatus.LOST_CONTACT, lambda: _is_lost(samples)),
        (PushStatus.FORCE_PULLS, lambda: np.sum(samples.force * samples.tip_velocity) < 0.0),
        (PushStatus.FORCE_LATE, lambda: _is_late(outline, signals, samples)),
    )
    return next((status for status, fails in checks if fails()), PushStatus.OK)


def _far(values: Float[ndarray, "n d"], limit: float) -> bool:
    return bool(np.any(np.abs(values) > limit))


def _within(signal: Signal, time: Float[ndarray, " t"]) -> Signal:
    keep = (signal.time >= time[0]) & (signal.time <= time[-1])
    return Signal(signal.time[keep], signal.value[keep])


def _jumps(track: Signal) -> bool:
    """Whether two successive poses or points are further apart than a thing can move between."""
    axes = track.value.shape[1]
    limit = np.array(JUMP[:axes]) + np.diff(track.time)[:, None] * np.array(FASTEST[:axes])
    return bool(np.any(np.abs(np.diff(track.value, axis=0)) > limit))


def _is_frozen(force: Signal, half_push: float) -> bool:
    """Whether one value stands longer than any live sensor repeats itself."""
    if len(force.time) == 0:
        return True  # not one reading during the push
    changes = np.flatnonzero(np.any(np.diff(force.value, axis=0) != 0.0, axis=1)) + 1
    bounds = np.concatenate([[0], changes, [len(force.time)]])
    standing = force.time[bounds[1:] - 1] - force.time[bounds[:-1]]
    return bool(standing.max() >= min(FROZEN_TIME, half_push))


def _motion(outline: Float[ndarray, "k 2"], pose: Float[ndarray, "t 3"]) -> Float[ndarray, " t"]:
    """Largest way of a point of the outline from its first position, m."""
    angle = pose[:, 2, None]
    x = pose[:, 0, None] + np.cos(angle) * outline[:, 0] - np.sin(angle) * outline[:, 1]
    y = pose[:, 1, None] + np.sin(angle) * outline[:, 0] + np.cos(angle) * outline[:, 1]
    return np.hypot(x - x[0], y - y[0]).max(1)


def _is_lost(samples: McubeSamples) -> bool:
    """Whether the tip has left the object by the time it slows down.

    A tip that stops is left behind by a sliding object, and a fast one bounces: neither counts.
    """
    time, size = samples.time, np.hypot(*samples.force.T)
    speed = np.hypot(*samples.tip_velocity.T)
    slows = int(np.flatnonzero(speed >= 0.7 * speed.max())[-1])
    late = (time > time[slows] - LOST_TIME) & (time <= time[slows])
    unloaded = size[late].mean() < NO_FORCE * np.quantile(size, 0.9)
    return bool(unloaded or samples.gap[late].min() > LOST_GAP)


def _is_late(outline: Float[ndarray, "k 2"], signals: McubeSignals, samples: McubeSamples) -> bool:
    """Whether the object moves without a force before the force comes, or before its stream does.

    Friction holds an object until it is pushed, so a force that follows has a clock of its own.
    """
    time, size = samples.time, np.hypot(*samples.force.T)
    loaded = np.flatnonzero(size > LOADED * np.quantile(size, 0.9))[0]
    moves = np.flatnonzero(_motion(outline, samples.pose) > 0.5 * MOVED)[0]
    tip = signals.tip
    travel = np.hypot(*(tip.value - tip.value[0]).T)
    starts = tip.time[np.flatnonzero(travel > 0.5 * MOVED)[0]]
    return bool(time[loaded] - time[moves] > LATE or signals.force.time[0] - starts > LATE)
