"""What the name and the content of one measurement file say, cleaned but not yet synchronised.

In: the path of an HDF5 or JSON file with the keys `object_pose`, `tip_pose` and `ft_wrench`, each
(N, 4) with absolute time in s in the first column. Out: `McubePush` of its name; `McubeSignals`.
"""

import dataclasses
import io
import json
import math
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path, PurePath

import h5py
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.mcube_cleaning import sampling_times, without_steps

PUSH_LENGTH = 0.05  # m past contact, the same for all pushes

_NAME = re.compile(
    r"motion_surface=(?P<surface>.+?)_shape=(?P<shape>.+?)_a=(?P<a>[^_]+)_v=(?P<v>[^_]+)"
    r"_i=(?P<i>[^_]+)_s=(?P<s>[^_]+)_t=(?P<t>[^_]+?)(?:_rep=(?P<rep>\d+))?"
)
_PATTERN = "motion_surface=…_shape=…_a=…_v=…_i=…_s=…_t=…[_rep=…].h5 or .json"
_KEYS = ("object_pose", "tip_pose", "ft_wrench")
_COLUMNS = {
    "object_pose": "t, x, y, yaw",
    "tip_pose": "t, x, y, yaw",
    "ft_wrench": "t, fx, fy, tau_z",
}
_FEWEST_STAMPS = 10
_LARGEST = 1e12
_LONGEST_GAP = 0.25  # s between two stamps; 0.08 s is the longest in the published pushes
_MOST_REPEATED = 0.1  # of the stamps of a stream; none repeats in the published pushes
_LARGEST_TABLE = 1 << 26  # bytes; of the published pushes none takes more than 25 kB
_LARGEST_FILE = 1 << 28  # bytes of a member of an archive, unpacked


class McubeFileError(ValueError):
    """A file that is not a push. Arguments: file, key, what was expected, what was found."""

    @property
    def file(self) -> str:
        """Path of the file, or the path through the archive that holds it."""
        return str(self.args[0])

    @property
    def reason(self) -> str:
        """The message without the file."""
        _, key, expected, found = self.args
        return f"{key}: expected {expected}, found {found}"

    def __str__(self) -> str:
        """File, key, expected and found in one line."""
        return f"{self.file}: {self.reason}"


@dataclasses.dataclass(frozen=True)
class McubePush:
    """One push as its file name describes it."""

    surface: str  # name of the table's surface
    shape: str  # name of the object
    acceleration: float  # of the tip, m/s²; 0 for a push at constant speed
    speed: float  # of the tip, m/s; NaN for an accelerated push
    side: int  # index of the pushed side of the outline, from 0
    fraction: float  # along that side, or along the whole curve of a smooth object
    angle: float  # of the tip's path from the inward normal, rad
    repetition: int | None  # number of the repetition, if there were several

    @property
    def nominal_speed(self) -> float:
        """The tip's constant speed, or the one an accelerated push ends with, m/s."""
        if math.isnan(self.speed):
            return math.sqrt(2.0 * self.acceleration * PUSH_LENGTH)
        return self.speed


def parse_name(path: str | PurePath) -> McubePush:
    """Reads the name of a file; the folders above it do not matter.

    Raises:
      McubeFileError: the name does not follow the pattern, or holds a value that is no number.
    """
    name = PurePath(path).name
    found = _NAME.fullmatch(re.sub(r"\.(h5|json)$", "", name, flags=re.IGNORECASE))
    if found is None:
        raise McubeFileError(str(path), "name", _PATTERN, name)
    number: dict[str, float] = {}
    for key in "avist":
        try:
            number[key] = float(found[key])
        except ValueError:
            number[key] = math.nan
        if not math.isfinite(number[key]):
            raise McubeFileError(str(path), f"name, {key}=", "a finite number", found[key])
    if number["a"] < 0.0 or (number["a"] == 0.0 and number["v"] <= 0.0):
        raise McubeFileError(
            str(path), "name", "v > 0, or a > 0 with v=-1", f"a={found['a']}, v={found['v']}"
        )
    return McubePush(
        surface=found["surface"],
        shape=found["shape"],
        acceleration=1e-3 * number["a"],
        speed=math.nan if number["a"] > 0.0 else 1e-3 * number["v"],
        side=round(number["i"]),
        fraction=number["s"],
        angle=number["t"],
        repetition=None if found["rep"] is None else int(found["rep"]),
    )


