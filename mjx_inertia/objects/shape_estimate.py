"""The shape of an object from partial views, with its uncertainty.

In: depth images with known poses and noise. Out: `ShapeEstimate`: volume, centroid and second
moments of the volume, as the log-Cholesky parameters of the body of unit density, and their
covariance.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

from mjx_inertia.objects.depth_camera import CameraSettings, DepthViews, cast_views, with_noise
from mjx_inertia.objects.depth_fusion import FusionSettings, TriangleMesh, fuse_views
from mjx_inertia.objects.mesh_integrals import known_solid_properties
from mjx_inertia.spatial import InertialParameters, from_log_cholesky, to_log_cholesky

# Of a cell: how far the surface as a whole may stand off, all else being known. Measured on boxes,
# cylinders and prisms, where views see everything and noise averages out.
_SURFACE_STD = 0.03
_to_log_cholesky = jax.jit(to_log_cholesky)


@dataclasses.dataclass(frozen=True)
class ShapeEstimate:
    """The body of unit density (1 kg/m³) that fills a shape."""

    # its log-Cholesky parameters in a frame along the world's axes whose origin is `reference`; see
    # `spatial.from_log_cholesky`
    theta: Float[ndarray, "10"]
    covariance: Float[ndarray, "10 10"]  # of theta
    reference: Float[ndarray, "3"]  # m, in the world frame
    # share of the surface that a view measured; the rest is guessed, which the covariance reflects
    measured: float
    mesh: TriangleMesh  # the surface, before the correction of its bias

    @property
    def unit_density(self) -> InertialParameters:
        """Parameters of the body in the world frame; its mass in kg is the volume in m³."""
        body = from_log_cholesky(jnp.asarray(self.theta))
        return body.replace(com=body.com + self.reference)


def estimate_shape(
    views: DepthViews,
    *,
    noise: float,
    key: Array,
    table: float = 0.0,
    draws: int = 12,
    settings: FusionSettings = FusionSettings(),  # noqa: B008  # frozen
) -> ShapeEstimate:
    """Shape of an object that stands on a table, from depth images of it.

    A parametric bootstrap (Efron and Tibshirani 1993, "An introduction to the bootstrap", ch. 6 and
    10): the fused solid is seen again by the same cameras, with fresh noise, and fused again.
    How far these draws lie from it on average is the bias of the whole method on such a shape
    (pixels, grid, noise, what the cameras do not see), which is taken off; how they scatter is the
    covariance that noise causes. What is systematic is added as a surface that may stand off by a
    length, of which every parameter has its part: 0.03 cells, and as much as the bias taken off
    and half the way to the largest solid that the views allow amount to.

    Args:
      views: depth images of the object alone.
      noise: standard deviation of a depth, m.
      key: for the noise of the draws.
      table: z of the table, m.
      draws: of the bootstrap.
      settings: of the fusion.

    Raises:
      ValueError: fewer than 2 draws; or views that see nothing.
    """
    if draws < 2:
        raise ValueError(f"`draws` is {draws}, but a scatter needs 2 or more")
    solid = fuse_views(views, noise=noise, table=table, settings=settings)
    reference = 0.5 * (solid.mesh.vertices.min(axis=0) + solid.mesh.vertices.max(axis=0))
    theta = _theta(solid.mesh, reference)
    height, width = views.depth.shape[1:]
    again = cast_views(
        solid.mesh.vertices,
        solid.mesh.faces,
        views.T_world_camera,
        CameraSettings(width, height, views.focal_length),
    )
    thetas = np.stack(
        [
            _theta(
                fuse_views(
                    with_noise(again, noise, key=draw_key),
                    noise=noise,
                    table=table,
                    settings=settings,
                    grid=solid.grid,
                ).mesh,
                reference,
            )
            for draw_key in jax.random.split(key, draws)
        ]
    )
    bias = thetas.mean(axis=0) - theta
    unseen = 0.5 * (_theta(solid.largest, reference) - theta)
    corrected = theta - bias
    per_offset = _per_offset(theta, solid.mesh)
    off = np.array(
        [_SURFACE_STD * solid.grid.edge, *(np.max(np.abs(x / per_offset)) for x in (bias, unseen))]
    )
    systematic = np.sum(off**2) * per_offset**2
    return ShapeEstimate(
        theta=corrected,
        covariance=np.cov(thetas.T) + np.diag(systematic),
        reference=reference,
        measured=solid.measured,
        mesh=solid.mesh,
    )


def _theta(mesh: TriangleMesh, reference: Float[ndarray, "3"]) -> Float[ndarray, "10"]:
    body = known_solid_properties(mesh.vertices - reference, mesh.faces)
    return np.asarray(_to_log_cholesky(body), dtype=np.float64)


def _per_offset(theta: Float[ndarray, "10"], mesh: TriangleMesh) -> Float[ndarray, "10"]:
    """How much a parameter changes, at most about, for each metre that the surface stands off."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    half_share = 0.5 * area / np.exp(2.0 * theta[0])  # α = ½ ln V
    return np.concatenate([[half_share], np.exp(-theta[1:4]), np.ones(6)])  # d = ln of a length
