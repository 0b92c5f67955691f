"""Crossover and mutation against the densities that define them, and within bounds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.search.variation import (
    VariationSettings,
    children,
    differential,
    polynomial_mutation,
    sbx,
)

N = 20_001
ETA = 15.0


def even():
    return (jnp.arange(N) + 0.5) / N


def full(value):
    return jnp.full(N, value)


def box(low=0.0, high=1.0):
    return full(low), full(high)


def test_sbx_keeps_the_mean_far_from_bounds():
    one, two = sbx(full(0.3), full(0.2), even(), box(-100.0, 100.0), ETA)
    np.testing.assert_allclose(one + two, 0.5, atol=1e-12)
    assert np.all(one >= two)  # the child of the greater parent is the greater


@pytest.mark.parametrize("ratio", [0.8, 0.95, 1.05, 1.2])
def test_sbx_has_its_density(ratio):
    # 0.5 (η + 1) β^η below 1 and 0.5 (η + 1) / β^(η + 2) above, integrated
    one, two = sbx(full(0.2), full(0.3), even(), box(-100.0, 100.0), ETA)
    below = np.mean(np.asarray(two - one) / 0.1 <= ratio)
    known = 0.5 * ratio ** (ETA + 1) if ratio < 1 else 1.0 - 0.5 * ratio ** -(ETA + 1)
    assert below == pytest.approx(known, abs=2.0 / N)


@pytest.mark.parametrize("room", [0.3, 0.6, 1.0])
def test_polynomial_mutation_has_its_density(room):
    # 0.5 (η + 1) (1 - |δ|)^η, integrated; beyond half the box nothing is left of it
    moved = polynomial_mutation(full(0.5), even(), box(), ETA)
    move = room * 0.1
    known = 1.0 - (1.0 - move) ** (ETA + 1)
    within = np.mean(np.abs(np.asarray(moved) - 0.5) <= move)
    assert within == pytest.approx(known, abs=1e-4)
    assert float(jnp.mean(moved)) == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize("where", [0.0, 1e-9, 0.02, 0.5, 1.0])
def test_children_stay_within_bounds(where):
    other = full(0.7)
    made = [
        *sbx(full(where), other, even(), box(), 2.0),
        polynomial_mutation(full(where), even(), box(), 2.0),
        differential(full(where), full(-0.4), even(), box(), 1.5),
        differential(full(where), full(0.4), even(), box(), 1.5),
    ]
    for child in made:
        assert np.all((np.asarray(child) >= 0.0) & (np.asarray(child) <= 1.0))


def test_a_difference_is_added_or_cut_between_base_and_bound():
    inside = differential(full(0.4), full(0.2), even(), box(), 0.5)
    np.testing.assert_allclose(inside, 0.5)
    outside = differential(full(0.4), full(2.0), even(), box(), 0.5)
    np.testing.assert_allclose(outside, 0.4 + 0.6 * even(), atol=1e-12)


def test_equal_parents_have_themselves_as_children():
    one, two = sbx(full(0.25), full(0.25), even(), box(), ETA)
    np.testing.assert_array_equal(one, 0.25)
    np.testing.assert_array_equal(two, 0.25)


def test_parents_are_rows_in_use():
    population, dimension = 30, 5
    rows = jnp.repeat(jnp.arange(population + 40.0)[:, None], dimension, axis=1)
    near = jnp.stack([jnp.arange(population), (jnp.arange(population) + 1) % population], axis=1)
    settings = VariationSettings(crossover_rate=0.0, mutations=0.0)  # a child is its first parent
    elites = jnp.array([0, 1, 2, 40])

    @jax.jit
    @jax.vmap
    def made(count):
        elite = (rows[population:], count)
        box = (jnp.zeros(dimension), jnp.full(dimension, 100.0))
        owners = (jnp.arange(population), near)
        return children(rows[:population], elite, owners, box, settings, key=jax.random.key(0))

    parents = np.asarray(made(elites)[..., 0])
    assert np.all(parents[:2] < population)  # one row of an archive is no pair
    for count, parent in zip((2, 40), parents[2:], strict=True):
        assert np.mean(parent >= population) > 0.5
        assert np.all(parent < population + count)
