"""Defects that keep a triangle mesh from bounding a solid, each by its name.

In: vertices and faces. Out: the defects found, or a clean mesh. The integrals over a surface are
those of a solid where its winding number is 1 at every point of the solid and 0 at any other; each
defect here violates that. Faces that cross are found by a tree of their bounding boxes.
NumPy in float64: a mesh is checked once, outside any compiled function.
"""

import dataclasses
import enum
import warnings
from collections.abc import Iterator

import numpy as np
import shapely
from jaxtyping import Bool, Float, Int, Integer
from numpy import ndarray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mjx_inertia.objects.columns import ColumnCrossings, Grid2, grid_crossings, point_crossings
from mjx_inertia.spatial import AnyArray

# Of the size of the mesh. Files in single precision round the corners of touching parts this much:
# overlaps thinner than that are no defect.
_TOLERANCE = 2e-7
_COLUMNS = 128  # along x and y, on which winding numbers are looked at
_CHUNK = 1 << 11  # faces looked at together, to bound the memory
_NEGLIGIBLE = 1e-3  # of the volume: what is counted wrongly below it is a warning, not an error


class MeshDefect(enum.Enum):
    """Why a mesh does not bound a solid."""

    EMPTY = "empty"
    NOT_FINITE = "not finite"
    MISSING_VERTEX = "missing vertex"
    DEGENERATE_FACE = "degenerate face"
    NOT_WATERTIGHT = "not watertight"
    INCONSISTENT_WINDING = "inconsistent winding"
    NO_VOLUME = "no volume"
    INVERTED = "inverted"
    INVERTED_PART = "inverted part"
    OVERLAPPING = "overlapping"
    SELF_INTERSECTING = "self-intersecting"


@dataclasses.dataclass(frozen=True)
class Finding:
    """One defect of a mesh."""

    defect: MeshDefect  # its name
    detail: str  # how much of it, and what to do
    # whether the integrals over the mesh would be wrong by more than 0.1 % of the volume
    fatal: bool = True

    def __str__(self) -> str:
        """Name and detail."""
        return f"{self.defect.value}: {self.detail}"


def find_defects(
    vertices: Float[AnyArray, "v 3"], faces: Integer[AnyArray, "f 3"]
) -> tuple[Finding, ...]:
    """All defects that can be told from each other; none for a mesh that bounds a solid.

    Vertices at one place count as one, so a soup of triangles as in STL files is no defect. Hollow
    bodies (an inner surface that faces inwards) and several bodies in one mesh are solids.

    A defect of the first kind (values, connections) hides those of the second (volume, winding,
    self-intersection), which have no meaning on a surface that does not close. Overlap and
    inverted parts are looked for along 128 × 128 columns over the mesh and one through each
    connected part. Self-intersections count from a depth of 2e-7 of the mesh's size on; shallower
    ones are rounding of single precision.

    Vertices may be in any unit.

    Raises:
      ValueError: `vertices` or `faces` has another shape or type.
    """
    points, triangles = _arrays(vertices, faces)
    found = _bad_values(points, triangles)
    if found:
        return found
    merged, kept = _merged(points, triangles)
    degenerate = len(triangles) - len(kept)
    notes = ()
    if degenerate:
        detail = f"{degenerate} faces name a corner twice; they add nothing"
        notes = (Finding(MeshDefect.DEGENERATE_FACE, detail, fatal=False),)
    open_edges = _open_edges(merged[kept])
    if open_edges:
        return notes + open_edges
    local = points - 0.5 * (points.min(axis=0) + points.max(axis=0))
    return notes + _bad_solid(local[triangles[kept]], merged[kept])


def checked_mesh(
    vertices: Float[AnyArray, "v 3"], faces: Integer[AnyArray, "f 3"]
) -> tuple[Float[ndarray, "v 3"], Int[ndarray, "f 3"]]:
    """The mesh as float64 and int64 arrays, if it bounds a solid.

    Warns:
      UserWarning: a self-intersection or overlap, named, that changes the volume by less than
        0.1 %.

    Raises:
      ValueError: the first fatal defect by its name, with what to do.
    """
    findings = find_defects(vertices, faces)
    for finding in findings:
        if finding.fatal:
            raise ValueError(f"the mesh is not a solid: {finding}")
    for finding in findings:
        if finding.defect is not MeshDefect.DEGENERATE_FACE:
            warnings.warn(f"the mesh is not quite a solid: {finding}", stacklevel=4)
    return _arrays(vertices, faces)


