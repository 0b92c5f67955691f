"""The shape of an object from partial views, and with a push all ten inertial parameters (§8.2).

In: depth images with known poses and noise; the mass, and as far as known I_zz and the CoM in the
plane, from a push. Out: `ShapeEstimate`, the log-Cholesky parameters of the body of unit density
with their covariance; `FullInertia` under the assumption of uniform density, with covariance, and a
test of that assumption.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray
from scipy import stats

from mjx_inertia.objects.depth_views import (
    CameraSettings,
    DepthViews,
    FusionSettings,
    TriangleMesh,
    cast_views,
    fuse_views,
    with_noise,
)
from mjx_inertia.objects.mesh_integrals import known_solid_properties
from mjx_inertia.spatial import (
    AnyArray,
    InertialParameters,
    PlanarInertia,
    from_log_cholesky,
    to_log_cholesky,
    to_planar,
)

# kg, m, kg m² about the centre of mass
FULL_INERTIA_NAMES = (
    *("mass", "com_x", "com_y", "com_z"),
    *("I_xx", "I_xy", "I_yy", "I_xz", "I_yz", "I_zz"),
)
_ITERATIONS = 4
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
    10): the same cameras see the fused solid again, with fresh noise, and it is fused again. The
    mean offset of these draws is the bias of the method on such a shape (pixels, grid, noise, what
    the cameras do not see); it is subtracted. Their scatter is the covariance due to noise. For
    systematic errors the surface as a whole may be displaced, which moves every parameter: by 0.03
    cells, by as much as the bias amounts to, and by half the distance to the largest solid that the
    views allow.

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
    # the fused solid, and what the same cameras see of it
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
    thetas = []
    for draw_key in jax.random.split(key, draws):
        noisy = with_noise(again, noise, key=draw_key)
        drawn = fuse_views(noisy, noise=noise, table=table, settings=settings, grid=solid.grid)
        thetas.append(_theta(drawn.mesh, reference))
    # bias of the method, half the way to the largest solid, and what is systematic
    bias = np.mean(thetas, axis=0) - theta
    unseen = 0.5 * (_theta(solid.largest, reference) - theta)
    per_offset = _per_offset(theta, solid.mesh)
    off = np.array(
        [_SURFACE_STD * solid.grid.edge, *(np.max(np.abs(x / per_offset)) for x in (bias, unseen))]
    )
    systematic = np.sum(off**2) * per_offset**2
    return ShapeEstimate(
        theta=theta - bias,
        covariance=np.cov(np.transpose(thetas)) + np.diag(systematic),
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


@dataclasses.dataclass(frozen=True)
class UniformityTest:
    """Whether what a push says fits the shape filled with one density."""

    # squared distance between push and shape in standard deviations, after the density was fitted;
    # chi-squared with `degrees` degrees of freedom if the density is uniform
    statistic: float
    degrees: int  # how many numbers the push gave beyond the mass; with 0 there is nothing to test
    # chance of a statistic at least as large under uniform density; 1 with 0 degrees. A small one
    # (0.01, say) speaks against uniform density.
    p_value: float
    # ln(I_zz / m) of the push minus that of the shape, in standard deviations: above 0 the mass
    # lies farther from the vertical axis than uniform density has it; NaN without I_zz
    gyration_z: float


@dataclasses.dataclass(frozen=True)
class FullInertia:
    """Inertial parameters in the world frame, under uniform density."""

    inertial: InertialParameters  # the estimate
    covariance: Float[ndarray, "10 10"]  # of the ten numbers in the order of `FULL_INERTIA_NAMES`
    density: float  # kg/m³
    density_std: float  # its standard deviation
    uniformity: UniformityTest  # where it says that density is not uniform, the rest does not hold


def combine_shape_and_push(
    shape: ShapeEstimate, pushed: PlanarInertia, covariance: Float[AnyArray, "4 4"]
) -> FullInertia:
    """Least squares of shape and push together, with the density free.

    The shape gives everything but the density, with its covariance; the push gives m, I_zz and the
    CoM in the plane with theirs. The best linear unbiased estimate with one free constant (as in
    universal kriging: Cressie 1993, "Statistics for spatial data", §3.4), iterated because the
    parameters are not linear in the log-Cholesky ones.

    Args:
      shape: in the world frame (z up).
      pushed: of the object as it stood when it was seen, CoM in the world frame.
      covariance: of (mass, I_zz, com_x, com_y) of the push; an infinite variance means unknown.

    Raises:
      ValueError: the mass is unknown or not positive, or a known value is not finite, or the
        covariance is not that of four numbers.
    """
    with jax.enable_x64(True):
        # Gauss-Newton on log-Cholesky parameters and half the logarithm of the density
        values, noise, known = _known(pushed, covariance)
        start = np.append(shape.theta, 0.5 * (np.log(values[0]) - 2.0 * shape.theta[0]))
        state = start
        for _ in range(_ITERATIONS):
            slope = np.asarray(_slope(state, shape.reference))[known]
            predicted = np.asarray(_planar(state, shape.reference))[known]
            residual = values - predicted + slope @ (state - start)
            state, joint, statistic = _estimate(start, shape.covariance, residual, slope, noise)
        numbers_slope = np.asarray(_numbers_slope(state))
        body = _body(state)
        inertial = body.replace(com=body.com + shape.reference)
    degrees = len(values) - 1
    density = float(np.exp(2.0 * state[10]))
    return FullInertia(
        inertial=inertial,
        covariance=numbers_slope @ joint @ numbers_slope.T,
        density=density,
        density_std=2.0 * density * float(np.sqrt(joint[10, 10])),
        uniformity=UniformityTest(
            statistic=statistic,
            degrees=degrees,
            p_value=float(stats.chi2.sf(statistic, degrees)) if degrees else 1.0,
            gyration_z=_gyration_z(shape, values, noise) if known[1] else float("nan"),
        ),
    )


def _known(
    pushed: PlanarInertia, covariance: Float[AnyArray, "4 4"]
) -> tuple[Float[ndarray, " k"], Float[ndarray, "k k"], ndarray]:
    """What the push says, its covariance, and which of the four numbers these are."""
    values = np.append([pushed.mass, pushed.inertia], pushed.com).astype(np.float64)
    noise = np.asarray(covariance, dtype=np.float64)
    known = np.isfinite(np.diag(noise))
    if not known[0]:
        raise ValueError("`covariance`: the variance of the mass is not finite; a shape needs one")
    values, noise = values[known], noise[np.ix_(known, known)]
    if not np.all(np.isfinite(values)) or not values[0] > 0.0:
        raise ValueError(
            f"`pushed` has {values.tolist()} where its variance is finite; expected finite numbers "
            "and a positive mass"
        )
    if not np.all(np.isfinite(noise)) or np.any(np.linalg.eigvalsh(0.5 * (noise + noise.T)) <= 0.0):
        raise ValueError("`covariance` of what is known must be finite and positive definite")
    return values, noise, known


def _estimate(
    start: Float[ndarray, "11"],
    shape_covariance: Float[ndarray, "10 10"],
    residual: Float[ndarray, " k"],
    slope: Float[ndarray, "k 11"],
    noise: Float[ndarray, "k k"],
) -> tuple[Float[ndarray, "11"], Float[ndarray, "11 11"], float]:
    """State, its covariance and the squared distance that remains; the last entry is free."""
    by_shape, by_density = slope[:, :10], slope[:, 10]
    gain = shape_covariance @ by_shape.T
    weight = np.linalg.inv(noise + by_shape @ gain)
    density_variance = 1.0 / (by_density @ weight @ by_density)
    lift = density_variance * (weight @ by_density)
    density_step = float(lift @ residual)
    rest = residual - by_density * density_step
    left = weight - np.outer(lift, lift) / density_variance
    joint = np.zeros((11, 11))
    joint[:10, :10] = shape_covariance - gain @ left @ gain.T
    joint[:10, 10] = joint[10, :10] = -gain @ lift
    joint[10, 10] = density_variance
    state = start + np.append(gain @ weight @ rest, density_step)
    return state, joint, float(rest @ weight @ rest)


def _gyration_z(
    shape: ShapeEstimate, values: Float[ndarray, " k"], noise: Float[ndarray, "k k"]
) -> float:
    with jax.enable_x64(True):
        of_shape, slope = (np.asarray(x) for x in _log_gyration_and_slope(shape.theta))
    by_push = np.array([-1.0, 1.0]) / values[:2]
    variance = by_push @ noise[:2, :2] @ by_push + slope @ shape.covariance @ slope
    return float((np.log(values[1] / values[0]) - float(of_shape)) / np.sqrt(variance))


def _log_gyration(theta: Float[AnyArray, "10"]) -> Float[Array, ""]:
    """ln(I_zz / m)."""
    return jnp.log(from_log_cholesky(jnp.asarray(theta)).inertia[2, 2]) - 2.0 * theta[0]


@jax.jit
def _body(state: Float[AnyArray, "11"]) -> InertialParameters:
    """The body of log-Cholesky parameters at unit density and half the logarithm of a density."""
    return from_log_cholesky(jnp.asarray(state)[:10].at[0].add(state[10]))


@jax.jit
def _planar(state: Float[AnyArray, "11"], reference: Float[AnyArray, "3"]) -> Float[Array, "4"]:
    planar = to_planar(_body(state))
    return jnp.concatenate(
        [jnp.stack([planar.mass, planar.inertia]), planar.com + jnp.asarray(reference)[:2]]
    )


def _numbers(state: Float[AnyArray, "11"]) -> Float[Array, "10"]:
    """In the order of `FULL_INERTIA_NAMES`."""
    body = _body(state)
    return jnp.concatenate([body.mass[None], body.com, body.inertia[jnp.tril_indices(3)]])


_slope = jax.jit(jax.jacfwd(_planar))
_log_gyration_and_slope = jax.jit(jax.value_and_grad(_log_gyration))
_numbers_slope = jax.jit(jax.jacfwd(_numbers))
