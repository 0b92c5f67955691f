"""Solids of `manifold3d`: exact booleans, silhouettes seen from above, sections.

In: watertight `trimesh` meshes. Out: their union, silhouette and lower slice, in double precision,
which `trimesh.boolean` does not keep.
"""

from collections.abc import Iterable

import manifold3d
import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from numpy import ndarray

_SIMPLER = 1e-6  # m, by which a vertex of an outline may be off the line between its neighbours
_GAP = 3e-4  # of the size: bodies that are closer than twice that touch, but for rounding
_SPECK = 1e-6  # of the area: what is no larger is left by rounding
_SLIVER = 1e-9  # of the volume: a body no larger is what rounding left between two that touch


def to_manifold(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    """The solid inside a watertight mesh.

    Raises:
      ValueError: the mesh bounds no solid.
    """
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.uint64))
    )
    if solid.status() != manifold3d.Error.NoError or solid.is_empty():
        raise ValueError(f"the mesh bounds no solid ({solid.status().name}); repair it first")
    return solid


def from_manifold(solid: manifold3d.Manifold) -> trimesh.Trimesh:
    """The surface of a solid."""
    mesh = solid.to_mesh64()
    return trimesh.Trimesh(
        np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, np.int64), process=False
    )


def union(meshes: Iterable[trimesh.Trimesh]) -> manifold3d.Manifold:
    """The union of meshes, which may touch.

    Vertices are rounded to a nanometre: faces that touch then touch exactly, and leave no sliver
    between them.
    """
    snapped = [
        trimesh.Trimesh(mesh.vertices.round(9), mesh.faces, process=False) for mesh in meshes
    ]
    solids = [to_manifold(mesh) for mesh in snapped]
    whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    bodies = whole.decompose()
    sliver = _SLIVER * whole.volume()
    if all(abs(body.volume()) > sliver for body in bodies):
        return whole
    outer = manifold3d.Manifold.compose([body for body in bodies if body.volume() > sliver])
    # a closed hollow is a body of negative volume
    hollows = [_turned_out(body) for body in bodies if body.volume() < -sliver]
    return manifold3d.Manifold.batch_boolean([outer, *hollows], manifold3d.OpType.Subtract)


def _turned_out(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    mesh = from_manifold(solid)
    return to_manifold(trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False))


def filled(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    """The solid without closed hollows."""
    bodies = solid.decompose()
    outer = [body for body in bodies if body.volume() > 0.0]
    return (
        solid
        if len(outer) == len(bodies)
        else manifold3d.Manifold.batch_boolean(outer, manifold3d.OpType.Add)
    )


def covered(solid: manifold3d.Manifold) -> shapely.geometry.base.BaseGeometry:
    """What a solid covers as seen along z, m: a polygon or several, with their holes."""
    return _polygons(solid.project())


def silhouette(solid: manifold3d.Manifold, name: str) -> Float[ndarray, "k 2"]:
    """Outer ring, counter-clockwise, of what a solid covers as seen along z, m.

    Raises:
      ValueError: with the object's `name`, what it covers is in several places, which one outline
        cannot describe.
    """
    area = covered(solid)
    if shapely.get_num_geometries(area) > 1:
        low_x, low_y, high_x, high_y = area.bounds
        gap = _GAP * float(np.hypot(high_x - low_x, high_y - low_y))
        area = area.buffer(gap, join_style="mitre").buffer(-gap, join_style="mitre")
    parts = sorted(shapely.get_parts(area), key=lambda polygon: polygon.area)
    if sum(polygon.area for polygon in parts[:-1]) > _SPECK * parts[-1].area:
        between = 1e3 * parts[-1].distance(shapely.union_all(parts[:-1]))
        raise ValueError(
            f"{name}: it is {len(parts)} bodies that lie {between:.3g} mm apart as seen from "
            "above; one rigid object must hang together there: move them until they touch, or make "
            "an object of each"
        )
    return np.asarray(shapely.orient_polygons(parts[-1]).exterior.coords)[:-1]


def lowest(solid: manifold3d.Manifold, depth: float) -> tuple[Float[ndarray, "_ 2"], ...]:
    """What of a solid lies within `depth` (m) of its lowest point, seen along z.

    Rings of patches counter-clockwise, of holes in them clockwise.
    """
    below = solid.trim_by_plane((0.0, 0.0, -1.0), -(solid.bounding_box()[2] + depth))
    rings: list[ndarray] = []
    for patch in shapely.get_parts(covered(below)):
        oriented = shapely.orient_polygons(patch)
        rings += [np.asarray(r.coords)[:-1] for r in (oriented.exterior, *oriented.interiors)]
    return tuple(rings)


def outlines_between(
    mesh: trimesh.Trimesh, low: float, high: float
) -> tuple[Float[ndarray, "_ 2"], ...]:
    """Outer rings, counter-clockwise, of what lies between two heights (m), seen along z.

    Empty where nothing does.
    """
    slab = to_manifold(mesh).trim_by_plane((0.0, 0.0, 1.0), low)
    slab = slab.trim_by_plane((0.0, 0.0, -1.0), -high)
    parts = shapely.get_parts(covered(slab)) if not slab.is_empty() else ()
    return tuple(np.asarray(shapely.orient_polygons(p).exterior.coords)[:-1] for p in parts)


def section(solid: manifold3d.Manifold) -> shapely.geometry.base.BaseGeometry:
    """Where a solid meets the half plane y = 0, x > 0: polygons in x and z, m."""
    upended = solid.rotate((-90.0, 0.0, 0.0))  # z becomes y
    polygons = _polygons(upended.slice(0.0))
    if polygons.is_empty:
        return polygons
    _, low_y, high_x, high_y = polygons.bounds
    return polygons.intersection(
        shapely.box(0.0, low_y - 1.0, max(high_x, 0.0) + 1.0, high_y + 1.0)
    )


def difference_volume(a: manifold3d.Manifold, b: manifold3d.Manifold) -> float:
    """Volume in one of two solids but not in both, m³."""
    return a.volume() + b.volume() - 2.0 * (a ^ b).volume()


def _polygons(flat: manifold3d.CrossSection) -> shapely.geometry.base.BaseGeometry:
    filled = manifold3d.CrossSection(flat.to_polygons(), manifold3d.FillRule.Positive)
    polygons = [shapely.Polygon(c) for c in filled.simplify(_SIMPLER).to_polygons() if len(c) > 2]
    outer = [simple_polygons(p) for p in polygons if p.exterior.is_ccw]
    holes = [simple_polygons(p) for p in polygons if not p.exterior.is_ccw]
    return shapely.union_all(outer).difference(shapely.union_all(holes))


def simple_polygons(polygon: shapely.Polygon) -> shapely.geometry.base.BaseGeometry:
    """The area inside a ring that `simplify` may have made to touch or cross itself."""
    if polygon.is_valid:
        return polygon
    return shapely.make_valid(polygon, method="structure", keep_collapsed=False)
