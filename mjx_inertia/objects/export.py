"""Export of objects to URDF and MJCF, a folder each, with their meshes.

In: `ObjectModel`s by name, a folder. Out: `FOLDER/NAME/NAME.urdf`, `NAME.xml` (MJCF) and
`meshes/part_*.obj` (to look at), `meshes/piece_*.obj` (convex, to touch). Wavefront OBJ, because it
keeps double precision and which triangles share a corner: STL does neither.
"""

import dataclasses
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Literal, get_args
from xml.etree import ElementTree as ET

import manifold3d
import numpy as np
import trimesh

from mjx_inertia.files import write_whole
from mjx_inertia.objects.model import Color, ObjectModel

Format = Literal["urdf", "mjcf"]
FORMATS: tuple[Format, ...] = get_args(Format)
NOTE = "mjx_inertia"  # the URDF's element of our own

_MESHES = "meshes"  # folder beside the file that names them
_DIGITS = 12  # after the point, in m
_FLAT = 1e-9  # of the object's volume: a piece no larger is a sliver that rounding left
_TORSIONAL, _ROLLING = 0.005, 1e-4  # MuJoCo's own values of the other coefficients, m
_VISUAL_GROUP, _COLLISION_GROUP = "2", "3"


@dataclasses.dataclass(frozen=True, eq=False)
class _VisualFile:
    """A mesh of one material."""

    file: str  # its name within `_MESHES`
    color: Color  # red, green, blue from 0 to 1
    density: float  # kg/m³; the object's mean one where its parts are not known


@dataclasses.dataclass(frozen=True, eq=False)
class _MeshFiles:
    """The mesh files of one object."""

    visuals: tuple[_VisualFile, ...]  # which together are the object
    collisions: tuple[str, ...]  # names of files, each of a convex mesh
    content: dict[str, bytes]  # of each file, by name


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
    files = _mesh_files(obj)
    meshes = folder / _MESHES
    _make_writable(meshes)
    for file, content in files.content.items():
        write_whole(meshes / file, content)
    written = []
    for one in formats:
        suffix, text = _WRITERS[one]
        written.append(folder / f"{name}{suffix}")
        write_whole(written[-1], text(obj, name, files))
    # meshes of an older export with more parts or pieces, which nothing names any more
    for path in meshes.iterdir():
        if re.fullmatch(r"(part|piece)_\d+\.obj", path.name) and path.name not in files.content:
            path.unlink()
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


def _mesh_files(obj: ObjectModel) -> _MeshFiles:
    """The files of an object: one for each part, or for the whole; one for each convex piece.

    Pieces without volume are left out: nothing touches them, and no engine takes them.

    Raises:
      ValueError: a mesh or a piece that is not finite, or no piece with volume.
    """
    mean = float(obj.inertial.mass) / obj.mesh.volume
    looks = [(part.mesh, part.color, part.density) for part in obj.parts]
    content: dict[str, bytes] = {}
    visuals = []
    for i, (mesh, color, density) in enumerate(looks or [(obj.mesh, obj.color, mean)]):
        visuals.append(_VisualFile(f"part_{i}.obj", color, float(density)))
        content[visuals[-1].file] = _wavefront(obj.name, f"part {i}", mesh)
    collisions = []
    for i, piece in enumerate(obj.pieces):
        if not np.all(np.isfinite(piece)):
            raise ValueError(f"{obj.name}: piece {i} has vertices that are not finite")
        if manifold3d.Manifold.hull_points(piece).volume() > _FLAT * obj.mesh.volume:
            hull = trimesh.convex.convex_hull(piece)  # manifold3d's faces may be dented by 1 %
            collisions.append(f"piece_{len(collisions)}.obj")
            content[collisions[-1]] = _wavefront(obj.name, f"piece {i}", hull)
    if not collisions:
        raise ValueError(f"{obj.name}: none of its {len(obj.pieces)} pieces has volume")
    return _MeshFiles(tuple(visuals), tuple(collisions), content)


def _wavefront(name: str, what: str, mesh: trimesh.Trimesh) -> bytes:
    if not np.all(np.isfinite(mesh.vertices)):
        raise ValueError(f"{name}: the mesh of {what} has vertices that are not finite")
    without = dict.fromkeys(("include_normals", "include_color", "include_texture"), False)
    text = mesh.export(file_type="obj", digits=_DIGITS, header=None, **without)
    return f"# {name}, {what}; m\n{text}\n".encode()


