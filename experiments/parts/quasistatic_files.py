"""Slow pushes of real objects, reduced to loads and twists by others or from poses and forces.

In: the two .npz layouts of Zhou et al. (planar manipulation toolbox, 2016, 2018). Out:
`SlowPushes`: rows of the load on the object and of its twist, in axes fixed to the object.
"""

import dataclasses
import itertools
import re
import zipfile
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from mjx_inertia.dataset import McubeFileError
from mjx_inertia.dataset.mcube_folder import rotation_matrix
from mjx_inertia.objects import ObjectModel, closest_on_outline

LIVE = 0.5  # of the forces' sizes must differ: a frozen sensor repeats a few values
_PRESSED = 0.7  # of the largest forces of a push: the tip presses
_SETTLING = 0.1  # of the time that it presses, left out
_FEWEST = 20  # force samples under load in a push
# R_tool of the sensor on the robot's flange
_TOOL = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2.0)
_MM = 1e-3  # m
_KEY = re.compile(r"wrench_twist/([^/]+)/([^/]+)/(\d+(?:\.\d+)?)")


@dataclasses.dataclass(frozen=True)
class SlowPushes:
    """Pushes of one object on one surface at one speed, one row each."""

    surface: str  # name of the table's surface
    shape: str  # name of the object
    speed: float  # of the tip, m/s; NaN where it is not told
    # on the object, N, N, N m, object axes, moment about the object-frame origin
    load: Float[ndarray, "n 3"]
    # of the object at that origin, object axes: m/s, m/s, rad/s, or over one push m, m, rad
    twist: Float[ndarray, "n 3"]

    @property
    def live(self) -> bool:
        """Whether the force sensor was alive, told from its values."""
        size = np.round(np.hypot(*self.load[:, :2].T), 4)
        return len(np.unique(size)) >= LIVE * len(size)


def load_quasistatic(path: str | Path, objects: dict[str, ObjectModel]) -> tuple[SlowPushes, ...]:
    """Reads the keys `wrench_twist/<surface>/<object>/<v>`, (N, 6), sorted by their names.

    Moment and angular velocity come scaled by rho, the mean distance of the outline's vertices
    from their mean, and are scaled back.

    Args:
      path: of the .npz file.
      objects: outlines by name.

    Raises:
      FileNotFoundError: there is no such file.
      McubeFileError: it is not such a file, or names an object without outline.
    """
    tables = _arrays(path)
    keys = sorted(key for key in tables if key.startswith("wrench_twist/"))
    if not keys:
        raise McubeFileError(
            str(path), "keys", "wrench_twist/<surface>/<object>/<v>", str(sorted(tables)[:4])
        )
    pushes = []
    for key in keys:
        found = _KEY.fullmatch(key)
        if found is None:
            raise McubeFileError(str(path), key, "wrench_twist/<surface>/<object>/<v in mm/s>", key)
        surface, shape, speed = found.groups()
        if shape not in objects:
            raise McubeFileError(str(path), key, f"an object of {sorted(objects)}", repr(shape))
        rows = _table(path, tables, key, 6)
        outline = np.asarray(objects[shape].outline, dtype=np.float64)
        rho = np.linalg.norm(outline - outline.mean(axis=0), axis=1).mean()
        scale = np.array([1.0, 1.0, rho])
        pushes.append(
            SlowPushes(
                surface, shape, 1e-3 * float(speed), rows[:, :3] * scale, rows[:, 3:] / scale
            )
        )
    return tuple(pushes)


def load_block(path: str | Path, outline: Float[ndarray, "k 2"]) -> SlowPushes:
    """Reads pushes of a block that stands on three points: poses before and after, force between.

    A push is one row: the mean force while the tip presses, its moment about the frame's origin
    from the outline's point closest to the tip, and the displacement in the axes half way. Pushes
    without twenty samples under load are left out. Keys: `pre_pose`, `post_pose` (n, 7), `ft`
    (sum, 3), `robot` (sum, 8), `ft_split`, `robot_split` (n,).

    Args:
      path: of the .npz file; its name is that of the surface.
      outline: of the block in the frame that is logged, m.

    Raises:
      FileNotFoundError: there is no such file.
      McubeFileError: it is not such a file.
    """
    tables = _arrays(path)
    before, after = (_table(path, tables, key, 7) for key in ("pre_pose", "post_pose"))
    force, robot = _table(path, tables, "ft", 3), _table(path, tables, "robot", 8)
    parts = [
        _parts(path, tables, f"{k}_split", len(t)) for k, t in (("ft", force), ("robot", robot))
    ]
    if not len(before) == len(after) == len(parts[0]) == len(parts[1]):
        found = [len(before), len(after), len(parts[0]), len(parts[1])]
        raise McubeFileError(str(path), "tables", "as many poses as splits", str(found))
    rows = [
        row
        for start, end, *part in zip(before, after, *parts, strict=True)
        if (row := _block_row(start, end, force[part[0]], robot[part[1]], outline)) is not None
    ]
    table = np.array(rows).reshape(-1, 6)
    return SlowPushes(Path(path).stem, "block", float("nan"), table[:, :3], table[:, 3:])


