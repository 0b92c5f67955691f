"""Objects as files for other programs: a folder each, with URDF, MJCF and meshes.

In: `ObjectModel`s by name, a folder. Out: `FOLDER/NAME/NAME.urdf`, `NAME.xml` (MJCF) and
`meshes/part_*.obj` (to look at), `meshes/piece_*.obj` (convex, to touch).
"""

import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Literal, get_args

from mjx_inertia.files import write_whole
from mjx_inertia.objects.mesh_files import FOLDER, MeshFiles, mesh_files
from mjx_inertia.objects.mjcf_writer import mjcf_text
from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.urdf_writer import urdf_text

Format = Literal["urdf", "mjcf"]
FORMATS: tuple[Format, ...] = get_args(Format)

_WRITERS: dict[str, tuple[str, Callable[[ObjectModel, str, MeshFiles], bytes]]] = {
    "urdf": (".urdf", urdf_text),
    "mjcf": (".xml", mjcf_text),
}


def export_objects(
    objects: Mapping[str, ObjectModel],
    folder: Path | str,
    formats: Iterable[str] | str = FORMATS,
) -> tuple[Path, ...]:
    """Writes each object into a folder of its own.

    A file is written whole or not at all, those that name meshes after the meshes. Files of an
    older export are replaced; others in the folder stay. Numbers are written in the precision of
    `inertial`, so that a program that wants double precision enables it before it makes objects.

    Args:
      objects: by name: letters, digits, and `_`, `-`, `.` between.
      folder: to write into; made if it does not exist.
      formats: "urdf", "mjcf" or both.

    Returns:
      The files that describe the objects, in order.

    Raises:
      ValueError: no objects or no mapping, an unknown format, a name that no folder should have, or
        an object whose meshes are not finite.
      OSError: the folder cannot be made or written into.
    """
    chosen = [formats] if isinstance(formats, str) else list(formats)
    for one in chosen:
        if one not in FORMATS:
            raise ValueError(f"formats: unknown format {one!r}; choose from {list(FORMATS)}")
    if not isinstance(objects, Mapping):
        raise ValueError(f"objects: {type(objects).__name__}; give a mapping from name to object")
    if not objects:
        raise ValueError("objects: there are none to export")
    for name in objects:
        if not re.fullmatch(r"\w(?:[\w.-]*\w)?", name):
            raise ValueError(
                f"objects: {name!r} cannot name a folder and a body; use letters, digits, '_', '-'"
            )
    root = Path(folder)
    _make_writable(root)
    return tuple(
        path for name, obj in objects.items() for path in _export(obj, name, root / name, chosen)
    )


def _export(obj: ObjectModel, name: str, folder: Path, formats: list[str]) -> list[Path]:
    files = mesh_files(obj)
    meshes = folder / FOLDER
    _make_writable(meshes)
    for file, content in files.content.items():
        write_whole(meshes / file, content)
    written = []
    for one in formats:
        suffix, text = _WRITERS[one]
        written.append(folder / f"{name}{suffix}")
        write_whole(written[-1], text(obj, name, files))
    _remove_older(meshes, files)
    return written


def _make_writable(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror
        raise OSError(
            f"{folder}: expected a folder to write into, cannot make it ({reason})"
        ) from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OSError(f"{folder}: expected a folder to write into, found one that is read-only")


def _remove_older(meshes: Path, files: MeshFiles) -> None:
    """Meshes of an export with more parts or pieces, which nothing names any more."""
    for path in meshes.iterdir():
        if re.fullmatch(r"(part|piece)_\d+\.obj", path.name) and path.name not in files.content:
            path.unlink()
