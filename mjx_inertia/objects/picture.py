"""Rendering of meshes to an image on the CPU: no window, graphics card or driver.

In: coloured meshes and a view direction. Out: an image, and the pixels of points in space. A
z-buffer with smooth shading, outlines and a soft shadow on the table.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
import trimesh
from jaxtyping import Float, Int
from numpy import ndarray
from scipy.ndimage import uniform_filter

_SAMPLES = 3  # along each edge of a pixel
_FILLED = 0.9  # of the picture's edge that the object and its shadow take up
_SMOOTH_DEG = 32.0  # faces that meet at less are one curved surface
_LIGHT = np.array([-0.45, 0.55, 0.70])  # right, up, towards the viewer
_FILL_LIGHT = np.array([0.8, 0.1, 0.6])
_SUN = np.array([-0.24, 0.16, 1.0])  # in the object frame, turned with the view: casts the shadow
_CHUNK = 100_000  # candidate pixels at a time: few enough for the cache


@dataclasses.dataclass(frozen=True)
class View:
    """Where the viewer is: an orthographic camera that frames the object."""

    azimuth_deg: float = -60.0  # of the viewer, from x towards y
    elevation_deg: float = 28.0  # above the table
    size: int = 300  # edge of the square picture, pixels

    @property
    def axes(self) -> Float[ndarray, "3 3"]:
        """Rows: right, up and towards the viewer, in the object frame."""
        a, e = np.radians([self.azimuth_deg, self.elevation_deg])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        return np.stack([right, np.cross(back, right), back])


@dataclasses.dataclass(frozen=True, eq=False)
class Picture:
    """An image and its camera."""

    image: Float[ndarray, "n n 3"]  # red, green, blue from 0 to 1, first row on top
    axes: Float[ndarray, "3 3"]  # see `View`
    middle: Float[ndarray, "2"]  # of the picture, right and up, m
    scale: float  # pixels per metre

    def place(self, points: Float[ndarray, "k 3"]) -> Float[ndarray, "k 2"]:
        """Column and row of points in the object frame, pixels."""
        flat = points @ self.axes[:2].T - self.middle
        return 0.5 * len(self.image) + flat * [self.scale, -self.scale]


def draw_meshes(
    meshes: Sequence[trimesh.Trimesh],
    colors: Sequence[tuple[float, float, float] | Float[ndarray, "_ 3"]],
    view: View = View(),
) -> Picture:
    """Draws meshes that stand on z = 0, each of one colour or with one for each face."""
    # triangles, their normals and colours
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes])
    normals = np.concatenate([_corner_normals(mesh) for mesh in meshes])
    color = np.concatenate(
        [
            np.broadcast_to(color, (len(mesh.faces), 3))
            for mesh, color in zip(meshes, colors, strict=True)
        ]
    )
    # as seen by the viewer, and their shadow on the table
    seen = corners @ view.axes.T
    sun = view.axes[:2].T @ _SUN[:2] + [0.0, 0.0, _SUN[2]]
    ground = (corners - corners[..., 2:] * (sun / sun[2])) @ view.axes.T
    extent = np.concatenate([seen, ground])
    low, high = extent.min(axis=(0, 1)), extent.max(axis=(0, 1))
    pixels = view.size * _SAMPLES
    scale = _FILLED * pixels / max(high[0] - low[0], high[1] - low[1])
    middle = 0.5 * (low + high)[:2]

    def on_screen(points: Float[ndarray, "f 3 3"]) -> Float[ndarray, "f 3 3"]:
        """Column, row and depth, all in sample pixels, depth larger when nearer."""
        flat = 0.5 * pixels + (points[..., :2] - middle) * [scale, -scale]
        return np.concatenate([flat, points[..., 2:] * scale], axis=-1)

    # the shadow, then the shaded surface, then the outlines
    screen = on_screen(seen)
    face, weights = _nearest(screen, pixels)
    image = np.ones((pixels * pixels, 3))
    shadow, _ = _nearest(on_screen(ground), pixels)
    image -= 0.28 * _blurred((shadow >= 0).astype(float), pixels)[:, None]
    hit = face >= 0
    normal = np.einsum("pk,pkd->pd", weights[hit], normals[face[hit]]) @ view.axes.T
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    image[hit] = _shaded(normal, color[face[hit]])
    depth = np.full(pixels * pixels, -np.inf)
    depth[hit] = np.einsum("pk,pk->p", weights[hit], screen[face[hit], :, 2])
    facing = np.zeros((pixels * pixels, 3))
    facing[hit] = normal
    tint = np.zeros((pixels * pixels, 3))
    tint[hit] = color[face[hit]]
    image *= 1.0 - 0.65 * _outlined(depth, facing, tint, pixels)[:, None]
    # samples become pixels
    shape = (view.size, _SAMPLES, view.size, _SAMPLES, 3)
    small = np.clip(image, 0.0, 1.0).reshape(shape).mean(axis=(1, 3))
    return Picture(small, view.axes, middle, scale / _SAMPLES)


def _corner_normals(mesh: trimesh.Trimesh) -> Float[ndarray, "f 3 3"]:
    """Normal of each face at each of its corners, averaged over the curved surface around it."""
    corners = mesh.vertices[mesh.faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    unit = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-300)
    _, name = np.unique(np.round(mesh.vertices, 7), axis=0, return_inverse=True)
    vertex = name.reshape(-1)[mesh.faces].reshape(-1)  # of each corner
    order = np.argsort(vertex, kind="stable")
    count = np.bincount(vertex)
    start = np.cumsum(count) - count
    # all pairs of corners at one vertex
    pairs = count[vertex]
    first = np.repeat(np.arange(len(vertex)), pairs)
    nth = np.arange(len(first)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    second = order[start[vertex[first]] + nth]
    alike = np.sum(unit[first // 3] * unit[second // 3], axis=1) > np.cos(np.radians(_SMOOTH_DEG))
    total = np.stack(
        [
            np.bincount(first[alike], area[second[alike] // 3, axis], minlength=len(vertex))
            for axis in range(3)
        ],
        axis=-1,
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    own = np.repeat(unit, 3, axis=0)
    return np.where(length > 0.0, total / np.maximum(length, 1e-300), own).reshape(-1, 3, 3)


def _nearest(
    screen: Float[ndarray, "f 3 3"], pixels: int
) -> tuple[Int[ndarray, " p"], Float[ndarray, "p 3"]]:
    """The triangle nearest to the viewer at each pixel, -1 for none, and its corners' weights."""
    edges = _edge_functions(screen)
    owner, row, first, count = _spans(screen, edges, pixels)
    depth = np.full(pixels * pixels, -np.inf)
    face = np.full(pixels * pixels, -1)
    weights = np.zeros((pixels * pixels, 3))
    chunk = np.cumsum(count) // _CHUNK
    for spans in np.split(np.arange(len(count)), np.flatnonzero(np.diff(chunk)) + 1):
        each = count[spans]
        total = int(each.sum())
        nth = np.arange(total) - np.repeat(np.cumsum(each) - each, each)
        column = np.repeat(first[spans], each) + nth
        # barycentric weights of the pixels' middles
        offset = edges[1, :, owner[spans]] * (row[spans, None] + 0.5) + edges[2, :, owner[spans]]
        slope = np.repeat(edges[0, :, owner[spans]], each, axis=0)
        share = slope * (column[:, None] + 0.5) + np.repeat(offset, each, axis=0)
        nearness = np.repeat(screen[owner[spans], :, 2], each, axis=0)
        near = np.einsum("pk,pk->p", share, nearness)
        pixel = np.repeat(row[spans] * pixels, each) + column
        # the last of those sorted by depth is written last and stays
        order = np.flatnonzero(near > depth[pixel])
        order = order[np.argsort(near[order], kind="stable")]
        depth[pixel[order]] = near[order]
        face[pixel[order]] = np.repeat(owner[spans], each)[order]
        weights[pixel[order]] = share[order]
    return face, weights