def check_closed(faces: Integer[ndarray, "f 3"], vertices: int) -> None:
    """Raises `ValueError` unless faces close and agree in winding, whatever the vertices' places.

    Only equal indices count as one vertex; `vertices` is how many there are.
    """
    triangles = _index_array(faces)
    found = _bad_indices(triangles, vertices) or _open_edges(triangles)
    if found:
        raise ValueError(f"the mesh is not a solid: {found[0]}")


def _arrays(vertices: object, faces: object) -> tuple[Float[ndarray, "v 3"], Int[ndarray, "f 3"]]:
    given = np.asarray(vertices)
    if given.dtype.kind not in "iuf":
        raise ValueError(f"`vertices` holds {given.dtype}, expected real numbers")
    points = given.astype(np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"`vertices` has shape {points.shape}, expected (v, 3)")
    return points, _index_array(faces)


def _index_array(faces: object) -> Int[ndarray, "f 3"]:
    triangles = np.asarray(faces)
    if triangles.size == 0:
        return np.zeros((0, 3), dtype=np.int64)
    if triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(
            f"`faces` has shape {triangles.shape}, expected (f, 3); divide polygons into triangles"
        )
    if not np.issubdtype(triangles.dtype, np.integer):
        raise ValueError(f"`faces` holds {triangles.dtype}, expected integers")
    return triangles.astype(np.int64)


def _bad_values(
    points: Float[ndarray, "v 3"], triangles: Int[ndarray, "f 3"]
) -> tuple[Finding, ...]:
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        detail = f"{len(bad)} of {len(points)} vertices, the first is vertex {bad[0]}"
        return (Finding(MeshDefect.NOT_FINITE, f"{detail} = {points[bad[0]].tolist()}"),)
    return _bad_indices(triangles, len(points))


def _bad_indices(triangles: Int[ndarray, "f 3"], vertices: int) -> tuple[Finding, ...]:
    if vertices == 0 or len(triangles) == 0:
        detail = f"{vertices} vertices and {len(triangles)} faces enclose nothing"
        return (Finding(MeshDefect.EMPTY, detail),)
    low, high = int(triangles.min()), int(triangles.max())
    if low < 0 or high >= vertices:
        detail = f"faces name vertices {low} to {high}, but there are 0 to {vertices - 1}"
        return (Finding(MeshDefect.MISSING_VERTEX, detail),)
    return ()


def _merged(
    points: Float[ndarray, "v 3"], triangles: Int[ndarray, "f 3"]
) -> tuple[Int[ndarray, "f 3"], Int[ndarray, " k"]]:
    """Faces with one name for each place, and which of them have three different corners."""
    _, name = np.unique(points, axis=0, return_inverse=True)
    merged = name.reshape(-1)[triangles]
    a, b, c = merged.T
    return merged, np.flatnonzero((a != b) & (b != c) & (c != a))


