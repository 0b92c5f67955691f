"""Where the surface of a mesh passes through itself.

In: triangles in space. Out: the pairs of them that cross. Pairs are found by a tree of
bounding boxes and tested edge against face, in NumPy: meshes are checked once, outside any compiled
function. Surfaces that only touch (parts side by side, a shared edge or vertex, faces in one plane)
do not cross.
"""

from collections.abc import Iterator

import numpy as np
import shapely
from jaxtyping import Bool, Float, Int
from numpy import ndarray

_CHUNK = 1 << 11  # faces looked at together, to bound the memory


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
