"""A folder of measured pushes as one batch, with a list of the files that are not pushes.

In: a tree of HDF5 and JSON files and of zip archives of them, as they are published. Out:
`McubeFolder`: records with truth and conditions.
"""

import dataclasses
import zipfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray
from tqdm import tqdm

from mjx_inertia.dataset.batch import PushBatch, PushConditions, PushTruth
from mjx_inertia.dataset.mcube import TIP_RADIUS, check_sampling, record_from_bytes
from mjx_inertia.dataset.mcube_file import McubeFileError, McubePush, parse_name, read_member
from mjx_inertia.objects import ObjectModel, closest_on_outline, load_mcube_objects
from mjx_inertia.pushing import PushRecord

FACE = 0.1  # of the perimeter: a shorter edge of an outline is part of a curve, not a face
_ENDINGS = (".h5", ".json")
_SAMPLED = ("time", "force", "moment", "pose", "twist", "tip_position", "tip_velocity")


def mcube_truth(record: PushRecord, model: ObjectModel) -> PushTruth:
    """True mass, I_zz and CoM of one push, the CoM in the frame of its first contact."""
    inertial = model.inertial
    pose = np.asarray(record.pose, dtype=np.float64)[0]
    com_world = rotation_matrix(pose[2]) @ np.asarray(inertial.com, dtype=np.float64)[:2] + pose[:2]
    normal = np.asarray(record.contact_normal, dtype=np.float64)
    left = np.array([-normal[1], normal[0]])
    from_contact = com_world - np.asarray(record.contact_point, dtype=np.float64)
    return PushTruth(
        mass=jnp.asarray(inertial.mass, dtype=jnp.float32),
        inertia=jnp.asarray(inertial.inertia[2, 2], dtype=jnp.float32),
        com=jnp.asarray(np.array([normal @ from_contact, left @ from_contact]), dtype=jnp.float32),
    )


def mcube_conditions(
    record: PushRecord, model: ObjectModel, push: McubePush, object_id: int
) -> PushConditions:
    """Conditions of one push.

    Friction is NaN: that of one surface varies twofold between objects. Size is the diameter of
    the circle with the footprint's area; speed that of the file name, for an accelerated push the
    one it ends with. The contact offset runs from -1 to 1 along the touched edge of the outline,
    positive to the left of the inward normal, and is NaN on a curve.
    """

    def single(value: float) -> jnp.ndarray:
        return jnp.asarray(value, dtype=jnp.float32)

    return PushConditions(
        object_id=jnp.asarray(object_id, dtype=jnp.int32),
        friction=single(np.nan),
        size=single(model.mean_diameter),
        speed=single(push.nominal_speed),
        contact_offset=single(_contact_offset(record, model)),
        angle=single(push.angle),
    )


def _contact_offset(record: PushRecord, model: ObjectModel) -> float:
    pose = np.asarray(record.pose, dtype=np.float64)[0]
    contact = np.asarray(record.contact_point, dtype=np.float64)
    contact_obj = rotation_matrix(pose[2]).T @ (contact - pose[:2])
    outline = model.outline
    edge = closest_on_outline(outline, contact_obj[None]).edge[0]
    steps = np.roll(outline, -1, axis=0) - outline
    lengths = np.linalg.norm(steps, axis=1)
    if lengths[edge] < FACE * lengths.sum():
        return float("nan")
    middle = outline[edge] + 0.5 * steps[edge]
    # Counter-clockwise, the edge runs to the right of the inward normal.
    right = steps[edge] / lengths[edge]
    return float(-right @ (contact_obj - middle) / (0.5 * lengths[edge]))


