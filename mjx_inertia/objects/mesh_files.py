"""The mesh files of one object: what to look at, and what to touch.

In: an `ObjectModel`. Out: `MeshFiles`, which the writers of URDF and MJCF name, and their content.
Wavefront OBJ, because it keeps double precision and which triangles share a corner: STL does
neither.
"""

import dataclasses

import manifold3d
import numpy as np
import trimesh

from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.part import Color

FOLDER = "meshes"  # beside the file that names them
_DIGITS = 12  # after the point, in m
_FLAT = 1e-9  # of the object's volume: a piece no larger is a sliver that rounding left


@dataclasses.dataclass(frozen=True, eq=False)
class VisualFile:
    """A mesh of one material.

    Attributes:
      file: its name within `FOLDER`.
      color: red, green, blue from 0 to 1.
      density: kg/m³; the object's mean one where its parts are not known.
    """

    file: str
    color: Color
    density: float


@dataclasses.dataclass(frozen=True, eq=False)
class MeshFiles:
    """The files of one object.

    Attributes:
      visuals: which together are the object.
      collisions: names of files, each of a convex mesh.
      content: of each file, by name.
    """

    visuals: tuple[VisualFile, ...]
    collisions: tuple[str, ...]
    content: dict[str, bytes]


def mesh_files(obj: ObjectModel) -> MeshFiles:
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
        visuals.append(VisualFile(f"part_{i}.obj", color, float(density)))
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
    return MeshFiles(tuple(visuals), tuple(collisions), content)


def _wavefront(name: str, what: str, mesh: trimesh.Trimesh) -> bytes:
    if not np.all(np.isfinite(mesh.vertices)):
        raise ValueError(f"{name}: the mesh of {what} has vertices that are not finite")
    text = mesh.export(
        file_type="obj",
        digits=_DIGITS,
        include_normals=False,
        include_color=False,
        include_texture=False,
        header=None,
    )
    return f"# {name}, {what}; m\n{text}\n".encode()
