"""Where the surface of a mesh passes through itself.

In: triangles in space. Out: the pairs of them that cross. Pairs are found by a hierarchy of
bounding boxes and tested edge against face, in NumPy: meshes are checked once, outside any compiled
function. Surfaces that only touch (parts side by side, a shared edge or vertex, faces in one plane)
do not cross.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

_CHUNK = 1 << 17  # pairs looked at together, to bound the memory


def crossing_faces(
    corners: Float[ndarray, "f 3 3"], faces: Int[ndarray, "f 3"], tolerance: float
) -> Int[ndarray, "p 2"]:
    """Pairs of triangles of which an edge of the first passes through the second.

    Args:
      corners: (f, 3, 3) positions, not far from the origin for their size.
      faces: (f, 3) names of the corners; triangles with two in common are neighbours and do not
        cross each other.
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

    A binary tree of boxes over a Morton order of the centres, descended for many pairs of nodes at
    once.
    """
    order = np.argsort(_morton_code(0.5 * (low + high)), kind="stable")
    levels = max(0, (len(low) - 1).bit_length())
    missing = (1 << levels) - len(low)
    lows = [np.pad(low[order], ((0, missing), (0, 0)), constant_values=np.inf)]
    highs = [np.pad(high[order], ((0, missing), (0, 0)), constant_values=-np.inf)]
    for _ in range(levels):
        lows.append(np.minimum(lows[-1][::2], lows[-1][1::2]))
        highs.append(np.maximum(highs[-1][::2], highs[-1][1::2]))
    waiting = [(levels, np.zeros((1, 2), dtype=np.int64))]
    while waiting:
        level, nodes = waiting.pop()
        if level == 0:
            yield order[nodes[nodes[:, 0] != nodes[:, 1]]]
            continue
        nodes = np.concatenate([2 * nodes + np.array([i, j]) for i in (0, 1) for j in (0, 1)])
        a, b = nodes[nodes[:, 0] <= nodes[:, 1]].T
        apart = np.zeros(len(a), dtype=bool)
        for axis in range(3):
            least, most = lows[level - 1][:, axis], highs[level - 1][:, axis]
            apart |= (least[a] > most[b]) | (least[b] > most[a])
        nodes = np.stack([a[~apart], b[~apart]], axis=1)
        waiting += [
            (level - 1, nodes[start : start + _CHUNK]) for start in range(0, len(nodes), _CHUNK)
        ]


def _morton_code(points: Float[ndarray, "f 3"]) -> Int[ndarray, " f"]:
    """Interleaved bits of the coordinates: points close on the curve are close in space."""
    low = points.min(axis=0)
    extent = max(float(np.max(points.max(axis=0) - low)), np.finfo(np.float64).tiny)
    cells = ((points - low) / extent * 1023.0).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


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