def rotation_matrix(yaw: float) -> Float[ndarray, "2 2"]:
    """R_world_obj of an object turned by `yaw`, rad."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin], [sin, cos]])


@dataclasses.dataclass(frozen=True)
class McubeFailure:
    """A file that gave no push, and why."""

    file: str
    reason: str


@dataclasses.dataclass(frozen=True)
class McubeFolder:
    """All pushes of a folder."""

    # records padded to the longest, truth and conditions; pushes with defective signals are in it,
    # with their status
    batch: PushBatch
    files: tuple[str, ...]  # path of each push, below the folder
    objects: tuple[str, ...]  # object names; `batch.conditions.object_id` counts them
    failures: tuple[McubeFailure, ...]  # files that could not be read as a push
    duplicates: tuple[str, ...]  # files left out because a push of the same name was read before


@dataclasses.dataclass(frozen=True)
class _Source:
    """A file in the tree, or a member of an archive in it."""

    path: Path
    member: str | None = None

    def name(self, root: Path) -> str:
        path = self.path.relative_to(root)
        return (path if self.member is None else path / self.member).as_posix()


def load_mcube_folder(
    root: str | Path,
    objects: dict[str, ObjectModel] | None = None,
    rate: float = 100.0,
    tip_radius: float = TIP_RADIUS,
    progress: bool = True,
) -> McubeFolder:
    """Reads every push below a folder, in the order of the paths.

    Args:
      root: the folder that holds `mcube_raw`, or any folder of measurement files.
      objects: outlines and truth by name; the published objects if None.
      rate: samples a second, Hz.
      tip_radius: m.
      progress: show a bar on stderr.

    Raises:
      FileNotFoundError: no such folder, or no measurement file below it.
      ValueError: a rate or radius that cannot be, or not one file could be read; the first reason
        is given.
    """
    check_sampling(rate, tip_radius)
    root = Path(root)
    if not root.is_dir():
        raise FileNotFoundError(f"no folder {root}")
    root = root / "mcube_raw" if (root / "mcube_raw").is_dir() else root
    objects = load_mcube_objects() if objects is None else objects
    failures: list[McubeFailure] = []
    sources = _sources(root, failures)
    if not sources and not failures:
        raise FileNotFoundError(f"no .h5, .json or .zip file below {root}")
    files: list[str] = []
    duplicates: list[str] = []
    seen: set[str] = set()
    records: list[PushRecord] = []
    with tqdm(total=len(sources), desc="reading pushes", unit="file", disable=not progress) as bar:
        for source, content in _contents(sources):
            bar.update()
            name = source.name(root)
            push = PurePosixPath(name).stem
            if push in seen:
                duplicates.append(name)
                continue
            try:
                if isinstance(content, Exception):
                    raise McubeFileError(name, "file", "readable bytes", str(content))
                records.append(record_from_bytes(content, name, objects, rate, tip_radius))
            except McubeFileError as error:
                failures.append(McubeFailure(name, error.reason))
                continue
            except Exception as error:  # of whatever type: the other files are read
                reason = f"file: expected a push, found {type(error).__name__}: {error}"
                failures.append(McubeFailure(name, reason))
                continue
            seen.add(push)
            files.append(name)
    if not records:
        raise ValueError(
            f"{root}: none of {len(failures)} files is a push; "
            f"{failures[0].file}: {failures[0].reason}"
        )
    names, batch = _batch(records, files, objects)
    return McubeFolder(batch, tuple(files), names, tuple(failures), tuple(duplicates))


def _stack_records(records: list[PushRecord]) -> PushRecord:
    """Records of different lengths as one, each padded with its last sample to the longest."""
    longest = max(len(record.time) for record in records)

    def padded(leaf: Array) -> np.ndarray:
        missing = longest - leaf.shape[0]
        return np.pad(np.asarray(leaf), [(0, missing)] + [(0, 0)] * (leaf.ndim - 1), mode="edge")

    long = [
        dataclasses.replace(record, **{name: padded(getattr(record, name)) for name in _SAMPLED})
        for record in records
    ]
    return jax.tree.map(lambda *leaves: jnp.asarray(np.stack(leaves)), *long)


def _batch(
    records: list[PushRecord], files: list[str], objects: dict[str, ObjectModel]
) -> tuple[tuple[str, ...], PushBatch]:
    pushes = [parse_name(file) for file in files]
    names = tuple(sorted({push.shape for push in pushes}))
    truths: list[PushTruth] = []
    conditions: list[PushConditions] = []
    for record, push in zip(records, pushes, strict=True):
        model = objects[push.shape]
        truths.append(mcube_truth(record, model))
        conditions.append(mcube_conditions(record, model, push, names.index(push.shape)))

    def stacked(*leaves: Array) -> Array:
        return jnp.asarray(np.stack(leaves))

    return names, PushBatch(
        records=_stack_records(records),
        truth=jax.tree.map(stacked, *truths),
        conditions=jax.tree.map(stacked, *conditions),
    )


def _sources(root: Path, failures: list[McubeFailure]) -> list[_Source]:
    sources: list[_Source] = []
    for path in sorted(root.rglob("*")):
        if path.name.startswith(".") or not path.is_file():
            continue
        if path.suffix.lower() in _ENDINGS:
            sources.append(_Source(path))
        elif path.suffix.lower() == ".zip":
            try:
                with zipfile.ZipFile(path) as archive:
                    members = sorted(map(PurePosixPath, archive.namelist()))
            except Exception as error:  # zipfile raises nearly any type
                reason = f"archive: expected a zip archive, found {error}"
                failures.append(McubeFailure(path.relative_to(root).as_posix(), reason))
                continue
            sources.extend(
                _Source(path, member.as_posix())
                for member in members
                if member.suffix.lower() in _ENDINGS and not member.name.startswith(".")
            )
    return sources


def _contents(sources: list[_Source]) -> Iterator[tuple[_Source, bytes | Exception]]:
    """Each source with its bytes, or with the error that reading it gave; archives open once."""
    opened: dict[Path, zipfile.ZipFile] = {}
    try:
        for source in sources:
            if source.path not in opened:  # sources come archive by archive
                _close(opened)
            try:
                if source.member is None:
                    content = source.path.read_bytes()
                else:
                    if source.path not in opened:
                        opened[source.path] = zipfile.ZipFile(source.path)
                    content = read_member(opened[source.path], source.member)
            except Exception as error:  # zipfile raises nearly any type
                content = error
            yield source, content
    finally:
        _close(opened)


def _close(opened: dict[Path, zipfile.ZipFile]) -> None:
    for archive in opened.values():
        archive.close()
    opened.clear()
