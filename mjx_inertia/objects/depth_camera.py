"""Simulated depth cameras: their poses, and the depth images they take of a mesh.

In: a mesh and camera poses. Out: `DepthViews` by ray casting, with noise on request, and the point
cloud they make. A camera looks along its z axis, with x to the right and y down in the image.
"""

import dataclasses

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import trimesh
from flax import struct
from jaxtyping import Array, Float, Integer
from numpy import ndarray

from mjx_inertia.spatial import AnyArray


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
