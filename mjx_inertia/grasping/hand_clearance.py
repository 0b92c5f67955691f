"""Whether the hand fits around the object: two fingers and a palm as boxes against a mesh.

A box and a solid overlap exactly where an edge of the box crosses or lies inside the solid, or an
edge of the mesh crosses or lies inside the box. Both are asked, the first by casting rays along the
twelve edges of each box, the second for every edge of the mesh; so the answer is exact up to single
precision (about 1e-6 of the object's size), with no sampling of surfaces.
In: a mesh and hands. Out: one truth value per hand.
"""

import jax
import jax.numpy as jnp
import numpy as np
import trimesh
from jaxtyping import Array, Bool, Float, Int
from numpy import ndarray

from mjx_inertia.grasping.grasp import Gripper, HandFrames

_BLOCK = 64  # hands whose edges are looked at together
_FAR = 1e6  # m, where edges that only fill up an array lie
# Boxes and their edges in the order in which they are looked at: the inner long edges of the
# fingers find most overlaps, and a hand that overlaps is not looked at again.
_ORDER = (
    ([0, 1], [1, 2]),
    ([0, 1], [3, 0]),
    ([0, 0, 1, 1], [0, 2, 1, 3]),
    ([0] * 8 + [1] * 8, 2 * list(range(4, 12))),
    ([2] * 12, list(range(12))),
)


def above_plane(gripper: Gripper, hands: HandFrames, clearance: float) -> Bool[ndarray, " n"]:
    """Whether all three boxes of the hand are above z = 0."""
    centers = gripper.box_centers(_opening(gripper, hands.width, clearance))
    height = hands.origin[:, None, 2] + np.einsum("nk,nbk->nb", hands.axes[:, 2], centers)
    reach = np.einsum("nk,bk->nb", np.abs(hands.axes[:, 2]), gripper.half_extents)
    return np.all(height - reach >= 0.0, axis=1)


def collides(
    mesh: trimesh.Trimesh, gripper: Gripper, hands: HandFrames, clearance: float
) -> Bool[ndarray, " n"]:
    """Whether finger or palm overlaps the solid in a watertight mesh; hands in its frame.

    `clearance` is by how much each finger stands back from its contact when the hand arrives, m;
    less where the jaw does not open so far.
    """
    centers = gripper.box_centers(_opening(gripper, hands.width, clearance))
    hit = np.zeros(len(centers), dtype=bool)
    starts, vectors = _box_edges(gripper.half_extents)
    for boxes, edges in _ORDER:
        open_rows = np.flatnonzero(~hit)
        start = centers[open_rows][:, boxes] + starts[boxes, edges]
        vector = np.broadcast_to(vectors[boxes, edges], start.shape)
        hit[open_rows] = _segments_in_mesh(mesh, hands, open_rows, start, vector)
    open_rows = np.flatnonzero(~hit)
    hit[open_rows] = _mesh_edges_in_boxes(mesh, gripper, hands, open_rows, centers[open_rows])
    return hit


def pads_blocked(
    mesh: trimesh.Trimesh, gripper: Gripper, points: Float[ndarray, "n 2 3"], clearance: float
) -> Bool[ndarray, " n"]:
    """Whether the object is where a finger has to be, whatever the direction of approach.

    Looks along the closing direction through the middles of both fingers: part of what `collides`
    looks at, once for all approaches to the contacts (m) of pad 0 and pad 1.
    """
    width = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    along = (points[:, 1] - points[:, 0]) / width[:, None]
    back = 0.5 * (_opening(gripper, width, clearance) - width)
    hit = np.zeros(len(points), dtype=bool)
    for pad, sign in ((0, -1.0), (1, 1.0)):
        open_rows = np.flatnonzero(~hit)
        out = sign * along[open_rows]
        start = points[open_rows, pad] + back[open_rows, None] * out
        hit[open_rows] = _cross_or_inside(mesh, start, gripper.finger_thickness * out)
    return hit


def _opening(
    gripper: Gripper, width: Float[ndarray, " n"], clearance: float
) -> Float[ndarray, " n"]:
    """Between the pads as the hand arrives, m."""
    return np.maximum(width, np.minimum(width + 2.0 * clearance, gripper.open_width))


def _box_edges(half: Float[ndarray, "b 3"]) -> tuple[ndarray, ndarray]:
    """Starts from the centre and vectors (b, 12, 3) of the edges, first the four along z."""
    starts, vectors = [], []
    for axis in (2, 0, 1):
        for sign_a in (-1.0, 1.0):
            for sign_b in (-1.0, 1.0):
                sign = np.full(3, -1.0)
                sign[(axis + 1) % 3], sign[(axis + 2) % 3] = sign_a, sign_b
                starts.append(sign * half)
                vectors.append(2.0 * half * np.eye(3)[axis])
    return np.stack(starts, axis=1), np.stack(vectors, axis=1)