def _open_edges(triangles: Int[ndarray, "f 3"]) -> tuple[Finding, ...]:
    """Whether each edge is passed as often in one direction as in the other."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges = edges[edges[:, 0] != edges[:, 1]]
    forward = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    base = int(triangles.max(initial=0)) + 1
    _, edge, count = np.unique(
        edges.min(axis=1) * base + edges.max(axis=1), return_inverse=True, return_counts=True
    )
    balance = np.zeros(len(count), dtype=np.int64)
    np.add.at(balance, edge.reshape(-1), forward)
    odd, unbalanced = int(np.sum(count % 2)), int(np.sum(balance != 0))
    if odd:
        detail = f"{odd} of {len(count)} edges bound a hole; close it (`repair_mesh` tries)"
        return (Finding(MeshDefect.NOT_WATERTIGHT, detail),)
    if unbalanced:
        detail = (
            f"at {unbalanced} of {len(count)} edges the faces beside it run in the same "
            "direction; turn some around (`repair_mesh` does)"
        )
        return (Finding(MeshDefect.INCONSISTENT_WINDING, detail),)
    return ()


def _bad_solid(corners: Float[ndarray, "f 3 3"], names: Int[ndarray, "f 3"]) -> tuple[Finding, ...]:
    """Defects of a closed surface with the origin amid it."""
    # signed volume (a determinant for each face)
    a, b, c = np.moveaxis(corners, 1, 0)
    terms = a * np.cross(b, c)
    volume = float(terms.sum()) / 6.0
    if abs(volume) <= np.finfo(np.float64).eps * np.abs(terms).sum():
        return (Finding(MeshDefect.NO_VOLUME, "the surface is flat, or both sides cancel"),)
    found: tuple[Finding, ...] = ()
    if volume < 0.0:
        detail = "the faces look inwards; reverse the order of their corners (`repair_mesh` does)"
        found = (Finding(MeshDefect.INVERTED, detail),)
        corners, names = corners[:, ::-1], names[:, ::-1]
    # winding numbers other than 0 and 1, and faces that cross
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    wrong = _wrong_winding(corners, names, _TOLERANCE * size) / abs(volume)
    negative, repeated = wrong.tolist()
    pairs = crossing_faces(corners, names, _TOLERANCE * size)
    if len(pairs):
        share = max(negative, 0.0) + max(repeated, 0.0)
        count = len(np.unique(pairs))
        detail = f"{count} faces pass through each other, {_counted_wrongly(share)}"
        return (*found, Finding(MeshDefect.SELF_INTERSECTING, detail, share > _NEGLIGIBLE))
    if repeated >= 0.0:
        detail = f"surfaces coincide or lie in one another, {_counted_wrongly(repeated)}"
        found += (Finding(MeshDefect.OVERLAPPING, detail, repeated > _NEGLIGIBLE),)
    if negative >= 0.0:
        detail = f"some of the surface looks inwards, {_counted_wrongly(negative)}"
        found += (Finding(MeshDefect.INVERTED_PART, detail, negative > _NEGLIGIBLE),)
    return found


def _counted_wrongly(share: float) -> str:
    much = f"about {share:.2g}" if share > 0.0 else f"less than some {1.0 / _COLUMNS**2:.0e}"
    return f"so that {much} of the volume is counted wrongly (`repair_mesh` tries)"


def _wrong_winding(
    corners: Float[ndarray, "f 3 3"], names: Int[ndarray, "f 3"], tolerance: float
) -> Float[ndarray, "2"]:
    """Volumes wound around a negative number of times, and around more than once.

    Each from columns on a grid; -1 where neither they nor the columns through each part met any.
    """
    low = corners[..., :2].reshape(-1, 2).min(axis=0)
    spacing = (corners[..., :2].reshape(-1, 2).max(axis=0) - low) / _COLUMNS
    lengths = _wrong_lengths(
        grid_crossings(corners, names, Grid2(low, spacing, (_COLUMNS, _COLUMNS))), tolerance
    )
    by_parts = _wrong_lengths(
        point_crossings(corners, names, _place_in_each_part(corners, names)), tolerance
    )
    volumes = lengths * spacing.prod()
    return np.where((lengths > 0.0) | (by_parts > 0.0), volumes, -1.0)


def _wrong_lengths(crossings: ColumnCrossings, tolerance: float) -> Float[ndarray, "2"]:
    _, low, high, winding = crossings.intervals()
    length = high - low
    long = length > tolerance
    return np.array([np.sum(length[long & (winding < 0)]), np.sum(length[long & (winding > 1)])])


def _place_in_each_part(
    corners: Float[ndarray, "f 3 3"], names: Int[ndarray, "f 3"]
) -> Float[ndarray, "p 2"]:
    """X and y amid the face of each connected part that is largest seen along z."""
    count, part_of_vertex = connected_components(
        coo_array(
            (np.ones(2 * len(names)), (names[:, [0, 1]].reshape(-1), names[:, [1, 2]].reshape(-1))),
            shape=(int(names.max()) + 1,) * 2,
        ),
        directed=False,
    )
    part = part_of_vertex[names[:, 0]]
    side = corners[:, 1:, :2] - corners[:, :1, :2]
    area = np.abs(side[:, 0, 0] * side[:, 1, 1] - side[:, 0, 1] * side[:, 1, 0])
    order = np.lexsort((area, part))
    largest = order[np.flatnonzero(np.diff(part[order], append=count))]
    return corners[largest, :, :2].mean(axis=1)


def crossing_faces(
    corners: Float[ndarray, "f 3 3"], faces: Int[ndarray, "f 3"], tolerance: float
) -> Int[ndarray, "p 2"]:
    """Pairs of triangles of which an edge of the first passes through the second.

    Args:
      corners: positions, not far from the origin for their size.
      faces: names of the corners; triangles with two in common do not cross each other.
      tolerance: distance, in the unit of the corners, by which the edge must pass the plane of the
        other triangle on both sides, and that triangle's sides.
    """
    planes = _planes(corners)
    found = [np.zeros((0, 2), dtype=np.int64)]
    for pairs in _pairs_with_overlapping_boxes(corners.min(axis=1), corners.max(axis=1)):
        near = pairs[_straddles(corners, planes, pairs, tolerance)]
        near = near[_straddles(corners, planes, near[:, ::-1], tolerance)]
        shared = (faces[near[:, 0], :, None] == faces[near[:, 1], None, :]).sum(axis=(1, 2))
        near = near[shared < 2]
        for ordered in (near, near[:, ::-1]):
            found.append(ordered[_passes_through(corners, planes, ordered, tolerance)])
    return np.concatenate(found)


def _pairs_with_overlapping_boxes(
    low: Float[ndarray, "f 3"], high: Float[ndarray, "f 3"]
) -> Iterator[Int[ndarray, "p 2"]]:
    """Pairs of boxes that overlap or touch, some at a time.

    By a tree of their rectangles along the two axes on which the mesh is longest.
    """
    z, x, y = np.argsort(high.max(axis=0) - low.min(axis=0))
    rectangles = shapely.box(low[:, x], low[:, y], high[:, x], high[:, y])
    tree = shapely.STRtree(rectangles)
    for start in range(0, len(low), _CHUNK):
        a, b = tree.query(rectangles[start : start + _CHUNK])
        a = a + start
        near = (a < b) & (low[a, z] <= high[b, z]) & (low[b, z] <= high[a, z])
        yield np.stack([a[near], b[near]], axis=1)


def _planes(corners: Float[ndarray, "f 3 3"]) -> Float[ndarray, "f 4"]:
    """Unit normal and offset of each triangle's plane; all 0 where it has none."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    return np.concatenate([normal, np.sum(normal * corners[:, 0], axis=1, keepdims=True)], axis=1)


