"""All ten inertial parameters from a shape that was seen and a push that was felt (thesis §8.2).

In: a `ShapeEstimate`, and the mass, and as far as known I_zz and the CoM in the plane, from a push.
Out: `FullInertia` under the assumption of uniform density, with covariance, and a test of that
assumption.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray
from scipy import stats

from mjx_inertia.objects.shape_estimate import ShapeEstimate
from mjx_inertia.spatial import (
    AnyArray,
    InertialParameters,
    PlanarInertia,
    from_log_cholesky,
    to_planar,
)

# kg, m, kg m² about the centre of mass
FULL_INERTIA_NAMES = (
    *("mass", "com_x", "com_y", "com_z"),
    *("I_xx", "I_xy", "I_yy", "I_xz", "I_yz", "I_zz"),
)
_ITERATIONS = 4


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
