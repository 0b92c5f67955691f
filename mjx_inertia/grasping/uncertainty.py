"""A payload known as a distribution, and what grasps cost under it.

The belief is a Gaussian over the ten log-Cholesky parameters, so that every sample is physically
consistent. In: estimates with covariances, in the ten numbers of a `FullInertia` or as a push gives
them together with a shape; a cost as a function of the payload. Out: `PayloadBelief`;
`UncertainCost` by linear propagation or by sampling; the regret of choosing by a wrong payload.
"""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
from flax import struct
from jax.scipy.stats import norm
from jaxtyping import Array, Float, Int
from scipy import stats

from mjx_inertia.objects import FullInertia, ShapeEstimate, combine_shape_and_push
from mjx_inertia.spatial import (
    AnyArray,
    InertialParameters,
    PlanarInertia,
    change_frame,
    from_log_cholesky,
    to_log_cholesky,
)

Cost = Callable[[InertialParameters], Float[Array, "*m"]]


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


@struct.dataclass
class UncertainCost:
    """A cost, or many, under an uncertain payload."""

    mean: Float[Array, "*m"]  # expectation
    std: Float[Array, "*m"]  # standard deviation
    quantile: Float[Array, "*m"]  # what the cost stays below with the given probability
    # greatest cost over the payloads of the confidence ellipsoid of this probability
    worst: Float[Array, "*m"]


def linear_cost(
    cost: Cost, belief: PayloadBelief, *, probability: float = 0.95, second_order: bool = False
) -> UncertainCost:
    """Linear propagation: exact to first order in the covariance, at ten derivatives of the cost.

    Args:
      cost: a differentiable function of the payload: one number or an array of them.
      belief: of the payload, in the frame that `cost` expects.
      probability: of the quantile and of the ellipsoid.
      second_order: adds half the trace of Hessian times covariance to the mean, and hence to the
        quantile and the worst case.

    Raises:
      ValueError: `probability` is not between 0 and 1.
    """
    radius = ellipsoid_radius(belief, probability)
    root = belief.root

    def of_theta(theta: Array) -> Array:
        return jnp.asarray(cost(from_log_cholesky(theta)))

    def along(direction: Array) -> tuple[Array, Array]:
        def slope(theta: Array) -> Array:
            return jax.jvp(of_theta, (theta,), (direction,))[1]

        if not second_order:
            first = slope(belief.theta)
            return first, jnp.zeros_like(first)
        return jax.jvp(slope, (belief.theta,), (direction,))

    first, second = jax.vmap(along)(root.T)
    mean = of_theta(belief.theta) + 0.5 * jnp.sum(second, axis=0)
    std = jnp.sqrt(jnp.sum(first**2, axis=0))
    return UncertainCost(
        mean=mean,
        std=std,
        quantile=mean + norm.ppf(probability).astype(std.dtype) * std,
        worst=mean + radius * std,
    )


def sampled_cost(
    cost: Cost,
    belief: PayloadBelief,
    *,
    key: Array,
    count: int = 1000,
    probability: float = 0.95,
) -> UncertainCost:
    """Mean, standard deviation and quantile of samples; the worst case by search.

    The worst case is the greatest cost at `count` random points of the ellipsoid's surface, at the
    point that is worst to first order, and at the centre: a lower bound of the true one, which it
    meets for a cost that is linear in theta.

    Other arguments as for `linear_cost`. The same `key` gives the same samples for every grasp.

    Raises:
      ValueError: `probability` is not between 0 and 1.
    """
    radius = ellipsoid_radius(belief, probability)
    noise = jax.random.normal(key, (count, 10), dtype=belief.theta.dtype)
    samples = jax.vmap(cost)(payloads_at(belief, noise))
    uncertain = jnp.linalg.norm(belief.root, axis=0) > 0.0
    surface = jnp.where(uncertain, noise, 0.0)
    size = jnp.linalg.norm(surface, axis=1, keepdims=True)
    surface = radius * surface / jnp.where(size > 0.0, size, 1.0)
    searched = jax.vmap(cost)(payloads_at(belief, surface))
    return UncertainCost(
        mean=jnp.mean(samples, axis=0),
        std=jnp.std(samples, axis=0, ddof=1),
        quantile=jnp.quantile(samples, probability, axis=0),
        worst=jnp.maximum(jnp.max(searched, axis=0), _steepest(cost, belief, radius)),
    )


def _steepest(cost: Cost, belief: PayloadBelief, radius: Array) -> Array:
    """The greater of the costs at the centre and, for each, where it rises most to first order."""
    root = belief.root

    def of_noise(noise: Array) -> Array:
        return jnp.asarray(cost(from_log_cholesky(belief.theta + jnp.sum(root * noise, axis=1))))

    center = of_noise(jnp.zeros_like(belief.theta))
    slopes = jax.jacfwd(of_noise)(jnp.zeros_like(belief.theta)).reshape(-1, 10)
    size = jnp.linalg.norm(slopes, axis=1, keepdims=True)
    steps = radius * slopes / jnp.where(size > 0.0, size, 1.0)
    each = jax.vmap(lambda step: of_noise(step).ravel())(steps)
    return jnp.maximum(center, jnp.diagonal(each).reshape(center.shape))


def ellipsoid_radius(belief: PayloadBelief, probability: float) -> Float[Array, ""]:
    """Of the confidence ellipsoid, in standard deviations: as many degrees as are uncertain.

    Raises:
      ValueError: `probability` is not between 0 and 1.
    """
    if not 0.0 < probability < 1.0:
        raise ValueError(f"`probability` {probability} is not between 0 and 1")
    radii = jnp.sqrt(jnp.asarray([0.0, *stats.chi2.ppf(probability, range(1, 11))]))
    return radii.astype(belief.theta.dtype)[belief.rank.astype(jnp.int32)]


@struct.dataclass
class Regret:
    """What it costs to choose by estimates."""

    chosen: Int[Array, " s"]  # row chosen under each estimate; -1 where every grasp failed under it
    absolute: Float[Array, " s"]  # true cost of the chosen grasp less that of the best one
    relative: Float[Array, " s"]  # the same as a share of the best one's


def regret(estimated: Float[Array, "s n"], true: Float[Array, " n"]) -> Regret:
    """Regret of taking the grasp of least cost under each of s estimates of the payload.

    NaN and infinity are failed grasps: never chosen where the estimate shows it, and of infinite
    regret where only the truth does. With no choice, or no grasp that truly succeeds, it is NaN.

    Args:
      estimated: cost of each grasp under each estimate.
      true: cost of each grasp under the true payload, positive for `relative` to have a meaning.
    """
    usable = jnp.where(jnp.isfinite(estimated), estimated, jnp.inf)
    possible = jnp.any(jnp.isfinite(estimated), axis=1)
    chosen = jnp.argmin(usable, axis=1)
    truth = jnp.where(jnp.isfinite(true), true, jnp.inf)
    best = jnp.min(truth)
    decided = possible & jnp.isfinite(best)
    absolute = jnp.where(decided, truth[chosen] - jnp.where(decided, best, 0.0), jnp.nan)
    return Regret(jnp.where(possible, chosen, -1), absolute, absolute / best)
