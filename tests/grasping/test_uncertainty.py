"""Costs under an uncertain payload: closed forms, sampling against linear propagation, regret."""

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from scipy import stats

from mjx_inertia.grasping import (
    PayloadBelief,
    belief_of_push,
    belief_of_ten_numbers,
    draw_payloads,
    linear_cost,
    regret,
    sampled_cost,
)
from mjx_inertia.grasping.uncertainty import ellipsoid_radius
from mjx_inertia.objects import ShapeEstimate, TriangleMesh
from mjx_inertia.spatial import (
    Consistency,
    InertialParameters,
    PlanarInertia,
    change_frame,
    check_consistency,
    from_log_cholesky,
    to_log_cholesky,
)


def body():
    tensor = jnp.array([[2.0, 0.1, 0.0], [0.1, 2.5, 0.2], [0.0, 0.2, 1.8]]) * 1e-3
    return InertialParameters(jnp.asarray(0.8), jnp.array([0.02, -0.01, 0.05]), tensor)


def belief(scale=1.0, seed=0, rank=10):
    root = np.random.default_rng(seed).normal(size=(10, rank))
    root *= np.array([0.1, 0.1, 0.1, 0.1, 0.003, 0.003, 0.003, 0.01, 0.01, 0.01])[:, None]
    return PayloadBelief(to_log_cholesky(body()), jnp.asarray(scale**2 * root @ root.T / rank))


def torque(payload):
    """Of gravity about the origin, and the kinetic energy of a turn: not linear in theta."""
    moment = jnp.cross(payload.com, jnp.array([0.0, 0.0, -9.81]) * payload.mass)
    spin = jnp.array([1.0, 2.0, -0.5])
    return jnp.stack([jnp.sum(moment**2), spin @ payload.inertia @ spin])


@pytest.mark.long
def test_linear_cost_in_closed_form():
    some = belief()
    weights = jnp.arange(1.0, 11.0)

    def cost(payload):
        return to_log_cholesky(payload) @ weights

    for result in (
        jax.jit(lambda: linear_cost(cost, some))(),
        jax.jit(lambda: linear_cost(cost, some, second_order=True))(),
    ):
        std = np.sqrt(weights @ some.covariance @ weights)
        np.testing.assert_allclose(result.mean, some.theta @ weights, rtol=1e-9)
        np.testing.assert_allclose(result.std, std, rtol=1e-9)
        np.testing.assert_allclose(
            result.quantile, result.mean + stats.norm.ppf(0.95) * std, rtol=1e-6
        )
        worst = result.mean + np.sqrt(stats.chi2.ppf(0.95, 10)) * std
        np.testing.assert_allclose(result.worst, worst, rtol=1e-6)
    sampled = sampled_cost(cost, some, key=jax.random.key(0), count=2000)
    np.testing.assert_allclose(sampled.worst, worst, rtol=1e-6)


@pytest.mark.long
def test_quadratic_cost_in_closed_form():
    some = belief(seed=1)
    root = np.random.default_rng(2).normal(size=(10, 10))
    form = jnp.asarray(root @ root.T)

    def cost(payload):
        step = to_log_cholesky(payload) - some.theta
        return 1.0 + step @ form @ step

    result = linear_cost(cost, some, second_order=True)
    np.testing.assert_allclose(result.mean, 1.0 + jnp.trace(form @ some.covariance), rtol=1e-7)
    np.testing.assert_allclose(result.std, 0.0, atol=1e-7)


def test_sampled_meets_linear_as_the_covariance_shrinks():
    count = 20_000
    key = jax.random.key(1)

    @jax.jit
    def both(scale):
        some = belief(seed=3)
        some = some.replace(covariance=some.covariance * scale**2)
        linear = linear_cost(torque, some, second_order=True)
        return linear, sampled_cost(torque, some, key=key, count=count)

    for scale, tolerance in ((0.3, 0.08), (0.03, 0.03)):
        linear, sampled = both(scale)
        noise = 4.0 * linear.std / np.sqrt(count)
        bend = 0.02 * scale * linear.std  # third order
        assert np.all(np.abs(sampled.mean - linear.mean) <= noise + bend)
        np.testing.assert_allclose(sampled.std, linear.std, rtol=tolerance)
        excess = np.asarray((sampled.quantile - linear.quantile) / linear.std)
        assert np.all(np.abs(excess) <= 1.65 * 2.0 * tolerance)
        reach = np.asarray((sampled.worst - linear.mean) / (linear.worst - linear.mean))
        assert np.all(reach >= 0.97) and np.all(reach <= 1.0 + 10.0 * tolerance)


def test_draws_are_bodies_that_can_exist():
    wide = belief(scale=10.0)
    bodies = draw_payloads(wide, 1000, key=jax.random.key(0))
    status = jax.jit(jax.vmap(check_consistency))(bodies)
    assert np.all(np.asarray(status) <= Consistency.ON_BOUNDARY)
    again = draw_payloads(wide, 1000, key=jax.random.key(0))
    np.testing.assert_array_equal(bodies.mass, again.mass)


