"""What object was pushed, as a user says it: a name, a file, an outline, or `box:0.15x0.10`.

In: words or a path. Out: `ObjectModel` whose outline and height count; its mass is not read.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.recording_file import RecordingError
from mjx_inertia.files import parse_yaml
from mjx_inertia.objects import (
    ObjectModel,
    import_object,
    load_catalogue,
    load_mcube_objects,
    prism,
)

_MASS = 1.0  # kg, of outlines that state none; it is not read
_HEIGHT = 0.05  # m, of outlines that state none
_CORNERS = 180  # of a circle or an ellipse
_MESHES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf", ".dae", ".3mf")
_SHAPES = "box:0.15x0.10, circle:0.12 or ellipse:0.20x0.10 (edges or diameters in m)"
_KEYS = {"outline", "box", "ellipse", "circle", "height", "com", "name", "mass"}


def pushed_object(
    text: str | Path | ObjectModel,
) -> tuple[ObjectModel, Float[ndarray, "2"] | None]:
    """The object, and its CoM (m, object frame) where the source states one.

    Args:
      text: `box:0.15x0.10`, `circle:0.12`, `ellipse:0.20x0.10` (edges or diameters, m); a name of
        the catalogue or of the published objects of Yu et al. 2016; the path of a mesh, URDF or
        MJCF file; of a YAML file with `outline`, `box`, `ellipse` or `circle`, and optional
        `height`, `com`, `name`; or of a CSV file with x, y of the outline's corners in m.

    Raises:
      FileNotFoundError: a path of a file that does not exist.
      ValueError: what is wrong.
    """
    if isinstance(text, ObjectModel):
        return text, None
    words = str(text)
    kind, _, sizes = words.partition(":")
    if kind in ("box", "circle", "ellipse"):
        return _shaped(kind, _sizes(kind, sizes), words), None
    path = Path(words)
    if path.suffix.lower() in (".yaml", ".yml"):
        return _of_yaml(path)
    if path.suffix.lower() in (".csv", ".txt"):
        return prism(_corners(path), _HEIGHT, _MASS, name=path.stem), None
    if path.suffix.lower() in (*_MESHES, ".urdf", ".xml"):
        mesh = path.suffix.lower() in _MESHES
        return import_object(path, mass=_MASS if mesh else None), None
    return _named(words), None


def _named(words: str) -> ObjectModel:
    """An object of the published measurements or of the catalogue."""
    published = load_mcube_objects()
    if words in published:
        return published[words]
    catalogue = load_catalogue()
    if words in catalogue:
        return catalogue[words]
    raise ValueError(
        f"object {words!r}: expected {_SHAPES}, a file (mesh, URDF, MJCF, YAML, CSV), or a name; "
        f"names are {', '.join(sorted(published))} and those of `python -m mjx_inertia.objects`"
    )


def _sizes(kind: str, text: str) -> list[float]:
    wanted = 1 if kind == "circle" else 2
    try:
        sizes = [float(part) for part in text.lower().split("x")]
    except ValueError:
        sizes = []
    if kind == "box" and len(sizes) == 3:
        wanted = 3
    if len(sizes) != wanted or not all(0 < size < np.inf for size in sizes):
        raise ValueError(f"object {kind}:{text}: expected {_SHAPES}")
    return sizes


def _shaped(kind: str, sizes: list[float], name: str, height: float | None = None) -> ObjectModel:
    if kind == "box":
        x, y = 0.5 * sizes[0], 0.5 * sizes[1]
        height = sizes[2] if len(sizes) == 3 else height
        outline = np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
    else:
        angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
        radii = 0.5 * np.array(sizes if len(sizes) == 2 else sizes * 2)
        outline = radii * np.stack([np.cos(angle), np.sin(angle)], 1)
    return prism(outline, height or _HEIGHT, _MASS, name=name)


def _of_yaml(path: Path) -> tuple[ObjectModel, Float[ndarray, "2"] | None]:
    entry = read_yaml(path)
    unknown = sorted(set(entry) - _KEYS)
    if unknown:
        raise RecordingError(path, f"unknown key {unknown[0]!r}; known are {sorted(_KEYS)}")
    shapes = [key for key in ("outline", "box", "ellipse", "circle") if key in entry]
    if len(shapes) != 1:
        raise RecordingError(path, "give one of `outline`, `box`, `ellipse` and `circle`")
    height = float(_numbers(path, entry, "height", (), _HEIGHT))
    name = str(entry.get("name", path.stem))
    (kind,) = shapes
    if kind == "outline":
        obj = prism(_numbers(path, entry, "outline", (None, 2)), height, _MASS, name=name)
    else:
        sizes = np.atleast_1d(_numbers(path, entry, kind, () if kind == "circle" else (2,)))
        if not np.all(sizes > 0):
            raise RecordingError(path, f"{kind}: expected sizes above 0, found {entry[kind]}")
        obj = _shaped(kind, sizes.tolist(), name, height)
    com = _numbers(path, entry, "com", (2,)) if entry.get("com") is not None else None
    return obj, com


def read_yaml(path: Path) -> dict[str, Any]:
    """A mapping from a small YAML file without aliases, which could unfold to any size.

    Raises:
      FileNotFoundError: there is no such file.
      RecordingError: it is something else.
    """
    if not path.is_file():
        raise FileNotFoundError(f"no file {path}")
    try:
        content = parse_yaml(path.read_text(errors="replace"), path.name)
    except ValueError as error:
        raise RecordingError(path, f"expected YAML, found {' '.join(str(error).split())}") from None
    if not isinstance(content, dict):
        raise RecordingError(path, "expected a mapping of keys to values")
    return content


def _numbers(
    path: Path, entry: dict[str, Any], key: str, shape: tuple[int | None, ...], default: Any = None
) -> ndarray:
    value = entry.get(key, default)
    try:
        numbers = np.asarray(value, float)
    except (TypeError, ValueError):
        numbers = np.full(1, np.nan)
    fits = numbers.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, numbers.shape, strict=False)
    )
    if not fits or not np.isfinite(numbers).all():
        text = {0: "a number", 1: "two numbers", 2: "a list of [x, y]"}[len(shape)]
        raise RecordingError(path, f"{key}: expected {text} in m, found {value!r}")
    return numbers


def _corners(path: Path) -> Float[ndarray, "k 2"]:
    if not path.is_file():
        raise FileNotFoundError(f"no file {path}")
    lines = [line for line in path.read_text(errors="replace").splitlines() if line.strip()]
    rows = [line.replace(";", ",").split(",") for line in lines if not line.startswith("#")]
    if rows and not rows[0][0].strip().lstrip("-").replace(".", "").isdigit():
        rows = rows[1:]
    try:
        return np.array([[float(cell) for cell in row] for row in rows]).reshape(-1, 2)
    except ValueError:
        raise RecordingError(path, "expected two columns, x and y of the corners in m") from None
