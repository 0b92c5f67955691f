"""Mistakes that are made in a laboratory, told from the signals, with what to do about each.

In: the streams of a push as they were read, and the outline. Out: nothing, or `RecordingError` that
names the mistake. Geometry and direction are judged while the tip pushes: then it touches the
outline, and the force on the object points into it.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.mcube_file import McubeSignals, Signal
from mjx_inertia.dataset.recording_file import RecordingError
from mjx_inertia.objects import ObjectModel, closest_on_outline, in_object_frame, turn_vectors

_RATE = 100.0  # Hz, at which a push is judged
_LEAST_FORCE = 0.3  # N
_MOST_FORCE = 500.0  # N
_TABLE = 5.0  # m; no push goes that far
_TOUCHES = 4e-3  # m between tip and outline: frames of robot and tracker may differ by 1 mm
_LARGE = 0.04  # the same as a share of the object's diameter
_INTO = 0.3  # least cosine between force and inward normal; the friction cone of tan 70 degrees
_GAP = 0.1  # s without a sample
_LATE = 0.1  # s by which motion may come before force
_MOVED = 1e-3  # m: the object moves


def check_streams(signals: McubeSignals, file: str) -> None:
    """Clocks that overlap, streams without gaps.

    Raises:
      RecordingError: what is wrong.
    """
    streams = {"force": signals.force, "object": signals.pose, "tip": signals.tip}
    begin = max(s.time[0] for s in streams.values())
    end = min(s.time[-1] for s in streams.values())
    if end <= begin:
        spans = ", ".join(f"{k} {s.time[0]:.3f} to {s.time[-1]:.3f} s" for k, s in streams.items())
        raise RecordingError(
            file,
            f"the streams do not overlap in time ({spans}); "
            "stamp all of them by one clock, in one unit",
        )
    for name, stream in streams.items():
        inside = stream.time[(stream.time >= begin) & (stream.time <= end)]
        steps = np.diff(inside)
        if len(steps) and steps.max() > max(_GAP, 5.0 * np.median(steps)):
            at = inside[int(steps.argmax())]
            raise RecordingError(
                file,
                f"{name} has no sample for {steps.max():.2f} s from {at:.2f} s on; "
                "cut the recording there, or record again",
            )


def check_signals(signals: McubeSignals, obj: ObjectModel, tip_radius: float, file: str) -> None:
    """Units, frames, axes, signs, and the time of the force against that of the motion.

    Raises:
      RecordingError: what is wrong, and which change would mend it where one does.
    """
    begin = max(s.time[0] for s in (signals.force, signals.pose, signals.tip))
    end = min(s.time[-1] for s in (signals.force, signals.pose, signals.tip))
    time = np.arange(begin, end, 1.0 / _RATE)
    pose, tip, force = (_at(s, time) for s in (signals.pose, signals.tip, signals.force))
    size = np.hypot(*force.T)
    _check_sizes(pose, tip, size, file)
    pushing = size > max(_LEAST_FORCE, 0.3 * np.quantile(size, 0.95))
    pose, tip, force = pose[pushing], tip[pushing], force[pushing]
    _check_geometry(pose, tip, obj, tip_radius, file)
    _check_direction(pose, tip, force, obj, file)
    _check_timing(time, _at(signals.pose, time), size, obj, file)


def _at(signal: Signal, time: Float[ndarray, " t"]) -> Float[ndarray, "t d"]:
    return np.stack([np.interp(time, signal.time, column) for column in signal.value.T], 1)


def _check_sizes(pose: ndarray, tip: ndarray, size: ndarray, file: str) -> None:
    for name, path in (("object_x, object_y", pose[:, :2]), ("tip_x, tip_y", tip)):
        moved = float(np.ptp(path, axis=0).max())
        if moved > _TABLE:
            raise RecordingError(
                file,
                f"{name} move over {moved:.3g} m; if they are in millimetres, "
                "write [mm] behind their names in the header",
            )
    strongest = float(np.quantile(size, 0.95))
    if strongest < _LEAST_FORCE:
        raise RecordingError(
            file,
            f"the force stays below {_LEAST_FORCE} N (95 % of it below {strongest:.2g} N): "
            "no push is in it, or its unit is not N; write the unit behind force_x, force_y",
        )
    if strongest > _MOST_FORCE:
        raise RecordingError(
            file,
            f"the force reaches {strongest:.3g} N; if it is in mN, write [mN] behind force_x and "
            "force_y, and if the sensor has an offset, remove it",
        )


def _check_geometry(
    pose: ndarray, tip: ndarray, obj: ObjectModel, tip_radius: float, file: str
) -> None:
    allowed = max(_TOUCHES, _LARGE * obj.mean_diameter)

    def gap(pose: ndarray, tip: ndarray) -> float:
        here = closest_on_outline(obj.outline, in_object_frame(pose, tip)).distance
        return float(np.median(np.abs(here - tip_radius)))

    found = gap(pose, tip)
    if found <= allowed:
        return
    better = [(gap(p, t), words) for p, t, words in _other_geometries(pose, tip)]
    best, words = min(better)
    text = f"while the tip pushes it is {1e3 * found:.0f} mm away from the outline"
    if best <= allowed:
        raise RecordingError(file, f"{text}, but only {1e3 * best:.1f} mm {words}")
    raise RecordingError(
        file,
        f"{text}; check that object and tip are in one frame and one unit, that the tracked frame "
        "is that of the outline (`object_offset`, `object_yaw` in the description), and its size",
    )


def _other_geometries(pose: ndarray, tip: ndarray) -> Iterator[tuple[ndarray, ndarray, str]]:
    xy, yaw = pose[:, :2], pose[:, 2:]

    def of(xy: ndarray, yaw: ndarray) -> ndarray:
        return np.concatenate([xy, yaw], 1)

    yield of(xy, np.radians(yaw)), tip, "if the yaw is in degrees: write object_yaw [deg]"
    yield of(xy, -yaw), tip, "if the yaw counts clockwise: change its sign"
    yield pose, tip[:, ::-1], "if tip_x and tip_y are exchanged"
    yield of(xy[:, ::-1], yaw), tip, "if object_x and object_y are exchanged"
    yield of(1e-3 * xy, yaw), tip, "if object_x, object_y are in millimetres: write [mm]"
    yield pose, 1e-3 * tip, "if tip_x, tip_y are in millimetres: write [mm]"
    yield of(1e-3 * xy, yaw), 1e-3 * tip, "if all positions are in millimetres: write [mm]"
    for quarter in (1, 2, 3):
        turned = of(xy, yaw + 0.5 * np.pi * quarter)
        text = f"if the outline is turned: write `object_yaw: {90 * quarter}` in the description"
        yield turned, tip, f"{text} (degrees)"


def _check_direction(
    pose: ndarray, tip: ndarray, force: ndarray, obj: ObjectModel, file: str
) -> None:
    normal_obj = closest_on_outline(obj.outline, in_object_frame(pose, tip)).normal
    normal = turn_vectors(pose[:, 2], normal_obj)
    unit = force / np.hypot(*force.T)[:, None]

    def cosine(direction: ndarray) -> float:
        return float(np.median(np.sum(direction * normal, 1)))

    found = cosine(unit)
    if found >= _INTO:
        return
    with_object = cosine(turn_vectors(pose[:, 2], unit))
    others = [
        (cosine(-unit), "on the tip instead of the object: write `force_on: tip`"),
        (with_object, "in the object's axes: write `force_frame: object`"),
        (cosine(unit[:, ::-1]), "with force_x and force_y exchanged"),
    ]
    for angle in (90, -90):
        turned = turn_vectors(np.full(len(unit), np.radians(angle)), unit)
        others.append((cosine(turned), f"in axes turned by 90°: write `force_yaw: {angle}`"))
    best, words = max(others)
    text = f"the force does not point into the object (median cosine to its normal {found:.2f})"
    if best > 0.5:
        text += f"; it would ({best:.2f}) if it were measured {words}"
    raise RecordingError(file, f"{text}. See the description's keys force_on, force_frame")


def _check_timing(time: ndarray, pose: ndarray, size: ndarray, obj: ObjectModel, file: str) -> None:
    away = np.hypot(*(pose[:, :2] - pose[0, :2]).T)
    away = away + 0.5 * obj.mean_diameter * np.abs(pose[:, 2] - pose[0, 2])
    moves, pushes = np.flatnonzero(away > _MOVED), np.flatnonzero(size > _LEAST_FORCE)
    if len(moves) and len(pushes):
        late = float(time[pushes[0]] - time[moves[0]])
        if late > _LATE:
            raise RecordingError(
                file,
                f"the object moves {late:.2f} s before any force acts on it; if the force's stamps "
                f"are late, write `force_delay: {late:.2f}` in the description",
            )
