"""A closed mesh along vertical lines: where they enter and leave the solid.

In: triangles and the places of vertical lines (columns). Out: every crossing with its height and
direction, in order. From it follow the length of each column inside the solid, for voxels, and how
often the surface winds around each piece of a column, for checks.
"""

import dataclasses

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

_CHUNK = 1 << 20  # pairs of a face and a column tested at a time, to bound the memory
# Columns stand off their nominal places by a part of the spacing too small to matter, so that
# none meets an edge or a vertex of a mesh of round numbers.
_STAND_OFF = np.array([0.41421356e-6, 0.73205081e-6])


@dataclasses.dataclass(frozen=True)
class Grid2:
    """A grid of columns."""

    corner: Float[ndarray, "2"]  # (2,) x and y of the corner of the first cell, m
    spacing: Float[ndarray, "2"]  # edge of a cell, m; columns stand at the centres of cells
    shape: tuple[int, int]  # cells along x and y. Column (i, j) has the index i · shape[1] + j.

    def places(self, cells: Int[ndarray, "n 2"]) -> Float[ndarray, "n 2"]:
        """X and y of the columns in the given cells, m."""
        return self.corner + (cells + 0.5 + _STAND_OFF) * self.spacing


@dataclasses.dataclass(frozen=True)
class ColumnCrossings:
    """Crossings of columns with a surface, ordered by column and then by height."""

    column: Int[ndarray, " n"]  # index of the column
    height: Float[ndarray, " n"]  # z of the crossing, m
    # 1 where the column leaves the solid on its way up, -1 where it enters
    leaves: Int[ndarray, " n"]

    def intervals(
        self,
    ) -> tuple[Int[ndarray, " i"], Float[ndarray, " i"], Float[ndarray, " i"], Int[ndarray, " i"]]:
        """Pieces of columns between crossings: column, lower and upper end (m), winding number.

        The winding number is 1 inside a solid, 0 outside; any other says that the surface bounds
        no solid there. Columns whose crossings do not balance (through rounding at an edge) are
        left out.
        """
        balance = np.zeros(int(self.column.max(initial=-1)) + 1, dtype=np.int64)
        np.add.at(balance, self.column, self.leaves)
        good = np.flatnonzero(balance[self.column] == 0)
        column, height, winding = (
            self.column[good],
            self.height[good],
            -np.cumsum(self.leaves[good]),
        )
        same = column[1:] == column[:-1]
        return column[:-1][same], height[:-1][same], height[1:][same], winding[:-1][same]


def grid_crossings(
    corners: Float[ndarray, "f 3 3"], faces: Int[ndarray, "f 3"], grid: Grid2
) -> ColumnCrossings:
    """Crossings of the columns of a grid with triangles that close.

    `corners` are in m; `faces` name them, with one name for faces that share a corner.
    """
    first = np.floor((corners[..., :2].min(axis=1) - grid.corner) / grid.spacing - 0.5)
    last = np.ceil((corners[..., :2].max(axis=1) - grid.corner) / grid.spacing - 0.5)
    limit = np.array(grid.shape) - 1
    first = np.clip(first, 0, limit + 1).astype(np.int64)
    last = np.clip(last, -1, limit).astype(np.int64)
    size = np.maximum(last - first + 1, 0)
    ends = np.cumsum(size.prod(axis=1))
    found = []
    start = 0
    while start < len(faces):  # at least one face at a time
        before = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, before + _CHUNK, side="right")))
        count = size[start:stop].prod(axis=1)
        face = np.repeat(np.arange(start, stop), count)
        rank = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
        cells = first[face] + np.stack(np.divmod(rank, np.maximum(size[face, 1], 1)), axis=1)
        column = cells[:, 0] * grid.shape[1] + cells[:, 1]
        found.append(_meet(corners, faces, face, grid.places(cells), column))
        start = stop
    return _in_order(found)


def point_crossings(
    corners: Float[ndarray, "f 3 3"], faces: Int[ndarray, "f 3"], places: Float[ndarray, "n 2"]
) -> ColumnCrossings:
    """Crossings of columns at given x and y (m); as `grid_crossings`."""
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    places = places + _STAND_OFF * (high.max(axis=0) - low.min(axis=0))
    rows = max(1, 16 * _CHUNK // len(faces))
    found = []
    for start in range(0, len(places), rows):
        some = places[start : start + rows, None]
        near = np.all((some >= low) & (some <= high), axis=2)
        column, face = np.nonzero(near)
        column += start
        found.append(_meet(corners, faces, face, places[column], column))
    return _in_order(found)


def _meet(
    corners: Float[ndarray, "f 3 3"],
    faces: Int[ndarray, "f 3"],
    face: Int[ndarray, " n"],
    places: Float[ndarray, "n 2"],
    column: Int[ndarray, " n"],
) -> ColumnCrossings:
    """The crossings among candidate pairs of a face and a column."""
    weights = np.stack(
        [_edge_side(corners, faces, face, places, (k + 1) % 3, (k + 2) % 3) for k in range(3)],
        axis=1,
    )
    met = np.flatnonzero((weights > 0.0).all(axis=1) | (weights < 0.0).all(axis=1))
    weights, z = weights[met], corners[face[met], :, 2]
    return ColumnCrossings(
        column=column[met],
        height=np.sum(weights * z, axis=1) / weights.sum(axis=1),
        leaves=np.where(weights[:, 0] > 0.0, 1, -1),
    )


def _edge_side(
    corners: Float[ndarray, "f 3 3"],
    faces: Int[ndarray, "f 3"],
    face: Int[ndarray, " n"],
    places: Float[ndarray, "n 2"],
    i: int,
    j: int,
) -> Float[ndarray, " n"]:
    """Twice the signed area of (corner i, corner j, place).

    Computed from the corner of the lower name to the other, so that the two faces at an edge get
    the same number with opposite signs, and no column slips through between them.
    """
    swap = (faces[face, i] > faces[face, j])[:, None]
    a = np.where(swap, corners[face, j, :2], corners[face, i, :2])
    b = np.where(swap, corners[face, i, :2], corners[face, j, :2])
    d, p = b - a, places - a
    side = d[:, 0] * p[:, 1] - d[:, 1] * p[:, 0]
    return np.where(swap[:, 0], -side, side)


def _in_order(found: list[ColumnCrossings]) -> ColumnCrossings:
    column = np.concatenate([c.column for c in found] or [np.zeros(0, np.int64)])
    height = np.concatenate([c.height for c in found] or [np.zeros(0)])
    leaves = np.concatenate([c.leaves for c in found] or [np.zeros(0, np.int64)])
    order = np.lexsort((height, column))
    return ColumnCrossings(column[order], height[order], leaves[order])
