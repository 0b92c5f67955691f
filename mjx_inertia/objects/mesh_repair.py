"""A mesh made to bound a solid, where its defects allow.

In: vertices and faces with defects. Out: a mesh without fatal ones, and what was changed. The
remedies are trimesh's, and Manifold's union for bodies that overlap.
"""

import dataclasses

import manifold3d
import numpy as np
import trimesh
from jaxtyping import Float, Int, Integer
from numpy import ndarray

from mjx_inertia.objects.columns import point_crossings
from mjx_inertia.objects.manifolds import from_manifold, to_manifold
from mjx_inertia.objects.mesh_defects import Finding, MeshDefect, find_defects
from mjx_inertia.spatial import AnyArray

_ROUNDS = 6  # one remedy may uncover the next defect


@dataclasses.dataclass(frozen=True)
class RepairedMesh:
    """A mesh that bounds a solid."""

    vertices: Float[ndarray, "v 3"]  # (v, 3), in the unit of the mesh given
    faces: Int[ndarray, "f 3"]  # (f, 3), outward
    # what was found and changed, in order; compare with the original before trusting a filled hole,
    # whose true surface nobody knows
    remedied: tuple[Finding, ...]


def repair_mesh(vertices: Float[AnyArray, "v 3"], faces: Integer[AnyArray, "f 3"]) -> RepairedMesh:
    """Repairs the defects that `find_defects` names, as far as that is possible without guessing.

    Vertices that are not finite go with their faces; faces that name a corner twice go; holes are
    closed by fans; winding is made consistent and outward; bodies that overlap are united. A single
    body that passes through itself stays as it is.

    Raises:
      ValueError: a fatal defect remains, by its name; or `vertices` or `faces` has another shape.
    """
    mesh = trimesh.Trimesh(np.asarray(vertices), np.asarray(faces), process=False)
    remedied: list[Finding] = []
    for _ in range(_ROUNDS):
        findings = find_defects(mesh.vertices, mesh.faces)
        if not findings:
            break
        remedied.extend(findings)
        mesh = _remedied(mesh, findings[0])
    fatal = [f for f in find_defects(mesh.vertices, mesh.faces) if f.fatal]
    if fatal:
        raise ValueError(f"the mesh cannot be repaired: {fatal[0]}; what was tried: {remedied}")
    return RepairedMesh(
        np.array(mesh.vertices, dtype=np.float64),
        np.array(mesh.faces, dtype=np.int64),
        tuple(remedied),
    )


def _remedied(mesh: trimesh.Trimesh, finding: Finding) -> trimesh.Trimesh:
    match finding.defect:
        case MeshDefect.NOT_FINITE:
            corners = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
            mesh.update_faces(np.isfinite(corners).all(axis=(1, 2)))
            mesh.remove_unreferenced_vertices()
        case MeshDefect.DEGENERATE_FACE | MeshDefect.NOT_WATERTIGHT:
            mesh.merge_vertices(merge_tex=True, merge_norm=True)
            a, b, c = np.asarray(mesh.faces).T
            mesh.update_faces((a != b) & (b != c) & (c != a))
            trimesh.repair.fill_holes(mesh, use_fan=True)
        case MeshDefect.INCONSISTENT_WINDING:
            mesh.merge_vertices(merge_tex=True, merge_norm=True)
            trimesh.repair.fix_winding(mesh)
        case MeshDefect.INVERTED:
            mesh.invert()
        case MeshDefect.INVERTED_PART:
            mesh = _with_outward_bodies(mesh)
        case MeshDefect.OVERLAPPING | MeshDefect.SELF_INTERSECTING:
            mesh = _united(mesh)
    return mesh


def _with_outward_bodies(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Bodies that face inwards turned around, but for those inside another: they are cavities."""
    bodies = list(mesh.split(only_watertight=False))
    turned = [
        body.volume < 0.0 and not _any_contains(bodies[:i] + bodies[i + 1 :], body.vertices[0])
        for i, body in enumerate(bodies)
    ]
    for body, turn in zip(bodies, turned, strict=True):
        if turn:
            body.invert()
    offsets = np.cumsum([0] + [len(body.vertices) for body in bodies])
    return trimesh.Trimesh(
        np.concatenate([body.vertices for body in bodies]),
        np.concatenate([body.faces + n for body, n in zip(bodies, offsets[:-1], strict=True)]),
        process=False,
    )


def _any_contains(bodies: list[trimesh.Trimesh], point: Float[ndarray, "3"]) -> bool:
    for body in bodies:
        faces = np.asarray(body.faces, dtype=np.int64)
        column = point_crossings(np.asarray(body.vertices)[faces], faces, point[None, :2])
        if column.leaves[column.height > point[2]].sum() > 0:
            return True
    return False


def _united(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The union of the bodies in a mesh; itself if it is one body or holds cavities."""
    bodies = list(mesh.split(only_watertight=False))
    if len(bodies) < 2 or any(body.volume < 0.0 for body in bodies):
        return mesh
    solids = [to_manifold(body) for body in bodies]
    return from_manifold(manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add))
