"""What is known of a payload: a Gaussian over its ten log-Cholesky parameters.

Every sample is physically consistent. In: estimates with covariances, in the ten numbers of a
`FullInertia` or as a push gives them together with a shape. Out: `PayloadBelief`.
"""

import dataclasses

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.objects import FullInertia, ShapeEstimate, combine_shape_and_push
from mjx_inertia.spatial import (
    AnyArray,
    InertialParameters,
    PlanarInertia,
    change_frame,
    from_log_cholesky,
    to_log_cholesky,
)


@struct.dataclass
class PayloadBelief:
    """A payload's parameters in a named frame, with their uncertainty."""

    # mean of the log-Cholesky parameters, see `spatial.from_log_cholesky`
    theta: Float[Array, "10"]
    covariance: Float[Array, "10 10"]  # of theta; singular where something is known exactly

    @property
    def center(self) -> InertialParameters:
        """The payload at the mean of theta."""
        return from_log_cholesky(self.theta)

    @property
    def root(self) -> Float[Array, "10 10"]:
        """L with L Lᵀ the covariance, for singular ones too; rounding below zero counts as zero."""
        values, vectors = jnp.linalg.eigh(0.5 * (self.covariance + self.covariance.T))
        return vectors * jnp.sqrt(jnp.maximum(values, 0.0))

    @property
    def rank(self) -> Float[Array, ""]:
        """How many directions are uncertain: singular values of `root` above rounding."""
        size = jnp.linalg.norm(self.root, axis=0)
        floor = 10.0 * jnp.sqrt(jnp.finfo(size.dtype).eps) * jnp.max(size)
        return jnp.sum((size > floor) & (size > 0.0)).astype(size.dtype)


def draw_payloads(belief: PayloadBelief, count: int, *, key: Array) -> InertialParameters:
    """Payloads drawn from a belief, with one leading axis."""
    noise = jax.random.normal(key, (count, 10), dtype=belief.theta.dtype)
    return payloads_at(belief, noise)


def payloads_at(belief: PayloadBelief, noise: Float[Array, "n 10"]) -> InertialParameters:
    """Payloads at multiples of the standard deviations along the principal axes of a belief."""
    steps = jnp.sum(belief.root * noise[:, None, :], axis=2)
    return jax.vmap(from_log_cholesky)(belief.theta + steps)


def belief_of_ten_numbers(
    inertial: InertialParameters,
    covariance: Float[AnyArray, "10 10"],
    T_new_old: jaxlie.SE3 | None = None,
) -> PayloadBelief:
    """A belief from an estimate and the covariance of its ten numbers, to first order.

    Args:
      inertial: the estimate.
      covariance: of the numbers in the order of `objects.FULL_INERTIA_NAMES`.
      T_new_old: from the frame of `inertial` to that of the belief; the same if None.

    Raises:
      ValueError: the estimate is not a body with volume, or the covariance is not finite.
    """
    pose = jaxlie.SE3.identity() if T_new_old is None else T_new_old
    numbers = jnp.concatenate(
        [inertial.mass[None], inertial.com, inertial.inertia[jnp.tril_indices(3)]]
    )
    theta, slope = _theta_and_slope(numbers, pose.wxyz_xyz.astype(numbers.dtype))
    if not np.all(np.isfinite(theta)):
        raise ValueError("`inertial` is on or beyond the boundary of what a body can have")
    if not np.all(np.isfinite(covariance)):
        raise ValueError("`covariance` is not finite; give what is not known a large variance")
    return PayloadBelief(theta, slope @ jnp.asarray(covariance, numbers.dtype) @ slope.T)


@jax.jit
def _theta_and_slope(numbers: Array, wxyz_xyz: Array) -> tuple[Array, Array]:
    def theta(numbers: Array) -> Array:
        xx, xy, yy, xz, yz, zz = numbers[4:]
        tensor = jnp.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        body = InertialParameters(numbers[0], numbers[1:4], tensor)
        return to_log_cholesky(change_frame(body, jaxlie.SE3(wxyz_xyz)))

    return theta(numbers), jax.jacfwd(theta)(numbers)


def belief_of_push(
    pushed: PlanarInertia,
    covariance: Float[AnyArray, "4 4"],
    shape: ShapeEstimate,
    *,
    unevenness: float = 0.1,
    T_obj_world: jaxlie.SE3 | None = None,
) -> PayloadBelief:
    """A belief from the estimate of a push, completed by the object's shape.

    The push tells (mass, I_zz, com_x, com_y). The rest follows from the shape filled with one
    density, as in `objects.combine_shape_and_push`. The weight of the shape falls with
    `unevenness`. Where push and shape disagree, the one with the smaller variance prevails.

    Args:
      pushed: in the world frame in which the shape was seen.
      covariance: of (mass, I_zz, com_x, com_y); an infinite variance means unknown.
      shape: in the world frame.
      unevenness: how far the mass may be from uniform density: standard deviation of the logarithms
        of the radii of gyration, and of the CoM in radii of gyration.
      T_obj_world: from the world frame to that of the belief; the same if None.

    Raises:
      ValueError: as `objects.combine_shape_and_push`, or `unevenness` is negative.
    """
    if not 0.0 <= unevenness < np.inf:
        raise ValueError(f"`unevenness` {unevenness} is negative or not finite")
    radius = float(np.exp(np.mean(shape.theta[1:4])))
    std = unevenness * np.array([0.0, 1.0, 1.0, 1.0, *([radius] * 6)])
    doubted = dataclasses.replace(shape, covariance=shape.covariance + np.diag(std**2))
    full: FullInertia = combine_shape_and_push(doubted, pushed, covariance)
    return belief_of_ten_numbers(full.inertial, full.covariance, T_obj_world)
