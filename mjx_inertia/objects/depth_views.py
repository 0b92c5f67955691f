"""Depth cameras: the images they take of a mesh, and the closed mesh that several images make.

In: a mesh and camera poses. Out: `DepthViews` by ray casting, with noise on request; from these and
the height of the table, vertices and faces. A camera looks along its z axis, with x to the right
and y down in the image.

Fusion: what any view sees through is empty (space carving, Kutulakos and Seitz 2000, "A theory of
shape by space carving", IJCV 38(3)); near a measured surface the signed distances of all views are
averaged (Curless and Levoy 1996, "A volumetric method for building complex models from range
images", SIGGRAPH); where no view looked the surface is continued by diffusion (Davis et al. 2002,
"Filling holes in complex surfaces using volumetric diffusion", 3DPVT). Space carving alone, which
counts all that no view looked into as solid, is the largest body that the views allow.
"""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import trimesh
from flax import struct
from jaxtyping import Array, Bool, Float, Int, Integer
from numpy import ndarray
from scipy import ndimage
from skimage.measure import marching_cubes

from mjx_inertia.spatial import AnyArray

_MARGIN = 3  # cells of the grid around the points
_STEEPEST = 2.1  # tangent of the angle between a view and a surface that it still measures: 65°


@dataclasses.dataclass(frozen=True)
class CameraSettings:
    """A pinhole camera without distortion, its axis through the middle of the image."""

    width: int = 128  # pixels
    height: int = 128  # pixels
    # pixels; width / 2 / focal_length is the tangent of half the angle of view
    focal_length: float = 220.0


@struct.dataclass
class DepthViews:
    """Depth images of one scene."""

    T_world_camera: jaxlie.SE3  # poses of the cameras, k of them
    # m, along each camera's axis, of the surface seen by each pixel, rows from the top; infinite
    # where a pixel sees none
    depth: Float[AnyArray, "k h w"]
    focal_length: float = struct.field(pytree_node=False)  # pixels


def camera_ring(
    count: int,
    *,
    target: tuple[float, float, float],
    distance: float,
    elevation: float,
    start: float = 0.0,
) -> jaxlie.SE3:
    """Poses of `count` cameras on a circle around a target, all looking at it.

    Args:
      count: cameras, at equal angles.
      target: m, in the world frame (z up).
      distance: from the target, m.
      elevation: angle above the horizon at which the cameras stand, rad, below pi/2.
      start: azimuth of the first one, rad.
    """
    azimuth = start + 2.0 * np.pi * np.arange(count) / count
    outward = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.full(count, np.sin(elevation)),
        ],
        axis=1,
    )
    forward = -outward
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=2)
    return jaxlie.SE3.from_rotation_and_translation(
        jax.vmap(jaxlie.SO3.from_matrix)(jnp.asarray(rotation)),
        jnp.asarray(np.asarray(target) + distance * outward),
    )


def join_views(*poses: jaxlie.SE3) -> jaxlie.SE3:
    """Rings of cameras as one set."""
    return jaxlie.SE3(jnp.concatenate([pose.wxyz_xyz for pose in poses]))


def cast_views(
    vertices: Float[AnyArray, "v 3"],
    faces: Integer[AnyArray, "f 3"],
    T_world_camera: jaxlie.SE3,
    settings: CameraSettings = CameraSettings(),  # frozen
) -> DepthViews:
    """What noiseless depth cameras see of a mesh, by casting a ray through each pixel's middle.

    Vertices (m) are in the world frame; the poses have one leading axis.

    Raises:
      ValueError: the poses have not exactly one leading axis.
    """
    if T_world_camera.wxyz_xyz.ndim != 2:
        raise ValueError(
            f"`T_world_camera` has shape {T_world_camera.wxyz_xyz.shape}, expected (k, 7)"
        )
    mesh = trimesh.Trimesh(np.asarray(vertices), np.asarray(faces), process=False)
    local = _pixel_rays(settings.width, settings.height, settings.focal_length).reshape(-1, 3)
    images = []
    rotations = np.asarray(T_world_camera.rotation().as_matrix(), dtype=np.float64)
    centers = np.asarray(T_world_camera.translation(), dtype=np.float64)
    for rotation, center in zip(rotations, centers, strict=True):
        rays = local @ rotation.T
        hits, ray, _ = mesh.ray.intersects_location(
            np.broadcast_to(center, rays.shape), rays, multiple_hits=False
        )
        image = np.full(len(rays), np.inf)
        image[ray] = (hits - center) @ rotation[:, 2]
        images.append(image.reshape(settings.height, settings.width))
    return DepthViews(T_world_camera, np.stack(images), settings.focal_length)


