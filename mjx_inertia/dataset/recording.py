"""A user's own recording of a push, or a file of the M-dataset, as one type.

In: a file of force, object pose and tip position, what object was pushed, and a short description
of frames and sensor. Out: `MeasuredPush`. The layout is that of `docs/own_pushes.md`.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.mcube import TIP_RADIUS, record_from_signals
from mjx_inertia.dataset.mcube_cleaning import sampling_times, without_steps
from mjx_inertia.dataset.mcube_file import (
    McubeFileError,
    McubeSignals,
    Signal,
    parse_name,
    read_bytes,
    read_signals,
)
from mjx_inertia.dataset.pushed_object import pushed_object, read_yaml
from mjx_inertia.dataset.recording_checks import check_signals, check_streams
from mjx_inertia.dataset.recording_file import STREAMS, RecordingError, read_columns
from mjx_inertia.objects import ObjectModel, turn_vectors
from mjx_inertia.pushing import PushRecord
from mjx_inertia.spatial import AnyArray

RATE = 250.0  # Hz, of records for identification; a slower recording keeps its own rate
_FEWEST = 20  # samples of a stream
_MOST_REPEATED = 0.2  # of the stamps of a stream


@dataclass(frozen=True)
class RecordingDescription:
    """What is constant of a recording: frames, sensor, tip, and the names of columns."""

    object: str | None = None  # see `pushed_object`
    com: tuple[float, float] | None = None  # of the object where it is known, m, outline's frame
    tip_radius: float = 0.005  # m
    force_on: str = "object"  # what the measured force acts on: `object`, or `tip` (its reaction)
    force_frame: str = "world"  # axes of the force: `world`, or `object` (turn with the object)
    force_yaw: float = 0.0  # degrees, by which the sensor's x axis is turned from that frame's
    force_delay: float = 0.0  # s by which the stamps of the force are late
    # of what moves between the force sensor and the object; 0 if the force is that of the contact
    probe_mass: float | None = None  # kg
    # pose of the outline's frame in the tracked frame, m and degrees
    object_offset: tuple[float, float] = (0.0, 0.0)
    object_yaw: float = 0.0
    columns: Mapping[str, str] = field(default_factory=dict)  # our names to those in the file
    units: Mapping[str, str] = field(default_factory=dict)  # by our names, if the header has none

    def __post_init__(self) -> None:
        """Refuses what cannot be meant."""
        if self.force_on not in ("object", "tip"):
            raise ValueError(f"force_on: expected `object` or `tip`, found {self.force_on!r}")
        if self.force_frame not in ("world", "object"):
            raise ValueError(f"force_frame: expected world or object, found {self.force_frame!r}")
        for name in ("tip_radius", "force_yaw", "force_delay", "object_yaw"):
            _check_number(name, getattr(self, name))
        if not self.tip_radius > 0:
            raise ValueError(f"tip_radius: expected m above 0, found {self.tip_radius}")
        if self.probe_mass is not None:
            _check_number("probe_mass", self.probe_mass)
            if self.probe_mass < 0:
                raise ValueError(f"probe_mass: expected kg, zero or more, found {self.probe_mass}")
        for name in ("object_offset", "com"):
            value = getattr(self, name)
            if value is not None and (not isinstance(value, list | tuple) or len(value) != 2):
                raise ValueError(f"{name}: expected two numbers in m, found {value!r}")
            for number in value or ():
                _check_number(name, number)
        for name in ("columns", "units"):
            value = getattr(self, name)
            words = isinstance(value, Mapping) and all(isinstance(v, str) for v in value.values())
            if not words:
                raise ValueError(f"{name}: expected names to names, found {value!r}")


def _check_number(name: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise ValueError(f"{name}: expected a number, found {value!r}")


def read_description(path: str | Path) -> RecordingDescription:
    """A description from a YAML file with the fields of `RecordingDescription` as keys.

    Raises:
      FileNotFoundError: there is no such file.
      RecordingError: what is wrong in it.
    """
    path = Path(path)
    content = read_yaml(path)
    known = [f.name for f in dataclasses.fields(RecordingDescription)]
    unknown = sorted(set(map(str, content)) - set(known))
    if unknown:
        raise RecordingError(path, f"unknown key {unknown[0]!r}; known are {', '.join(known)}")
    try:
        return RecordingDescription(**content)
    except (TypeError, ValueError) as error:
        raise RecordingError(path, str(error)) from None


@dataclass(frozen=True, eq=False)
class MeasuredPush:
    """One real push: its streams in SI units and world axes, and what is known of its object."""

    file: str
    signals: McubeSignals  # each stream with its own stamps
    obj: ObjectModel  # outline and height; its inertial parameters are not read
    com: Float[ndarray, "2"] | None  # where it is known, m, object frame
    tip_radius: float  # m
    probe_mass: float | None  # stated in the description, kg
    record: PushRecord  # at 250 Hz, or at the rate of the slower one of force and pose
    is_mcube: bool = False  # a file of the M-dataset

    def record_at(self, rate: float) -> PushRecord:
        """The push on common times, `rate` samples a second."""
        return record_from_signals(self.signals, self.file, self.obj, rate, self.tip_radius)


def read_push(
    path: str | Path,
    object: str | Path | ObjectModel | None = None,
    *,
    com: AnyArray | Sequence[float] | None = None,
    description: RecordingDescription | str | Path | None = None,
    **changes: Any,
) -> MeasuredPush:
    """One recorded push from a CSV, Parquet, npz or HDF5 file, or a file of the M-dataset.

    Beside `push.csv`, `push.yaml` or else `recording.yaml` in the same folder is its description.
    The name of a file of the M-dataset tells its object.

    Args:
      path: of the recording.
      object: see `pushed_object`; that of the description if None.
      com: x, y of the CoM where it is known, m, outline's frame. Otherwise it is estimated.
      description: of the recording, or the path of its YAML file.
      **changes: fields of the description that stand above those of the file.

    Raises:
      FileNotFoundError: a file that does not exist.
      RecordingError: what is wrong in which file, and what to do about it.
      ValueError: an object or an option that cannot be.
    """
    path = Path(path)
    said = _description(path, description, changes)
    mcube = _is_mcube(path)
    named = object if object is not None else said.object
    if named is None and mcube:
        named = parse_name(path).shape
    if named is None:
        text = "which object was pushed? Give `object`, or the key `object` in the description"
        raise RecordingError(path, text)
    obj, stated = pushed_object(named)
    known = next((x for x in (com, said.com, stated) if x is not None), None)
    if known is not None:
        known = np.asarray(known, float)
        if known.shape != (2,) or not np.isfinite(known).all():
            raise ValueError(f"com={known}: expected x and y in m")
    if mcube:
        try:
            signals = read_signals(read_bytes(path), str(path))
        except McubeFileError as error:
            raise RecordingError(path, error.reason) from None
        radius = said.tip_radius if "tip_radius" in changes else TIP_RADIUS
    else:
        signals = _own_signals(path, said)
        radius = said.tip_radius
        check_streams(signals, str(path))
        check_signals(signals, obj, radius, str(path))
    streams = (signals.force, signals.pose)
    rate = min(RATE, *(1.0 / float(np.median(np.diff(s.time))) for s in streams))
    rate = RATE if rate > 0.9 * RATE else rate
    try:
        record = record_from_signals(signals, str(path), obj, rate, radius)
    except McubeFileError as error:
        raise RecordingError(path, error.reason) from None
    return MeasuredPush(str(path), signals, obj, known, radius, said.probe_mass, record, mcube)


def _description(
    path: Path, given: RecordingDescription | str | Path | None, changes: Mapping[str, Any]
) -> RecordingDescription:
    if given is None:
        beside = [path.with_suffix(".yaml"), path.parent / "recording.yaml"]
        given = next((p for p in beside if p.is_file()), RecordingDescription())
    said = given if isinstance(given, RecordingDescription) else read_description(given)
    known = [f.name for f in dataclasses.fields(RecordingDescription)]
    for name in changes:
        if name not in known:
            raise ValueError(f"{name}: unknown option; known are {', '.join(known)}")
    return dataclasses.replace(said, **changes)


def _is_mcube(path: Path) -> bool:
    try:
        parse_name(path)
    except McubeFileError:
        return False
    return path.suffix.lower() in (".h5", ".json")


def _own_signals(path: Path, said: RecordingDescription) -> McubeSignals:
    columns = read_columns(path, said.columns, said.units)
    raw = {name: _stream(path, name, columns) for name in STREAMS}
    raw["force"] = (raw["force"][0] - said.force_delay, raw["force"][1])
    zero = max(stamps[0] for stamps, _ in raw.values())
    force, pose, tip = (_signal(path, k, *raw[k], zero) for k in ("force", "object", "tip"))
    # poses of the outline's frame
    yaw = np.unwrap(pose.value[:, 2])
    offset = turn_vectors(yaw, np.broadcast_to(said.object_offset, (len(yaw), 2)))
    xy = pose.value[:, :2] + offset
    value = np.column_stack([xy, yaw + np.radians(said.object_yaw)])
    # force on the object, world axes
    angle = np.full(len(force.time), np.radians(said.force_yaw))
    if said.force_frame == "object":
        angle = angle + np.interp(force.time, pose.time, value[:, 2])
    sign = 1.0 if said.force_on == "object" else -1.0
    return McubeSignals(
        pose=Signal(pose.time, without_steps(pose.time, value)),
        tip=tip,
        force=Signal(force.time, sign * turn_vectors(angle, force.value)),
    )


def _stream(path: Path, name: str, columns: Mapping[str, ndarray]) -> tuple[ndarray, ndarray]:
    """Stamps and values of a stream where all of its cells are filled."""
    stamps = columns.get(f"{name}_time", columns.get("time"))
    missing = [c for c in STREAMS[name] if c not in columns]
    if missing or stamps is None:
        what = missing[0] if missing else f"{name}_time (or time)"
        raise RecordingError(
            path,
            f"no column {what}; found {', '.join(sorted(columns)) or 'none that is known'}. "
            "Name it so, or say under `columns` which one it is",
        )
    values = [columns[c] for c in STREAMS[name]]
    lengths = {len(stamps), *map(len, values)}
    if len(lengths) > 1:
        text = f"{name}: stamps and values have different lengths {sorted(lengths)}"
        raise RecordingError(path, f"{text}; give {name}_time of the same length")
    table = np.column_stack([stamps, *values])
    filled = ~np.isnan(table).any(1)
    table = table[filled]
    if len(table) < _FEWEST:
        raise RecordingError(path, f"{name}: {len(table)} samples; {_FEWEST} or more are needed")
    if not np.isfinite(table).all():
        raise RecordingError(path, f"{name}: an infinite value; remove that sample")
    return table[:, 0], table[:, 1:]


def _signal(path: Path, name: str, stamps: ndarray, values: ndarray, zero: float) -> Signal:
    """Samples in the order of time, each on the time at which a steady clock took it."""
    unique, first = np.unique(stamps - zero, return_index=True)
    repeated = 1.0 - len(unique) / len(stamps)
    if repeated > _MOST_REPEATED:
        raise RecordingError(
            path,
            f"{name}: {repeated:.0%} of the time stamps repeat another one; "
            "write stamps with more digits, or in which each sample has its own",
        )
    span, step = unique[-1] - unique[0], float(np.median(np.diff(unique)))
    if span > 10.0 * step * len(unique):
        at = int(np.argmax(np.diff(unique)))
        raise RecordingError(
            path,
            f"{name}: the clock jumps by {np.diff(unique)[at]:.4g} s after {unique[at]:.3f} s; "
            "cut the recording there, or mend the stamps",
        )
    return Signal(sampling_times(unique).time, values[first])
