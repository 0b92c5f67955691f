"""Columns of a user's recording, from CSV, Parquet, npz or HDF5.

In: a path. Out: columns by the names of `COLUMNS`, in SI units. A header states the unit behind
the name: `force_x [N]`, `object_yaw (deg)`. Streams may have stamps of their own (`force_time`), in
one table with blank cells, or as arrays of different lengths.
"""

import csv
import re
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
from jaxtyping import Float
from numpy import ndarray

STREAMS = {
    "force": ("force_x", "force_y"),
    "object": ("object_x", "object_y", "object_yaw"),
    "tip": ("tip_x", "tip_y"),
}
STAMPS = ("time", *(f"{stream}_time" for stream in STREAMS))
COLUMNS = (*STAMPS, *(name for names in STREAMS.values() for name in names))
# other names in use
_ALIASES = {
    **dict.fromkeys(("t", "stamp", "timestamp", "time_stamp"), "time"),
    **dict.fromkeys(("fx", "f_x", "ft_x"), "force_x"),
    **dict.fromkeys(("fy", "f_y", "ft_y"), "force_y"),
    **dict.fromkeys(("obj_x", "pose_x"), "object_x"),
    **dict.fromkeys(("obj_y", "pose_y"), "object_y"),
    **dict.fromkeys(("obj_yaw", "obj_theta", "object_theta", "pose_yaw", "yaw"), "object_yaw"),
    **dict.fromkeys(("pusher_x", "tool_x", "ee_x"), "tip_x"),
    **dict.fromkeys(("pusher_y", "tool_y", "ee_y"), "tip_y"),
}
_UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "angle": {"rad": 1.0, "deg": np.pi / 180.0, "°": np.pi / 180.0},
    "force": {"n": 1.0, "mn": 1e-3, "kn": 1e3},
}
_HEADER = re.compile(r"^(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\])]*?)\s*[\])]$")
_MOST_VALUES = 50_000_000  # of one file
_DAMAGED = (zipfile.BadZipFile, zlib.error, OSError, RuntimeError, KeyError, ValueError, EOFError)


class RecordingError(ValueError):
    """A recording that cannot be used: the file, what is wrong, and what to do."""

    def __init__(self, file: str | Path, reason: str) -> None:
        """Keeps both."""
        super().__init__(f"{file}: {reason}")
        self.file, self.reason = str(file), reason


