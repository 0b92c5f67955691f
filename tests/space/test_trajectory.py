"""Joint motions of Eqs 7.12 to 7.15 against the equations written out, ends and limits."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.space import BOUND
from mjx_inertia.space.trajectory import joint_motion, phase

DURATION = 50.0
LOWER, UPPER = np.array([-3.0, -1.0, 0.2]), np.array([3.0, 2.5, 0.9])
START, END = np.array([1.4, -0.9, 0.3]), np.array([-0.7, 2.4, 0.899])
TAU = np.linspace(0.0, 1.0, 101)


def motion(coefficients, tau=TAU, start=START):
    return joint_motion(
        tau, DURATION, (jnp.asarray(start), jnp.asarray(END)), (LOWER, UPPER), coefficients
    )


@pytest.fixture(scope="module")
def decisions():
    rng = np.random.default_rng(0)
    some = rng.uniform(-BOUND, BOUND, (200, 3, 2))
    extreme = 100.0 * BOUND * rng.choice([-1.0, 1.0], (100, 3, 2))
    return np.concatenate([some, extreme])


@pytest.fixture(scope="module")
def motions(decisions):
    with jax.enable_x64(True):
        return jax.tree.map(np.asarray, jax.jit(jax.vmap(motion))(decisions))


def test_from_rest_to_rest(decisions, motions):
    np.testing.assert_allclose(motions.q[:, 0], np.tile(START, (300, 1)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(motions.q[:200, -1], np.tile(END, (200, 1)), rtol=0, atol=1e-9)
    ends = (motions.qd[:200, [0, -1]], motions.qdd[:200, [0, -1]])
    assert max(np.max(np.abs(x)) for x in ends) < 1e-9


def test_limits_hold_whatever_the_coefficients(motions):
    assert np.all(motions.q >= LOWER - 1e-12) and np.all(motions.q <= UPPER + 1e-12)
    assert np.any(motions.q > UPPER - 1e-3) and np.any(motions.q < LOWER + 1e-3)


def written_out(t, p, q):
    """Eq. 7.12 with the λ of Eq. 7.15 as errata 25 corrects them."""
    half, middle = (UPPER - LOWER) / 2.0, (UPPER + LOWER) / 2.0
    first, last = np.arcsin((START - middle) / half), np.arcsin((END - middle) / half)
    way, t_f = last - first, DURATION
    powers = [
        (3, (10.0 * way - p - 3.0 * q) / t_f**3),
        (4, (-15.0 * way + 3.0 * p + 8.0 * q) / t_f**4),
        (5, (6.0 * way - 3.0 * p - 6.0 * q) / t_f**5),
        (6, p / t_f**6),
        (7, q / t_f**7),
    ]
    return half * jnp.sin(first + sum(factor * t**power for power, factor in powers)) + middle


def test_the_equations_written_out_and_their_derivatives(decisions, motions):
    """Positions by the λ as errata 25 corrects them; rates by automatic differentiation."""

    def state(t, p, q):
        def rate(t):
            return jax.jvp(lambda t: written_out(t, p, q), (t,), (jnp.ones_like(t),))

        (position, speed), (_, gain) = jax.jvp(rate, (t,), (jnp.ones_like(t),))
        return position, speed, gain

    each = jax.jit(jax.vmap(jax.vmap(state, (0, None, None)), (None, 0, 0)))
    found = each(TAU * DURATION, decisions[:200, :, 0], decisions[:200, :, 1])
    for ours, wanted in zip((motions.q, motions.qd, motions.qdd), found, strict=True):
        np.testing.assert_allclose(ours[:200], wanted, rtol=0, atol=1e-11)


def test_no_coefficients_give_the_straight_quintic(motions):
    zero = motion(jnp.zeros((3, 2)))
    share = TAU[:, None] ** 3 * (10.0 - 15.0 * TAU[:, None] + 6.0 * TAU[:, None] ** 2)
    first, last = (np.asarray(phase(jnp.asarray(q), LOWER, UPPER)) for q in (START, END))
    wanted = (LOWER + UPPER) / 2 + (UPPER - LOWER) / 2 * np.sin(first + share * (last - first))
    np.testing.assert_allclose(np.asarray(zero.q), wanted, rtol=0, atol=1e-13)


def test_outside_the_limits_nothing_is_a_number():
    beyond = np.array([3.1, -0.9, 0.3])
    found = motion(jnp.zeros((3, 2)), start=beyond)
    assert np.all(np.isnan(np.asarray(found.q)[:, 0]))
    assert np.all(np.isfinite(np.asarray(found.q)[:, 1:]))