def _segments_in_mesh(
    mesh: trimesh.Trimesh,
    hands: HandFrames,
    rows: Int[ndarray, " r"],
    start: Float[ndarray, "r s 3"],
    vector: Float[ndarray, "r s 3"],
) -> Bool[ndarray, " r"]:
    """Whether a segment, in the hand's frame, crosses the mesh or lies inside it."""
    axes = hands.axes[rows].transpose(0, 2, 1)
    origin = hands.origin[rows][:, None] + start @ axes
    inside = _cross_or_inside(mesh, origin.reshape(-1, 3), (vector @ axes).reshape(-1, 3))
    return np.logical_or.reduce(inside.reshape(len(rows), vector.shape[1]), axis=1)


def _cross_or_inside(
    mesh: trimesh.Trimesh, start: Float[ndarray, "s 3"], vector: Float[ndarray, "s 3"]
) -> Bool[ndarray, " s"]:
    inside = np.zeros(len(start), dtype=bool)
    if len(start):
        places, ray, face = mesh.ray.intersects_location(start, vector, multiple_hits=False)
        # a first hit from the inside means that the segment began inside
        leaving = np.sum(mesh.face_normals[face] * vector[ray], axis=1) > 0.0
        reach = np.sum((places - start[ray]) * vector[ray], axis=1)
        inside[ray] = leaving | (reach < np.sum(vector[ray] ** 2, axis=1))
    return inside


def _mesh_edges_in_boxes(
    mesh: trimesh.Trimesh,
    gripper: Gripper,
    hands: HandFrames,
    rows: Int[ndarray, " r"],
    centers: Float[ndarray, "r 3 3"],
) -> Bool[ndarray, " r"]:
    """Whether an edge of the mesh crosses a box of the hand or lies inside it."""
    ends = mesh.vertices[mesh.edges_unique].view(np.ndarray)
    size = 1 << max(len(ends) - 1, 1).bit_length()  # few sizes, so few compilations
    middle = np.full((size, 3), _FAR, dtype=np.float32)
    half_edge = np.zeros((size, 3), dtype=np.float32)
    middle[: len(ends)], half_edge[: len(ends)] = ends.mean(1), 0.5 * (ends[:, 1] - ends[:, 0])
    half = gripper.half_extents.astype(np.float32)
    hit = np.zeros(len(rows), dtype=bool)
    for first in range(0, len(rows), 16 * _BLOCK):
        some = slice(first, first + 16 * _BLOCK)
        count = len(rows[some])
        filled = np.resize(np.arange(count), 16 * _BLOCK)
        arrays = [x[some][filled] for x in (hands.axes[rows], hands.origin[rows], centers)]
        arrays = [x.astype(np.float32).reshape(16, _BLOCK, *x.shape[1:]) for x in arrays]
        found = _segments_in_boxes(middle, half_edge, half, *arrays)
        hit[some] = np.asarray(found).reshape(-1)[:count]
    return hit


@jax.jit
def _segments_in_boxes(
    middle: Float[Array, "e 3"],
    half_edge: Float[Array, "e 3"],
    half: Float[Array, "3 3"],
    axes: Float[Array, "m b 3 3"],
    origin: Float[Array, "m b 3"],
    centers: Float[Array, "m b 3 3"],
) -> Bool[Array, "m b"]:
    """Whether any of e segments meets a box of each hand: the six separating axes of each pair.

    Ericson 2005, "Real-time collision detection", §5.3.3 (TestSegmentAABB).
    """

    def one(hand: tuple[Array, Array, Array]) -> Bool[Array, ""]:
        axes, origin, centers = hand
        shifted = [middle[:, k] - origin[k] for k in range(3)]
        m = [sum(axes[k, i] * shifted[k] for k in range(3)) for i in range(3)]
        e = [sum(axes[k, i] * half_edge[:, k] for k in range(3)) for i in range(3)]
        size = [jnp.abs(x) for x in e]
        meets = jnp.zeros(middle.shape[0], dtype=bool)
        for box in range(3):
            p = [m[i] - centers[box, i] for i in range(3)]
            h = half[box]
            apart = jnp.zeros(middle.shape[0], dtype=bool)
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                apart |= jnp.abs(p[i]) > h[i] + size[i]
                apart |= jnp.abs(p[j] * e[k] - p[k] * e[j]) > h[j] * size[k] + h[k] * size[j]
            meets |= ~apart
        return jnp.any(meets)

    return jax.lax.map(jax.vmap(one), (axes, origin, centers))