def _spans(
    screen: Float[ndarray, "f 3 3"], edges: Float[ndarray, "3 3 f"], pixels: int
) -> tuple[Int[ndarray, " s"], Int[ndarray, " s"], Int[ndarray, " s"], Int[ndarray, " s"]]:
    """Rows of pixels within triangles: triangle, row, first column and how many columns."""
    low = np.clip(np.ceil(screen[..., :2].min(axis=1) - 0.5), 0, pixels).astype(int)
    high = np.clip(np.ceil(screen[..., :2].max(axis=1) - 0.5), 0, pixels).astype(int)
    rows = np.maximum(high - low, 0)[:, 1]
    owner = np.repeat(np.arange(len(rows)), rows)
    row = np.arange(len(owner)) - np.repeat(np.cumsum(rows) - rows, rows) + low[owner, 1]
    first, end = low[owner, 0], high[owner, 0]
    for slope_x, slope_y, offset in edges[:, :, owner].swapaxes(0, 1):
        # weight ≥ 0, but for rounding, on one side of this column
        value = slope_y * (row + 0.5) + offset + 1e-9
        column = -value / np.where(slope_x == 0.0, 1.0, slope_x) - 0.5
        column = np.clip(column, -1.0, pixels + 1.0)
        first = np.where(slope_x > 0.0, np.maximum(first, np.ceil(column).astype(int)), first)
        end = np.where(slope_x < 0.0, np.minimum(end, np.floor(column).astype(int) + 1), end)
        end = np.where((slope_x == 0.0) & (value < 0.0), first, end)
    some = end > first
    return owner[some], row[some], first[some], (end - first)[some]