@pytest.mark.parametrize("rank", [0, 1, 4, 10])
def test_singular_covariances(rank):
    some = belief(rank=max(rank, 1), scale=1.0 if rank else 0.0)
    radius = float(ellipsoid_radius(some, 0.9))
    expected = np.sqrt(stats.chi2.ppf(0.9, rank)) if rank else 0.0
    assert radius == pytest.approx(expected, rel=1e-6)
    np.testing.assert_allclose(some.root @ some.root.T, some.covariance, atol=1e-14)
    # rounding has made it slightly indefinite
    worse = some.replace(covariance=some.covariance - 1e-18 * jnp.eye(10))
    for result in (
        linear_cost(torque, worse),
        sampled_cost(torque, worse, key=jax.random.key(0), count=50),
    ):
        assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(result))


def test_belief_of_ten_numbers_in_another_frame():
    pose = jaxlie.SE3.exp(jnp.array([0.1, -0.2, 0.3, 0.4, 0.5, -0.6]))
    std = np.array([0.02, *[1e-3] * 3, *[3e-5] * 6])
    some = belief_of_ten_numbers(body(), np.diag(std**2), pose)
    moved = change_frame(body(), pose)
    np.testing.assert_allclose(some.center.com, moved.com, atol=1e-12)
    np.testing.assert_allclose(some.center.inertia, moved.inertia, atol=1e-12)
    mass = linear_cost(lambda payload: payload.mass, some)
    assert float(mass.std) == pytest.approx(0.02, rel=1e-9)
    # the CoM's ball of uncertainty turns into itself
    com = linear_cost(lambda payload: payload.com, some)
    np.testing.assert_allclose(com.std, 1e-3, rtol=1e-9)


def shape_of(inertial, std):
    theta = np.asarray(to_log_cholesky(inertial))
    surface = TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    covariance = np.diag(np.full(10, std**2))
    return ShapeEstimate(theta, covariance, np.zeros(3), 1.0, surface)


def test_belief_of_push_follows_whichever_is_surer():
    volume = body().replace(mass=jnp.asarray(1e-3), inertia=body().inertia * 1e-3 / 0.8)
    shape = shape_of(volume, 1e-6)
    off = jnp.array([0.02, -0.01]) + jnp.array([0.004, 0.0])  # the mass lies aside
    pushed = PlanarInertia(jnp.asarray(0.8), body().inertia[2, 2], off)
    sure = np.diag([0.008, 2e-5, 1e-4, 1e-4]) ** 2
    even = belief_of_push(pushed, sure, shape, unevenness=0.0)
    np.testing.assert_allclose(even.center.com, body().com, atol=1e-5)
    uneven = belief_of_push(pushed, sure, shape, unevenness=0.3)
    np.testing.assert_allclose(uneven.center.com[:2], off, atol=2e-5)
    np.testing.assert_allclose(uneven.center.com[2], body().com[2], atol=1e-5)
    mass = linear_cost(lambda payload: payload.mass, uneven)
    assert float(mass.mean) == pytest.approx(0.8, rel=1e-3)
    assert float(mass.std) == pytest.approx(0.008, rel=0.05)
    # the push says nothing of the height of the CoM
    com = linear_cost(lambda payload: payload.com, uneven)
    assert float(com.std[2]) > 50.0 * float(com.std[0])


def test_regret_by_hand():
    true = jnp.array([2.0, 1.0, 4.0, jnp.nan])
    estimated = jnp.array(
        [
            [3.0, 1.5, 9.0, jnp.nan],  # right
            [1.0, 1.5, jnp.nan, 9.0],  # the second best
            [jnp.nan, jnp.inf, 1.0, 2.0],
            [2.0, 2.0, 2.0, 0.0],  # fails in truth
            [jnp.nan] * 4,
        ]
    )
    result = regret(estimated, true)
    assert result.chosen.tolist() == [1, 0, 2, 3, -1]
    np.testing.assert_allclose(result.relative, [0.0, 1.0, 3.0, np.inf, np.nan])
    np.testing.assert_allclose(result.absolute[:3], [0.0, 1.0, 3.0])
    assert np.all(np.isnan(regret(estimated, jnp.full(4, jnp.nan)).relative))


def test_regret_vanishes_with_the_uncertainty():
    levers = jnp.linspace(-0.2, 0.2, 50)

    def costs(payload):
        return payload.mass * (0.05 + jnp.abs(payload.com[0] - levers))

    true = costs(body())
    medians = []
    for scale in (1.0, 0.1):
        bodies = draw_payloads(belief(scale=scale), 400, key=jax.random.key(5))
        medians.append(float(jnp.mean(regret(jax.vmap(costs)(bodies), true).relative)))
    assert medians[1] < 0.3 * medians[0]


def test_bad_input():
    with pytest.raises(ValueError, match="`probability`"):
        linear_cost(torque, belief(), probability=1.0)
    with pytest.raises(ValueError, match="boundary"):
        belief_of_ten_numbers(
            body().replace(inertia=jnp.diag(jnp.array([1.0, 1.0, 3.0]))), np.eye(10)
        )
    with pytest.raises(ValueError, match="`covariance`"):
        belief_of_ten_numbers(body(), np.full((10, 10), np.inf))
    with pytest.raises(ValueError, match="`unevenness`"):
        planar = PlanarInertia(jnp.asarray(1.0), jnp.asarray(1.0), jnp.zeros(2))
        belief_of_push(planar, np.eye(4), shape_of(body(), 0.1), unevenness=-1.0)
    assert from_log_cholesky(belief().theta).mass > 0.0