def read_columns(
    path: str | Path,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> dict[str, Float[ndarray, " n"]]:
    """Columns by the names of `COLUMNS`, in SI units; blank cells are left out with their stamps.

    Args:
      path: of a .csv, .tsv, .txt, .parquet, .npz, .h5 or .hdf5 file.
      columns: the file's names of columns whose names are not those of `COLUMNS`.
      units: by column, where the header states none; SI if neither does.

    Raises:
      FileNotFoundError: there is no such file.
      RecordingError: what is wrong in it.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"no recording {path}")
    found: dict[str, ndarray] = {}
    named = {ours: name for name, ours in _inverted(path, columns or {}).items()}
    for header, values in _raw(path).items():
        match = _HEADER.match(header.strip())
        name, stated = (match["name"], match["unit"]) if match else (header.strip(), None)
        ours = next((o for o, given in named.items() if given in (header, name)), None)
        lower = name.lower()
        ours = ours or (lower if lower in COLUMNS else _ALIASES.get(lower))
        if ours is None:
            continue
        if ours in found:
            raise RecordingError(path, f"two columns are {ours}; name one in `columns`")
        unit = stated if stated is not None else (units or {}).get(ours)
        found[ours] = np.asarray(values, float) * _factor(path, ours, unit)
    return found


def _inverted(path: Path, columns: Mapping[str, str]) -> dict[str, str]:
    """From the file's names to ours; `columns` maps ours to the file's."""
    unknown = sorted(set(columns) - set(COLUMNS))
    if unknown:
        raise RecordingError(path, f"columns: {unknown[0]!r} is none of {', '.join(COLUMNS)}")
    return {given: ours for ours, given in columns.items()}


def _factor(path: Path, column: str, unit: str | None) -> float:
    kind = "time" if column.endswith("time") else "force" if "force" in column else "length"
    known = _UNITS["angle" if column.endswith("yaw") else kind]
    if unit is None:
        return 1.0
    if unit.lower() not in known:
        expected = ", ".join(known)
        raise RecordingError(path, f"{column}: unit [{unit}] is unknown; write one of {expected}")
    return known[unit.lower()]


def _raw(path: Path) -> dict[str, ndarray]:
    """One-dimensional arrays of numbers by the file's names."""
    ending = path.suffix.lower()
    readers = {".csv": _csv, ".tsv": _csv, ".txt": _csv, ".npz": _npz, ".parquet": _parquet}
    readers |= {".h5": _hdf5, ".hdf5": _hdf5}
    if ending not in readers:
        raise RecordingError(path, f"expected one of {', '.join(readers)}, found {ending!r}")
    return readers[ending](path)


def _csv(path: Path) -> dict[str, ndarray]:
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise RecordingError(path, "expected a header and rows of numbers, found none")
    mark = max(";\t,", key=lines[0].count)
    header, *rows = csv.reader(lines, delimiter=mark)
    if len(header) * len(rows) > _MOST_VALUES:
        raise RecordingError(path, f"more than {_MOST_VALUES:g} values; cut it to the push")
    values = np.full((len(rows), len(header)), np.nan)
    for i, row in enumerate(rows):
        if len(row) != len(header):
            expected = f"{len(header)} cells as in the header"
            raise RecordingError(path, f"row {i + 1}: expected {expected}, found {len(row)}")
        for j, cell in enumerate(row):
            try:
                # a decimal comma can stand in a table whose cells are parted by something else
                number = cell if mark == "," else cell.replace(",", ".")
                values[i, j] = float(number) if cell.strip() else np.nan
            except ValueError:
                if header[j].strip():
                    text = f"row {i + 1}, column {header[j]!r}: {cell!r} is no number"
                    raise RecordingError(path, text) from None
    return dict(zip(header, values.T, strict=True))


def _npz(path: Path) -> dict[str, ndarray]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: _column(path, name, archive[name]) for name in archive.files}
    except RecordingError:
        raise
    except _DAMAGED as error:
        raise RecordingError(path, f"expected a readable .npz file, found {error}") from None


def _hdf5(path: Path) -> dict[str, ndarray]:
    found: dict[str, ndarray] = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if not isinstance(item, h5py.Dataset) or item.ndim != 1:
            return
        if item.external:
            raise RecordingError(path, f"{name} is stored in another file; copy it into this one")
        if int(item.shape[0]) > _MOST_VALUES:
            raise RecordingError(path, f"{name} has {item.shape[0]} values; cut it to the push")
        unit = item.attrs.get("units", item.attrs.get("unit"))
        label = name.replace("/", "_")
        label = label if unit is None else f"{label} [{unit}]"
        found[label] = _column(path, name, item[()])

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except RecordingError:
        raise
    except Exception as error:  # the library raises nearly any type for a damaged file
        raise RecordingError(path, f"expected a readable HDF5 file, found {error}") from None
    return found


def _parquet(path: Path) -> dict[str, ndarray]:
    try:
        from pyarrow import ArrowException, parquet  # noqa: PLC0415  (an extra)
    except ImportError:
        text = "Parquet needs pyarrow: pip install 'mjx_inertia[parquet]'"
        raise RecordingError(path, text) from None
    try:
        table = parquet.read_table(path)
    except (ArrowException, OSError) as error:
        raise RecordingError(path, f"expected a readable Parquet file, found {error}") from None
    columns = {name: table[name].to_numpy() for name in table.column_names}
    return {name: _column(path, name, values) for name, values in columns.items()}


def _column(path: Path, name: str, values: object) -> ndarray:
    try:
        numbers = np.asarray(values, float)
    except (TypeError, ValueError):
        raise RecordingError(path, f"{name}: expected numbers, found something else") from None
    if numbers.ndim != 1:
        found = f"an array of shape {numbers.shape}"
        raise RecordingError(path, f"{name}: expected one column of numbers, found {found}")
    return numbers
