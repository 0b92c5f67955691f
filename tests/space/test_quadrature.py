"""Integrals, interpolation and attitude from few samples, against closed forms and SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from mjx_inertia.space.base_attitude import attitude, attitudes
from mjx_inertia.space.quadrature import (
    gauss_legendre,
    integrate,
    interpolation_matrix,
    unresolved,
)

FINE = np.linspace(0.0, 1.0, 20001)


@pytest.mark.parametrize("count", [8, 24, 32])
def test_integrals_are_exact_for_polynomials(count):
    rule = gauss_legendre(count)
    assert abs(rule.weights.sum() - 1.0) < 1e-14
    degrees = np.arange(2 * count)
    signal = jnp.asarray(rule.nodes[:, None] ** degrees)
    found = integrate(signal, rule, 7.0)
    np.testing.assert_allclose(found, 7.0 / (degrees + 1.0), rtol=1e-12)
    # the next degree is the first that it misses
    missed = 1.0 / (2 * count + 1.0) - rule.weights @ rule.nodes ** (2 * count)
    assert missed > 0.0 or count > 12


def test_values_between_the_nodes_are_exact_for_polynomials():
    rng = np.random.default_rng(0)
    at = (*rng.uniform(0.0, 1.0, 50).tolist(), 0.0, 1.0)
    factors = rng.normal(size=(16, 3))
    matrix = interpolation_matrix(16, at)
    wanted = np.polynomial.legendre.legval(2.0 * np.array(at) - 1.0, factors).T
    samples = np.polynomial.legendre.legval(2.0 * gauss_legendre(16).nodes - 1.0, factors).T
    np.testing.assert_allclose(matrix @ samples, wanted, rtol=0, atol=1e-12)
    np.testing.assert_allclose(matrix.sum(1), 1.0, rtol=0, atol=1e-12)


SIGNALS = {
    **{f"wave of {k}": (lambda t, k=k: np.sin(k * t + 0.3)) for k in (5, 20, 30, 40, 50)},
    "sine of a polynomial": lambda t: np.sin(20.0 * t**3 * (1.0 - t) + 10.0 * t**7),
    "pole nearby": lambda t: 1.0 / (1.0 + 60.0 * (t - 0.4) ** 2),
    "corner": lambda t: np.abs(t - 0.43),
    "jump": lambda t: np.sign(t - 0.61),
}


@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("count", [16, 32])
def test_unresolved_bounds_the_error_of_a_norm(name, count):
    """Of the norm that costs take, for smooth signals and for rough ones."""
    rule, signal = gauss_legendre(count), SIGNALS[name]
    found = jnp.sqrt(integrate(jnp.asarray(signal(rule.nodes)) ** 2, rule, 1.0))
    true = np.sqrt(np.trapezoid(signal(FINE) ** 2, FINE))
    bound = float(unresolved(jnp.asarray(signal(rule.nodes))[:, None], rule))
    assert abs(float(found) / true - 1.0) < bound + 1e-8


@pytest.mark.parametrize("name", SIGNALS)
def test_unresolved_tells_smooth_from_rough(name):
    """The error in between is at most a few times what it says."""
    rule, signal = gauss_legendre(32), SIGNALS[name]
    values = interpolation_matrix(32, tuple(FINE[::10].tolist())) @ signal(rule.nodes)
    error = np.sqrt(np.mean((values - signal(FINE[::10])) ** 2) / np.mean(signal(FINE) ** 2))
    bound = float(unresolved(jnp.asarray(signal(rule.nodes))[:, None], rule))
    assert error < 5.0 * bound + 1e-12, (error, bound)


def test_a_signal_of_nothing_is_resolved():
    assert float(unresolved(jnp.zeros((16, 2)), gauss_legendre(16))) == 0.0


def coning(a, b, t):
    """Angular velocity (own axes) and final attitude of a body at R_z(a t) R_x(b t)."""
    omega = np.stack([b * np.ones_like(t), a * np.sin(b * t), a * np.cos(b * t)], -1)
    return omega, Rotation.from_rotvec([0.0, 0.0, a * t[-1]]) * Rotation.from_rotvec(
        [b * t[-1], 0.0, 0.0]
    )


def attitude_error(a, b, count=64):
    nodes = gauss_legendre(count).nodes
    omega, final = coning(a, b, np.append(nodes, 1.0))
    with jax.enable_x64(True):
        found = np.asarray(attitude(jnp.asarray(omega[:-1] / 4.0), 4.0))
    return np.max(np.abs(found - final.as_matrix()))


def test_attitude_of_a_body_that_precesses():
    assert attitude_error(1.0, 1.5) < 1e-13 and attitude_error(3.0, 5.0) < 1e-9
    assert attitude_error(0.0, 2.0) < 1e-13 and attitude_error(0.0, 0.0) == 0.0


def test_attitude_is_of_sixth_order():
    """At a fixed number of steps the error falls with the seventh power of the angle of a step."""
    fast, slow = attitude_error(48.0, 40.0), attitude_error(24.0, 20.0)
    assert 6.5 < np.log2(fast / slow) < 8.5, (fast, slow)


def wandering(t):
    """No closed form: rad/s."""
    return np.stack([np.sin(3.0 * t + 0.5), 1.5 * np.cos(0.6 * t * t), 0.7 + 0.2 * t * t], -1)


def test_attitude_against_scipy_and_at_any_times():
    duration, at = 2.5, np.array([0.0, 0.37, 0.9, 1.0])

    def slope(t, R):
        x, y, z = wandering(t)
        return (R.reshape(3, 3) @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])).ravel()

    reference = solve_ivp(
        slope, (0.0, duration), np.eye(3).ravel(), "DOP853", at * duration, rtol=1e-13, atol=1e-13
    )
    omega = jnp.asarray(wandering(gauss_legendre(48).nodes * duration))
    found = np.asarray(attitudes(omega, duration, at))
    np.testing.assert_allclose(found, reference.y.T.reshape(-1, 3, 3), rtol=0, atol=1e-9)
    alone = np.asarray(attitudes(omega, duration, at[2:3]))
    # a time inside a step splits it, which moves what follows by that step's error
    np.testing.assert_allclose(alone[0], found[2], rtol=0, atol=1e-10)
    orthogonal = np.swapaxes(found, 1, 2) @ found
    np.testing.assert_allclose(orthogonal, np.tile(np.eye(3), (4, 1, 1)), rtol=0, atol=1e-13)


def test_attitude_has_the_derivative_of_its_differences():
    omega = jnp.asarray(wandering(gauss_legendre(16).nodes))
    slope = jax.jit(jax.jacfwd(lambda k: attitude(k * omega, 2.0)))(1.0)
    ahead, behind = (np.asarray(attitude((1.0 + h) * omega, 2.0)) for h in (1e-5, -1e-5))
    np.testing.assert_allclose(slope, (ahead - behind) / 2e-5, rtol=0, atol=1e-8)
