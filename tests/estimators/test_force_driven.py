"""The step of a sliding body and the filter around it."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjx_inertia.estimators.force_driven.planar_step import friction_matrix, sliding_twist

pytestmark = pytest.mark.float64

MASS, INERTIA, RADIUS, FRICTION = 1.5, 0.004, 0.05, 4.0
CREEP = 1e-5


@partial(jax.jit, static_argnames="creep")
def step(twist, wrench, h, size=1.0, lateral=0.0, creep=CREEP):
    mass_matrix = jnp.diag(jnp.array([MASS, MASS, INERTIA]))
    friction = friction_matrix(jnp.asarray(RADIUS), jnp.asarray(size), jnp.asarray(lateral))
    return sliding_twist(
        jnp.asarray(twist, float),
        jnp.asarray(wrench, float),
        mass_matrix,
        jnp.asarray(FRICTION),
        jnp.asarray(RADIUS),
        friction,
        jnp.asarray(h),
        creep,
    )


def test_a_body_that_slides_straight_loses_friction_over_mass():
    after = step([0.2, 0.0, 0.0], [6.0, 0.0, 0.0], 0.01)
    assert float(after[0]) == pytest.approx(0.2 + 0.01 * (6.0 - FRICTION) / MASS, rel=1e-6)


@pytest.mark.parametrize("wrench", [(3.9, 0.0, 0.0), (0.0, 0.0, 0.9 * RADIUS * FRICTION)])
def test_below_the_limit_surface_a_body_stays(wrench):
    twist = jnp.zeros(3)
    for _ in range(50):
        twist = step(twist, wrench, 0.01)
    assert np.abs(np.asarray(twist) * [1, 1, RADIUS]).max() < 30.0 * CREEP


@pytest.mark.parametrize("wrench", [(4.1, 0.0, 0.0), (0.0, 0.0, 1.02 * RADIUS * FRICTION)])
def test_above_it_moves(wrench):
    twist = jnp.zeros(3)
    for _ in range(50):
        twist = step(twist, wrench, 0.01)
    assert np.abs(np.asarray(twist) * [1, 1, RADIUS]).max() > 1e-2


def test_small_steps_agree_with_an_integrator_of_the_differential_equation():
    start, wrench = np.array([0.1, 0.05, 1.5]), np.array([5.0, -1.0, 0.1])

    def rate(_, v):
        size = np.sqrt(v[0] ** 2 + v[1] ** 2 + (RADIUS * v[2]) ** 2 + CREEP**2)
        load = wrench - FRICTION / size * np.array([v[0], v[1], RADIUS**2 * v[2]])
        return load / np.array([MASS, MASS, INERTIA])

    expected = solve_ivp(rate, (0.0, 0.2), start, rtol=1e-10, atol=1e-12).y[:, -1]
    twist = jax.lax.fori_loop(0, 2000, lambda _, v: step(v, wrench, 1e-4), jnp.asarray(start))
    np.testing.assert_allclose(twist, expected, rtol=2e-3)


@pytest.mark.parametrize("speed", [0.0, 1e-5, 1e-3, 0.1])
def test_the_derivative_is_that_of_finite_differences(speed):
    def moved(load):
        return step([speed, 0.0, 0.3 * speed], jnp.array([load, 0.5, 0.02]), 0.004, creep=1e-3)

    found = np.asarray(jax.jacfwd(moved)(3.0))
    reference = np.asarray((moved(3.0 + 1e-5) - moved(3.0 - 1e-5)) / 2e-5)
    np.testing.assert_allclose(found, reference, rtol=1e-4, atol=1e-9)


def test_lateral_friction_turns_the_path_and_does_no_work():
    straight = step([0.1, 0.0, 0.0], [FRICTION, 0.0, 0.0], 0.01)
    turned = step([0.1, 0.0, 0.0], [FRICTION, 0.0, 0.0], 0.01, lateral=0.2)
    assert float(straight[1]) == pytest.approx(0.0, abs=1e-12)
    assert float(turned[1]) < 0.0