def _heights(
    corners: Float[ndarray, "f 3 3"], planes: Float[ndarray, "f 4"], pairs: Int[ndarray, "p 2"]
) -> Float[ndarray, "p 3"]:
    """Distances of the first triangle's corners from the plane of the second."""
    plane = planes[pairs[:, 1]]
    return np.matmul(corners[pairs[:, 0]], plane[:, :3, None])[:, :, 0] - plane[:, 3:]


def _straddles(
    corners: Float[ndarray, "f 3 3"],
    planes: Float[ndarray, "f 4"],
    pairs: Int[ndarray, "p 2"],
    tolerance: float,
) -> Bool[ndarray, " p"]:
    """Whether the first triangle has corners on both sides of the plane of the second."""
    height = _heights(corners, planes, pairs)
    return (height.min(axis=1) < -tolerance) & (height.max(axis=1) > tolerance)


def _passes_through(
    corners: Float[ndarray, "f 3 3"],
    planes: Float[ndarray, "f 4"],
    pairs: Int[ndarray, "p 2"],
    tolerance: float,
) -> Bool[ndarray, " p"]:
    """Whether an edge of the first triangle passes through the inside of the second."""
    height = _heights(corners, planes, pairs)
    end_height = np.roll(height, -1, axis=1)
    lower, upper = np.minimum(height, end_height), np.maximum(height, end_height)
    row, edge = np.nonzero((lower < -tolerance) & (upper > tolerance))
    start, end = corners[pairs[row, 0], edge], corners[pairs[row, 0], (edge + 1) % 3]
    share = height[row, edge] / (height[row, edge] - end_height[row, edge])
    points = start + share[:, None] * (end - start)
    through = np.zeros(len(pairs), dtype=bool)
    through[row[_depth_inside(points, corners[pairs[row, 1]]) > tolerance]] = True
    return through


def _depth_inside(
    points: Float[ndarray, "n 3"], triangles: Float[ndarray, "n 3 3"]
) -> Float[ndarray, " n"]:
    """Least distance of a point in a triangle's plane from the lines of its sides, inside > 0."""
    side = np.roll(triangles, -1, axis=1) - triangles
    inward = np.cross(np.cross(side[:, 0], side[:, 1])[:, None], side)
    length = np.linalg.norm(inward, axis=2, keepdims=True)
    inward = np.divide(inward, length, out=np.zeros_like(inward), where=length > 0.0)
    return np.einsum("nki,nki->nk", points[:, None] - triangles, inward).min(axis=1)
