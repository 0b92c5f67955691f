"""A rigid body as a file of shapes describes it, before it becomes an object.

In: meshes, named primitives. Out: `FileBody`, which the readers of URDF, MJCF and mesh files give.
"""

import dataclasses
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.objects.model import Color, transform_mesh
from mjx_inertia.spatial import InertialParameters

_SECTIONS = 128  # facets around a primitive: 0.04 % of a cylinder's volume
_CAPSULE = [64, _SECTIONS]  # from pole to pole, around
_SUBDIVISIONS = 4  # of an icosahedron: 0.4 % of a sphere's volume

Transform = Float[ndarray, "4 4"]


@dataclasses.dataclass(frozen=True, eq=False)
class FileShape:
    """One geometry of a file."""

    where: str  # the geometry as a message names it
    mesh: trimesh.Trimesh  # m, in the frame of the body
    color: Color | None = None  # red, green, blue from 0 to 1; None where the file has none
    density: float | None = None  # kg/m³; None where the file has none


@dataclasses.dataclass(frozen=True, eq=False)
class FileBody:
    """What a file says of one rigid body."""

    name: str  # in the file
    visuals: tuple[FileShape, ...]  # geometries to look at, m, in one frame of the file's choice
    collisions: tuple[FileShape, ...] = ()  # geometries to touch
    # in that frame, in double precision; None where the file does not state it, or what it states
    # is of no body
    inertial: InertialParameters | None = None
    lacking: str = ""  # in words, why it is None
    friction: float | None = None  # Coulomb's coefficient; None where the file has none
    category: str = ""  # of the catalogue, or empty
    source: str = ""  # of the figures, or empty


def read_mesh(path: Path, unit: float | None = None) -> trimesh.Trimesh:
    """The triangles of a mesh file, m; corners at one place are made one.

    `unit` (m) is that of the coordinates; without it, that which the file states, or 1 m.

    Raises:
      FileNotFoundError: there is no such file.
      ValueError: it is no mesh that `trimesh` reads, an empty one, or one in a unit that is not
        known.
    """
    if not path.is_file():
        found = "a folder" if path.is_dir() else "nothing"
        raise FileNotFoundError(f"{path}: expected a mesh file, found {found}")
    try:
        scene = trimesh.load_scene(path, process=False)
        mesh = scene.to_mesh()
    except Exception as error:  # readers of a dozen formats raise whatever they meet
        reason = f"{type(error).__name__}: {error}"
        raise ValueError(
            f"{path}: expected a mesh, found a file that has none ({reason})"
        ) from None
    if not len(mesh.faces):
        raise ValueError(f"{path}: expected a mesh of triangles, found {len(mesh.vertices)} points")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise ValueError(f"{path}: expected corners by their number, found one that there is not")
    if not mesh.is_watertight:  # a soup of triangles, or corners split by their normals
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
    if unit is None:
        unit = _stated_unit(path, scene.units)
    return trimesh.Trimesh(mesh.vertices * unit, mesh.faces, process=False)


def _stated_unit(path: Path, name: str | None) -> float:
    try:
        return 1.0 if name is None else trimesh.units.unit_conversion(name, "meters")
    except (KeyError, ValueError):
        raise ValueError(
            f"{path}: expected a unit of length, found {name!r}; give `unit` (m)"
        ) from None


def primitive_mesh(kind: str, size: Float[ndarray, " _"]) -> trimesh.Trimesh:
    """A named solid about the origin of its frame, with its size in m.

    "box" with its edges along x, y, z; "sphere" with its radius; "ellipsoid" with its semi-axes;
    "cylinder" or "capsule" along z with the radius and the length (of the cylinder alone).

    Raises:
      ValueError: another kind, or sizes that are not positive.
    """
    if not np.all(size > 0.0):
        raise ValueError(f"{kind} of size {[float(x) for x in size]} m, which is not positive")
    match kind:
        case "box":
            return trimesh.creation.box(size)
        case "sphere":
            return trimesh.creation.icosphere(_SUBDIVISIONS, float(size[0]))
        case "ellipsoid":
            return transform_mesh(trimesh.creation.icosphere(_SUBDIVISIONS), np.diag([*size, 1.0]))
        case "cylinder" | "capsule":
            radius, length = map(float, size)
            # at radius 1: `trimesh` leaves out triangles that are small in absolute terms
            if kind == "cylinder":
                mesh = trimesh.creation.cylinder(1.0, length / radius, sections=_SECTIONS)
            else:
                mesh = trimesh.creation.capsule(length / radius, 1.0, count=_CAPSULE)
            return transform_mesh(mesh, np.diag([radius, radius, radius, 1.0]))
    raise ValueError(f"a geometry of kind {kind!r}, which bounds no solid")
