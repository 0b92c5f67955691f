"""Metrics of grasps when the payload is known only as a distribution.

In: a cost as a function of the payload, and a `PayloadBelief`. Out: `UncertainCost` by linear
propagation or by sampling, and the regret of choosing by a wrong payload.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from flax import struct
from jax.scipy.stats import norm
from jaxtyping import Array, Float, Int
from scipy import stats

from mjx_inertia.grasping.payload_belief import PayloadBelief, payloads_at
from mjx_inertia.spatial import InertialParameters, from_log_cholesky

Cost = Callable[[InertialParameters], Float[Array, "*m"]]


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

    Args:
      cost: as for `linear_cost`; differentiable for the worst case.
      belief: of the payload.
      key: of the samples; the same key gives the same samples for every grasp.
      count: of samples.
      probability: of the quantile and of the ellipsoid.

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