def _block_row(
    before: Float[ndarray, "7"],
    after: Float[ndarray, "7"],
    ft: Float[ndarray, "f 3"],
    robot: Float[ndarray, "r 8"],
    outline: Float[ndarray, "k 2"],
) -> Float[ndarray, "6"] | None:
    """Load and displacement of one push; None if the tip does not press long enough."""
    unloaded = ft[:, 1:] - ft[:3, 1:].mean(axis=0)
    size = np.hypot(*unloaded.T)
    if len(robot) == 0 or len(ft) < _FEWEST:
        return None
    pressed = np.flatnonzero(size > _PRESSED * np.quantile(size, 0.8))
    if len(pressed) < _FEWEST:
        return None
    slides = pressed[int(_SETTLING * len(pressed)) :]
    yaw = _yaw(before[3:])
    turned = (_yaw(after[3:]) - yaw + np.pi) % (2.0 * np.pi) - np.pi
    R_obj_world = rotation_matrix(yaw + 0.5 * turned).T
    moved = _MM * (after[:2] - before[:2])
    middle = 0.5 * (ft[pressed[0], 0] + ft[pressed[-1], 0])
    tip = _MM * np.array([np.interp(middle, robot[:, 0], robot[:, k]) for k in (1, 2)])
    # Half way in time the block is near the middle of its two poses.
    tip_obj = R_obj_world @ (tip - _MM * 0.5 * (before[:2] + after[:2]))
    contact = closest_on_outline(outline, tip_obj[None]).point[0]
    R_world_robot = rotation_matrix(_yaw(robot[len(robot) // 2, 4:]))
    force = R_obj_world @ R_world_robot @ (-_TOOL @ unloaded[slides].mean(axis=0))
    moment = contact[0] * force[1] - contact[1] * force[0]
    return np.concatenate([force, [moment], R_obj_world @ moved, [turned]])


def _arrays(path: str | Path) -> dict[str, ndarray]:
    if not Path(path).is_file():
        raise FileNotFoundError(f"no file {path}")
    try:
        with np.load(path, allow_pickle=False) as file:
            return {key: file[key] for key in file.files}
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, AttributeError) as error:
        raise McubeFileError(str(path), "file", "a readable .npz", str(error)) from None


def _table(
    path: str | Path, tables: dict[str, ndarray], key: str, columns: int
) -> Float[ndarray, "n d"]:
    expected = f"finite numbers of shape (N, {columns})"
    if key not in tables:
        raise McubeFileError(str(path), key, expected, f"only {sorted(tables)[:8]}")
    table = tables[key]
    if table.ndim != 2 or table.shape[1] != columns or table.dtype.kind not in "fiu":
        raise McubeFileError(str(path), key, expected, f"{table.dtype} of shape {table.shape}")
    if not np.all(np.isfinite(table)):
        raise McubeFileError(str(path), key, expected, "NaN or infinity among them")
    return table.astype(np.float64)


def _parts(path: str | Path, tables: dict[str, ndarray], key: str, total: int) -> list[slice]:
    """Rows of each push from cumulative counts."""
    ends = np.asarray(tables.get(key, np.array(["missing"])))
    if ends.ndim != 1 or ends.dtype.kind not in "fiu" or not _counts(ends.astype(int), total):
        found = f"{ends.dtype} of shape {ends.shape}" if key in tables else f"only {sorted(tables)}"
        raise McubeFileError(str(path), key, f"counts that grow up to {total}", found)
    bounds = np.concatenate([[0], ends.astype(int)])
    return [slice(a, b) for a, b in itertools.pairwise(bounds)]


def _counts(ends: Int[ndarray, " n"], total: int) -> bool:
    rising: Bool[ndarray, " n"] = np.diff(ends, prepend=0) >= 0
    return bool(rising.all() and len(ends) and ends[-1] <= total)


def _yaw(quaternion: Float[ndarray, "4"]) -> float:
    """Of a quaternion (w, x, y, z) about the vertical."""
    return float(2.0 * np.arctan2(quaternion[3], quaternion[0]))
