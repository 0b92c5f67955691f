"""Tables of real objects: those published by Yu et al. 2016, or a user's own.

In: a YAML table. Out: one `ObjectModel` per name. Format: a mapping `objects` from names to
`mass` (kg), `inertia_zz` (kg m², about the CoM), optional `com` (m, object frame; the centroid
if absent), optional `height` (m; else the table's `height`), and either `outline` (vertices in
order, m) or `ellipse` (semi-axes along x and y, m).
"""

from importlib import resources
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.files import parse_yaml
from mjx_inertia.objects.model import ObjectModel, prism

_ELLIPSE_VERTICES = 180  # the outline stays within 0.02 % of the semi-axis of the curve
_KEYS = {"mass", "inertia_zz", "com", "height", "outline", "ellipse"}


def load_mcube_objects(path: str | Path | None = None) -> dict[str, ObjectModel]:
    """Reads a YAML table of objects; without a path, the published objects of Yu et al. 2016.

    Raises:
      ValueError: what is wrong in which entry of which object of which file.
      FileNotFoundError: there is no such file.
    """
    if path is None:
        text = resources.files("mjx_inertia.objects").joinpath("mcube_objects.yaml").read_text()
    else:
        try:
            text = Path(path).read_text()
        except UnicodeDecodeError as error:
            raise ValueError(f"{path}: not a text file ({error})") from None
    where = "the published objects" if path is None else str(path)
    table = parse_yaml(text, where)
    if not isinstance(table, dict) or not isinstance(table.get("objects"), dict):
        raise ValueError(f"{where}: expected a mapping with the key `objects`")
    default_height = table.get("height")
    return {
        str(name): _object(str(name), entry, default_height, where)
        for name, entry in table["objects"].items()
    }


def _object(name: str, entry: object, default_height: object, where: str) -> ObjectModel:
    at = f"{where}: object {name!r}"
    if not isinstance(entry, dict):
        raise ValueError(f"{at}: expected a mapping of keys, found {entry!r}")
    unknown = sorted(set(map(str, entry)) - _KEYS)
    if unknown:
        raise ValueError(f"{at}: unknown key {unknown[0]!r}; known are {sorted(_KEYS)}")
    # outline, or an ellipse as polygon
    if ("outline" in entry) == ("ellipse" in entry):
        raise ValueError(f"{at}: give either `outline` or `ellipse`")
    if "outline" in entry:
        outline = _numbers(at, "outline", entry["outline"], None)
    else:
        outline = _ellipse(_numbers(at, "ellipse", entry["ellipse"], (2,), positive=True))
    # inertial parameters and height
    com = None if entry.get("com") is None else _numbers(at, "com", entry["com"], (2,))
    mass = _numbers(at, "mass", entry.get("mass"), (), positive=True)
    inertia_zz = _numbers(at, "inertia_zz", entry.get("inertia_zz"), (), positive=True)
    height = _numbers(at, "height", entry.get("height", default_height), (), positive=True)
    try:
        return prism(
            outline,
            float(height),
            float(mass),
            inertia_zz=float(inertia_zz),
            com=None if com is None else (float(com[0]), float(com[1])),
            name=name,
        )
    except ValueError as error:
        raise ValueError(f"{where}: object {error}") from None


def _numbers(
    at: str, key: str, value: object, shape: tuple[int, ...] | None, positive: bool = False
) -> ndarray:
    """`value` as finite float64 numbers of a shape; of (n, 2) for None."""
    expected = {None: "a list of [x, y]", (): "a number", (2,): "two numbers"}[shape]
    if value is None:
        raise ValueError(f"{at}: key `{key}` is missing; expected {expected}")
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{at}: key `{key}`: expected {expected}, found {value!r}") from None
    fits = numbers.shape[1:] == (2,) if shape is None else numbers.shape == shape
    if not fits or not np.all(np.isfinite(numbers)):
        raise ValueError(f"{at}: key `{key}`: expected {expected}, found {value!r}")
    with np.errstate(over="ignore", under="ignore"):
        single = numbers.astype(np.float32)  # as which it is stored
    if positive and not np.all((single > 0.0) & np.isfinite(single)):
        raise ValueError(f"{at}: key `{key}`: expected {expected} above 0, found {value!r}")
    return numbers


def _ellipse(semi_axes: Float[ndarray, "2"]) -> Float[ndarray, "k 2"]:
    angle = np.linspace(0.0, 2.0 * np.pi, _ELLIPSE_VERTICES, endpoint=False)
    return semi_axes * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