def with_noise(views: DepthViews, std: float, *, key: Array) -> DepthViews:
    """Gaussian noise (m) on every depth, independent from pixel to pixel."""
    noise = std * np.asarray(jax.random.normal(key, views.depth.shape))
    return views.replace(depth=np.asarray(views.depth) + noise)


def point_cloud(views: DepthViews) -> Float[ndarray, "n 3"]:
    """Points that the views saw, in the world frame, m."""
    depth = np.asarray(views.depth, dtype=np.float64)
    local = depth[..., None] * _pixel_rays(depth.shape[2], depth.shape[1], views.focal_length)
    rotations = np.asarray(views.T_world_camera.rotation().as_matrix(), dtype=np.float64)
    centers = np.asarray(views.T_world_camera.translation(), dtype=np.float64)
    seen = np.isfinite(depth)
    return np.concatenate(
        [local[k][seen[k]] @ rotations[k].T + centers[k] for k in range(len(depth))]
    )


def _pixel_rays(width: int, height: int, focal_length: float) -> Float[ndarray, "h w 3"]:
    """Rays through the middles of the pixels, in the camera's frame, of depth 1."""
    x = (np.arange(width) + 0.5 - 0.5 * width) / focal_length
    y = (np.arange(height) + 0.5 - 0.5 * height) / focal_length
    across, down = np.meshgrid(x, y)
    return np.stack([across, down, np.ones_like(across)], axis=-1)


@dataclasses.dataclass(frozen=True)
class FusionSettings:
    """How views are fused."""

    cells: int = 64  # of the grid along the longest side of the object
    # distance from a measured surface up to which its views are averaged, in cells
    truncation: float = 3.0
    # the same in standard deviations of the depth; the larger one counts
    truncation_noise: float = 4.0
    diffusion: int = 100  # rounds of averaging that continue the surface where no view saw it


@dataclasses.dataclass(frozen=True)
class TriangleMesh:
    """A closed surface."""

    vertices: Float[ndarray, "v 3"]  # (v, 3), m
    faces: Int[ndarray, "f 3"]  # (f, 3), outward


@dataclasses.dataclass(frozen=True)
class FusedSolid:
    """A solid seen from several sides, in the world frame."""

    mesh: TriangleMesh  # the surface, continued where no view saw it
    largest: TriangleMesh  # the largest solid that the views allow
    # share of the vertices above the table that lie at a surface that a view measured
    measured: float
    grid: "FusionGrid"  # on which it was fused


@dataclasses.dataclass(frozen=True)
class FusionGrid:
    """A cube of nodes."""

    corner: Float[ndarray, "3"]  # first node, m
    edge: float  # between nodes, m
    nodes: int  # along each side
    table: float  # z of the table, m

    @property
    def heights(self) -> Float[ndarray, " n"]:
        """Z of the nodes, m."""
        return self.corner[2] + self.edge * np.arange(self.nodes)