def _urdf_text(obj: ObjectModel, name: str, files: _MeshFiles) -> bytes:
    """One link, whose frame is that of the object; meshes by their path from the file's folder.

    Friction is in Bullet's element `contact`; `mujoco` makes MuJoCo keep the link, its visual
    meshes and their paths; category, source and `pieces_error` are in an element of our own.
    Readers pass over elements that they do not know.
    """
    robot = ET.Element("robot", name=name)
    note = {"category": obj.category, "source": obj.source}
    note["pieces_error"] = _numbers([obj.pieces_error])
    ET.SubElement(robot, NOTE, note)
    mujoco = ET.SubElement(robot, "mujoco")
    keep = ("strippath", "fusestatic", "discardvisual", "balanceinertia")
    ET.SubElement(mujoco, "compiler", {key: "false" for key in keep})
    link = ET.SubElement(robot, "link", name=name)
    # the tensor is about the CoM in the axes of the link
    com, mass, tensor = _inertial_text(obj)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=com, rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=mass)
    ET.SubElement(inertial, "inertia", {f"i{axes}": text for axes, text in tensor.items()})
    for i, visual in enumerate(files.visuals):
        element = _urdf_geometry(link, "visual", visual.file)
        material = ET.SubElement(element, "material", name=f"{name}_part_{i}")
        ET.SubElement(material, "color", rgba=_numbers([*visual.color, 1.0]))
    for file in files.collisions:
        _urdf_geometry(link, "collision", file)
    contact = ET.SubElement(link, "contact")
    ET.SubElement(contact, "lateral_friction", value=_numbers([obj.friction]))
    return _pretty(robot)


def _urdf_geometry(link: ET.Element, kind: str, file: str) -> ET.Element:
    element = ET.SubElement(link, kind)
    ET.SubElement(element, "origin", xyz="0 0 0", rpy="0 0 0")
    geometry = ET.SubElement(element, "geometry")
    ET.SubElement(geometry, "mesh", filename=f"{_MESHES}/{file}")
    return element


def _mjcf_text(obj: ObjectModel, name: str, files: _MeshFiles) -> bytes:
    """One free body, whose frame is that of the object; meshes by their path from its folder.

    Mass, CoM and tensor are stated. The visual meshes (group 2, without contact) carry the
    densities of their parts, and the convex pieces (group 3) no mass, so MuJoCo's own integrals
    (`inertiafromgeom="true"`) agree where all parts are known. Names begin with that of the object,
    so that several can share a scene.
    """
    root = ET.Element("mujoco", model=name)
    ET.SubElement(root, "compiler", meshdir=_MESHES, angle="radian")
    custom = ET.SubElement(root, "custom")
    for key, value in (("category", obj.category), ("source", obj.source)):
        if value:
            ET.SubElement(custom, "text", name=f"{name}_{key}", data=value)
    off = _numbers([obj.pieces_error])
    ET.SubElement(custom, "numeric", name=f"{name}_pieces_error", data=off)
    # the body with its stated inertial parameters, then its geometries
    assets = ET.SubElement(root, "asset")
    world = ET.SubElement(root, "worldbody")
    body = ET.SubElement(world, "body", name=name)
    ET.SubElement(body, "freejoint", name=name)
    com, mass, tensor = _inertial_text(obj)
    full = " ".join(tensor[axes] for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
    ET.SubElement(body, "inertial", pos=com, mass=mass, fullinertia=full)
    for visual in files.visuals:
        geom = _mjcf_geom(assets, body, name, visual.file, _VISUAL_GROUP)
        geom.attrib |= {"contype": "0", "conaffinity": "0"}
        geom.attrib |= {
            "density": _numbers([visual.density]),
            "rgba": _numbers([*visual.color, 1.0]),
        }
    for file in files.collisions:
        geom = _mjcf_geom(assets, body, name, file, _COLLISION_GROUP)
        geom.attrib |= {"mass": "0", "friction": _numbers([obj.friction, _TORSIONAL, _ROLLING])}
    return _pretty(root)


def _mjcf_geom(
    assets: ET.Element, body: ET.Element, name: str, file: str, group: str
) -> ET.Element:
    mesh = f"{name}_{file.removesuffix('.obj')}"
    inertia = "exact" if group == _VISUAL_GROUP else "convex"
    ET.SubElement(assets, "mesh", name=mesh, file=file, inertia=inertia)
    return ET.SubElement(body, "geom", name=mesh, type="mesh", mesh=mesh, group=group)


def _inertial_text(obj: ObjectModel) -> tuple[str, str, dict[str, str]]:
    """CoM, mass, and the entries of the tensor about the CoM by their axes."""
    tensor = np.asarray(obj.inertial.inertia, np.float64)
    entries = {"xyz"[i] + "xyz"[j]: _numbers([tensor[i, j]]) for i in range(3) for j in range(i, 3)}
    return _numbers(np.asarray(obj.inertial.com)), _numbers([float(obj.inertial.mass)]), entries


def _numbers(values: Iterable[float]) -> str:
    """Values as text that gives the same doubles back."""
    return " ".join(repr(float(value)) for value in values)


def _pretty(root: ET.Element) -> bytes:
    """Indented XML."""
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


_WRITERS: dict[str, tuple[str, Callable[[ObjectModel, str, _MeshFiles], bytes]]] = {
    "urdf": (".urdf", _urdf_text),
    "mjcf": (".xml", _mjcf_text),
}