@dataclasses.dataclass(frozen=True)
class Signal:
    """One stream: time in s from the file's common zero, strictly increasing, and its values."""

    time: Float[ndarray, " n"]
    value: Float[ndarray, "n d"]


@dataclasses.dataclass(frozen=True)
class McubeSignals:
    """The streams of one push, each with its own time stamps."""

    pose: Signal  # x, y (m) and yaw (rad, unwrapped) of the object
    tip: Signal  # x, y of the tip's centre, m
    force: Signal  # on the object, N: minus the reaction on the pusher that the file holds
    clock_jumps: bool = False  # whether the stamps of a stream leap, or many of them are equal


def read_bytes(path: str | Path) -> bytes:
    """Content of a file, or of a member of a zip archive: `folder/archive.zip/member.h5`.

    Raises:
      FileNotFoundError: there is neither.
      McubeFileError: the archive cannot be read.
    """
    path = Path(path)
    if path.is_file():
        return path.read_bytes()
    for archive in path.parents:
        if archive.suffix.lower() == ".zip" and archive.is_file():
            member = path.relative_to(archive).as_posix()
            try:
                with zipfile.ZipFile(archive) as opened:
                    return read_member(opened, member)
            except KeyError:
                raise FileNotFoundError(f"{archive} has no member {member}") from None
            except Exception as error:  # zipfile raises nearly any type for a damaged archive
                raise McubeFileError(str(path), "archive", "a zip archive", str(error)) from None
    raise FileNotFoundError(f"no measurement file {path}")


def read_member(archive: zipfile.ZipFile, member: str) -> bytes:
    """Content of a member; raises ValueError for one that unpacks to more than 256 MiB."""
    size = archive.getinfo(member).file_size
    if size > _LARGEST_FILE:
        raise ValueError(f"{member} unpacks to {size} bytes, more than {_LARGEST_FILE}")
    return archive.read(member)


def read_signals(content: bytes, file: str) -> McubeSignals:
    """Parses the content of `file`; the name's ending tells HDF5 from JSON.

    Stamps of arrival are sorted, repeated ones dropped (the first stays) and made the times of the
    samples (`sampling_times`); yaw is unwrapped and small steps of a pose that comes at a steady
    rate are taken out. Absolute time is removed in float64: it counts seconds since 1970.

    Raises:
      McubeFileError: not such a file, or a key missing, misshapen, too short or not finite.
    """
    tables = _json_tables if file.lower().endswith(".json") else _hdf5_tables
    checked = {key: _checked(table, key, file) for key, table in tables(content, file).items()}
    cleaned = {key: _cleaned(table) for key, table in checked.items()}
    zero = max(stream.time[0] for stream, _ in cleaned.values())
    pose, tip, wrench = (
        Signal(cleaned[key][0].time - zero, cleaned[key][0].value) for key in _KEYS
    )
    value = np.column_stack([pose.value[:, :2], np.unwrap(pose.value[:, 2])])
    if cleaned["object_pose"][1]:
        value = without_steps(pose.time, value)
    return McubeSignals(
        pose=Signal(pose.time, value),
        tip=Signal(tip.time, tip.value[:, :2]),
        # tau_z is about the sensor, not the object: the moment comes from the contact point.
        force=Signal(wrench.time, -wrench.value[:, :2]),
        clock_jumps=any(_clock_jumps(table[:, 0]) for table in checked.values()),
    )