def fuse_views(
    views: DepthViews,
    *,
    noise: float,
    table: float = 0.0,
    settings: FusionSettings = FusionSettings(),  # frozen
    grid: FusionGrid | None = None,
) -> FusedSolid:
    """The closed surface of an object that stands on a table, from depth images of it alone.

    `noise` is the standard deviation of a depth, m, and `table` the z of the table in the world
    frame, m, below which there is nothing. Without a `grid`, one is laid around the points. Walls
    thinner than twice the truncation come out too thick, or open.

    Raises:
      ValueError: the views see nothing, or nothing is left of the object.
    """
    if grid is None:
        grid = _grid_around(point_cloud(views), table, settings.cells)
    truncation = max(settings.truncation * grid.edge, settings.truncation_noise * noise)
    # Single precision is enough for fractions of a cell, from the corner of the grid.
    to_corner = jaxlie.SE3.from_translation(-jnp.asarray(grid.corner))
    carved, measured = _carved_field(
        jaxlie.SE3(jnp.asarray((to_corner @ views.T_world_camera).wxyz_xyz, jnp.float32)),
        jnp.asarray(views.depth, jnp.float32),
        views.focal_length,
        grid.nodes,
        *(jnp.float32(x) for x in (grid.edge, noise, truncation)),
    )
    above = jnp.asarray(grid.heights >= grid.table)
    continued = _diffused(carved, measured | (carved >= truncation), above, settings.diffusion)
    largest, _ = _surface(carved, grid)
    mesh, places = _surface(continued, grid)
    sides = mesh.vertices[:, 2] > table + 0.5 * grid.edge
    seen = np.asarray(measured)[tuple(np.round(places[sides]).astype(int).T)]
    return FusedSolid(mesh, largest, float(seen.mean()), grid)


def _grid_around(points: Float[ndarray, "n 3"], table: float, cells: int) -> FusionGrid:
    if len(points) == 0:
        raise ValueError("`views` see no surface; do the cameras look at the object?")
    low, high = np.append(points.min(axis=0)[:2], table), points.max(axis=0)
    if not high[2] > table:
        raise ValueError(f"`table` at {table} m is above all points, which reach {high[2]} m")
    edge = float(np.max(high - low)) / cells
    nodes = cells + 2 * _MARGIN + 1
    return FusionGrid(0.5 * (low + high) - 0.5 * (nodes - 1) * edge, edge, nodes, table)


@functools.partial(jax.jit, static_argnames=("focal_length", "nodes"))
def _carved_field(
    T_grid_camera: jaxlie.SE3,
    depth: Float[Array, "k h w"],
    focal_length: float,
    nodes: int,
    edge: Float[Array, ""],
    noise: Float[Array, ""],
    truncation: Float[Array, ""],
) -> tuple[Float[Array, "n n n"], Bool[Array, "n n n"]]:
    """Signed distance, positive outside, in a band around the surface; and where it is measured.

    The grid's frame has its origin at the first node.

    Outside the band it is plus or minus the width of the band. Distances are along the views'
    axes, which leaves their sign right.
    """
    points = edge * jnp.moveaxis(jnp.indices((nodes, nodes, nodes)), 0, -1).reshape(-1, 3)

    def add_view(
        state: tuple[Float[Array, " p"], Float[Array, " p"], Bool[Array, " p"]],
        view: tuple[jaxlie.SE3, Float[Array, "h w"]],
    ) -> tuple[tuple[Float[Array, " p"], Float[Array, " p"], Bool[Array, " p"]], None]:
        total, count, empty = state
        free, near, distance = _seen_by(*view, points, focal_length, noise, truncation)
        return (total + jnp.where(near, distance, 0.0), count + near, empty | free), None

    zero = jnp.zeros(len(points), points.dtype)
    (total, count, empty), _ = jax.lax.scan(
        add_view, (zero, zero, zero > 1.0), (T_grid_camera, depth)
    )
    mean = jnp.where(count > 0, total / jnp.maximum(count, 1.0), -truncation)
    shape = (nodes, nodes, nodes)
    return jnp.where(empty, truncation, mean).reshape(shape), (count > 0).reshape(shape)