def _edge_functions(screen: Float[ndarray, "f 3 3"]) -> Float[ndarray, "3 3 f"]:
    """Barycentric weights of a point as slope in column, slope in row, offset, for each corner.

    All are -1 for a triangle that is seen edge-on.
    """
    x, y = screen[..., 0].T, screen[..., 1].T
    x1, y1, x2, y2 = (np.roll(c, -k, axis=0) for k in (1, 2) for c in (x, y))
    edges = np.stack([y1 - y2, x2 - x1, x1 * y2 - x2 * y1])
    twice_area = edges[2].sum(axis=0)
    thin = np.abs(twice_area) < 1e-9
    edges = edges / np.where(thin, 1.0, twice_area)
    return np.where(thin, np.array([0.0, 0.0, -1.0])[:, None, None], edges)


def _shaded(normal: Float[ndarray, "p 3"], color: Float[ndarray, "p 3"]) -> Float[ndarray, "p 3"]:
    key, fill = (light / np.linalg.norm(light) for light in (_LIGHT, _FILL_LIGHT))
    diffuse = 0.34 + 0.58 * np.maximum(normal @ key, 0.0) + 0.20 * np.maximum(normal @ fill, 0.0)
    half = np.add(key, [0.0, 0.0, 1.0])
    gloss = np.maximum(normal @ (half / np.linalg.norm(half)), 0.0) ** 40
    return color * diffuse[:, None] + 0.16 * gloss[:, None]


def _outlined(
    depth: Float[ndarray, " p"],
    normal: Float[ndarray, "p 3"],
    color: Float[ndarray, "p 3"],
    pixels: int,
) -> Float[ndarray, " p"]:
    """1 where the surface breaks off, bends sharply or changes colour towards a neighbour."""
    d, n, c = (x.reshape(pixels, pixels, -1) for x in (depth, normal, color))
    line = np.zeros((pixels, pixels))
    for axis in (0, 1):
        after = [np.roll(x, -1, axis=axis) for x in (d, n, c)]
        with np.errstate(invalid="ignore"):
            step = np.abs(after[0] - d)[..., 0]
        bend = np.sum(after[1] * n, axis=-1)
        other = np.abs(after[2] - c).sum(axis=-1)
        steep = 6.0 + 4.0 / np.maximum(np.minimum(after[1][..., 2], n[..., 2]), 0.08)
        here = (step > steep) | (bend < 0.80) | (other > 0.15)
        nothing = np.isinf(d[..., 0]) & np.isinf(after[0][..., 0])
        line = np.maximum(line, here & ~nothing)
    return line.reshape(-1)


def _blurred(mask: Float[ndarray, " p"], pixels: int) -> Float[ndarray, " p"]:
    """Means over squares, three times, which is close to a Gaussian."""
    image, edge = mask.reshape(pixels, pixels), 2 * max(1, pixels // 60) + 1
    for _ in range(3):
        image = uniform_filter(image, edge, mode="constant")
    return image.reshape(-1)