def _hdf5_tables(content: bytes, file: str) -> dict[str, object]:
    if not content:
        raise McubeFileError(file, "file", "HDF5", "an empty file")
    try:
        with h5py.File(io.BytesIO(content), "r") as opened:
            keys = sorted(opened)
            tables = {key: _hdf5_table(opened, key, file) for key in _KEYS if key in keys}
    except McubeFileError:
        raise
    except Exception as error:  # the library raises nearly any type for a damaged file
        raise McubeFileError(file, "file", "readable HDF5", str(error)) from None
    return _all_keys(tables, keys, file)


def _hdf5_table(opened: h5py.File, key: str, file: str) -> ndarray:
    """A table of this file; nothing is allocated for one that is elsewhere or too large."""
    expected = f"a table of numbers in this file, up to {_LARGEST_TABLE} bytes"
    if not isinstance(opened.get(key, getlink=True), h5py.HardLink):
        raise McubeFileError(file, key, expected, "a link")
    table = opened[key]
    if not isinstance(table, h5py.Dataset):
        raise McubeFileError(file, key, expected, type(table).__name__)
    if table.external or table.is_virtual:
        raise McubeFileError(file, key, expected, "a table that lies in another file")
    size = math.prod(table.shape or ()) * table.dtype.itemsize
    if table.dtype.kind not in "fiu" or size > _LARGEST_TABLE:
        raise McubeFileError(file, key, expected, f"{table.dtype} of shape {table.shape}")
    return np.asarray(table)


def _json_tables(content: bytes, file: str) -> dict[str, object]:
    try:
        tables = json.loads(content)
    except (ValueError, RecursionError, MemoryError) as error:  # of JSON or of its encoding
        found = str(error) if content else "an empty file"
        raise McubeFileError(file, "file", "JSON", found) from None
    if not isinstance(tables, dict):
        raise McubeFileError(file, "file", "a JSON object", type(tables).__name__)
    return _all_keys(tables, sorted(tables), file)


def _all_keys(tables: Mapping[str, object], found: list[str], file: str) -> dict[str, object]:
    for key in _KEYS:
        if key not in tables:
            raise McubeFileError(file, key, "a table of that name", f"only {found}")
    return {key: tables[key] for key in _KEYS}


def _checked(table: object, key: str, file: str) -> Float[ndarray, "n 4"]:
    expected = f"numbers of shape (N, 4): {_COLUMNS[key]}"
    try:
        numbers = np.array(table, dtype=np.float64)
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise McubeFileError(file, key, expected, "something else than numbers") from None
    if numbers.ndim != 2 or numbers.shape[1] != 4:
        raise McubeFileError(file, key, expected, f"shape {numbers.shape}")
    stamps = len(np.unique(numbers[:, 0]))
    if stamps < _FEWEST_STAMPS:
        raise McubeFileError(file, key, f"{_FEWEST_STAMPS} time stamps or more", f"{stamps}")
    # NaN fails the comparison. Absolute time is 1.5e9 s; a larger number is a damaged one.
    bad = np.argwhere(~(np.abs(numbers) < _LARGEST))
    if len(bad):
        row, column = bad[0]
        found = (
            f"{len(bad)} that are not, first {numbers[row, column]} in row {row} column {column}"
        )
        raise McubeFileError(file, key, f"finite numbers below {_LARGEST:g}", found)
    return numbers


def _clock_jumps(stamps: Float[ndarray, " n"]) -> bool:
    """Whether stamps leap or repeat so that the samples' times cannot be told from them."""
    distinct = np.unique(stamps)
    repeated = 1.0 - len(distinct) / len(stamps)
    return bool(np.diff(distinct).max() > _LONGEST_GAP or repeated > _MOST_REPEATED)


def _cleaned(table: Float[ndarray, "n 4"]) -> tuple[Signal, bool]:
    """One stream on the times of its samples, and whether its clock is steady."""
    stamps, first = np.unique(table[:, 0], return_index=True)  # sorted; of equals the first
    clock = sampling_times(stamps)
    return Signal(clock.time, table[first, 1:]), clock.steady