def _seen_by(
    T_grid_camera: jaxlie.SE3,
    depth: Float[Array, "h w"],
    points: Float[Array, "p 3"],
    focal_length: float,
    noise: Float[Array, ""],
    truncation: Float[Array, ""],
) -> tuple[Bool[Array, " p"], Bool[Array, " p"], Float[Array, " p"]]:
    """What one view says of points: surely empty, near a surface, and how far in front of it.

    A point counts as empty only where the pixel and its neighbours all see past it, and as near
    only where they see one surface, not too steeply: half a pixel at an outline would otherwise
    carve the object or smear it.
    """
    height, width = depth.shape
    local = jnp.matmul(
        points - T_grid_camera.translation(),
        T_grid_camera.rotation().as_matrix(),
        precision="highest",
    )
    z = local[:, 2]
    middle = jnp.array([0.5 * (width - 1), 0.5 * (height - 1)], points.dtype)
    pixel = focal_length * local[:, :2] / z[:, None] + middle
    column, row = pixel[:, 0], pixel[:, 1]
    inside = (z > 0.0) & (column > 0.0) & (column < width - 1) & (row > 0.0) & (row < height - 1)
    at = (
        jnp.clip(jnp.round(row).astype(int), 0, height - 1),
        jnp.clip(jnp.round(column).astype(int), 0, width - 1),
    )
    padded = jnp.pad(depth, 1, mode="edge")
    window = [padded[i : i + height, j : j + width] for i in range(3) for j in range(3)]
    nearest, farthest = jnp.min(jnp.stack(window), axis=0), jnp.max(jnp.stack(window), axis=0)
    free = inside & (nearest[at] - z > truncation)
    step = _STEEPEST * 2.0 * z / focal_length + 4.0 * noise
    distance = _between_pixels(depth, row, column) - z
    smooth = inside & (farthest[at] - nearest[at] < step)
    return free, smooth & (jnp.abs(distance) <= truncation), distance


def _between_pixels(
    image: Float[Array, "h w"], row: Float[Array, " p"], column: Float[Array, " p"]
) -> Float[Array, " p"]:
    """Values between the middles of pixels, linear along rows and columns."""
    height, width = image.shape
    i = jnp.clip(jnp.floor(row).astype(int), 0, height - 2)
    j = jnp.clip(jnp.floor(column).astype(int), 0, width - 2)
    down, right = row - i, column - j
    upper = (1.0 - right) * image[i, j] + right * image[i, j + 1]
    lower = (1.0 - right) * image[i + 1, j] + right * image[i + 1, j + 1]
    return (1.0 - down) * upper + down * lower


@functools.partial(jax.jit, static_argnames="rounds")
def _diffused(
    field: Float[Array, "n n n"],
    known: Bool[Array, "n n n"],
    above: Bool[Array, " n"],
    rounds: int,
) -> Float[Array, "n n n"]:
    """The field with unknown nodes replaced by means of their neighbours, again and again.

    Nothing flows through the table: below it nobody looks.
    """

    def average(_: Int[Array, ""], old: Float[Array, "n n n"]) -> Float[Array, "n n n"]:
        under = jnp.where(jnp.roll(above, 1), jnp.roll(old, 1, axis=2), old)
        around = [jnp.roll(old, shift, axis) for axis in (0, 1) for shift in (1, -1)]
        mean = (sum(around) + under + jnp.roll(old, -1, axis=2)) / 6.0
        return jnp.where(known | ~above, field, mean)

    return jax.lax.fori_loop(0, rounds, average, field)


def _surface(
    field: Float[Array, "n n n"], grid: FusionGrid
) -> tuple[TriangleMesh, Float[ndarray, "v 3"]]:
    """Where the field of the largest piece changes sign, and the same in places of the grid."""
    above_table = np.maximum(np.asarray(field, np.float64), grid.table - grid.heights)
    solid = _largest_piece(above_table)
    if not np.any(solid < 0.0):
        raise ValueError("`views` leave nothing of the object; are their poses right?")
    places, faces, _, _ = marching_cubes(solid, 0.0, gradient_direction="descent")
    vertices = grid.corner + grid.edge * places.astype(np.float64)
    return TriangleMesh(vertices, faces.astype(np.int64)), places


def _largest_piece(field: Float[ndarray, "n n n"]) -> Float[ndarray, "n n n"]:
    """The field with the solid's smaller pieces, and its outermost layer, made empty."""
    outside = np.abs(field).max()
    inner = np.full_like(field, outside)
    inner[1:-1, 1:-1, 1:-1] = field[1:-1, 1:-1, 1:-1]
    label = np.zeros(inner.shape, dtype=np.int32)
    ndimage.label(inner < 0.0, output=label)
    if label.max() < 2:
        return inner
    largest = 1 + np.argmax(np.bincount(label.reshape(-1))[1:])
    return np.where((inner < 0.0) & (label != largest), outside, inner)
