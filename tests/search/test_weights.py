"""Lattices by count and sum, and single costs by hand."""

import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.search.decomposition import (
    DECOMPOSITIONS,
    boundary_intersection,
    decomposition,
    lattice_size,
    nearest_weights,
    simplex_lattice,
    spread_weights,
    tchebycheff,
    two_layer_lattice,
    weighted_sum,
)


@pytest.mark.parametrize(("costs", "divisions", "count"), [(2, 99, 100), (3, 12, 91), (9, 3, 165)])
def test_lattice_has_every_multiple_once(costs, divisions, count):
    weights = simplex_lattice(costs, divisions)
    assert weights.shape == (count, costs)
    assert lattice_size(costs, divisions) == count
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    parts = weights * divisions
    np.testing.assert_allclose(parts, np.round(parts), atol=1e-12)
    assert len(np.unique(np.round(parts).astype(int), axis=0)) == count
    assert weights.min() == 0.0


def test_second_layer_lies_within():
    weights = two_layer_lattice(9, 3, 2)
    assert weights.shape == (210, 9)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert weights[165:].min() == pytest.approx(0.5 / 9)


@pytest.mark.parametrize(("costs", "at_most", "count"), [(1, 5, 1), (2, 100, 100), (3, 100, 91)])
def test_largest_lattice_that_fits(costs, at_most, count):
    assert spread_weights(costs, at_most).shape == (count, costs)


def test_many_costs_have_two_layers():
    assert len(spread_weights(9, 250)) == 210
    assert len(spread_weights(9, 54)) == 54
    assert len(spread_weights(9, 53)) == 9


def test_nearest_are_itself_and_the_neighbours():
    near = nearest_weights(simplex_lattice(2, 10), 3)
    np.testing.assert_array_equal(near[:, 0], np.arange(11))
    np.testing.assert_array_equal(np.sort(near[5]), [4, 5, 6])


def test_bad_sizes():
    with pytest.raises(ValueError, match="3 costs; allow at least 3"):
        spread_weights(3, 2)
    with pytest.raises(ValueError, match="`divisions` 0"):
        simplex_lattice(2, 0)
    with pytest.raises(ValueError, match="`count` 12"):
        nearest_weights(simplex_lattice(2, 10), 12)
    with pytest.raises(ValueError, match="`decomposition` 'pbi'"):
        decomposition("pbi")


COSTS = jnp.array([3.0, 5.0])
IDEAL = jnp.array([1.0, 1.0])
SCALE = jnp.array([2.0, 4.0])  # so z = (1, 1)


def test_single_costs_by_hand():
    weight = jnp.array([0.8, 0.2])
    # the ratios are 1.25 and 5
    assert tchebycheff(COSTS, weight, IDEAL, SCALE) == pytest.approx(5.0 + 1e-3 * 3.125)
    assert weighted_sum(COSTS, weight, IDEAL, SCALE) == pytest.approx(1.0)
    along = 1.0 / np.sqrt(0.68)
    off = np.sqrt(2.0 - along**2)
    known = along + 5.0 * off
    assert boundary_intersection(COSTS, weight, IDEAL, SCALE) == pytest.approx(known)


@pytest.mark.parametrize("name", sorted(DECOMPOSITIONS))
def test_units_do_not_matter_and_less_is_better(name):
    single, weight = decomposition(name), jnp.array([0.3, 0.7])
    unit = jnp.array([1e3, 1e-2])
    value = single(COSTS, weight, IDEAL, SCALE)
    assert single(COSTS * unit, weight, IDEAL * unit, SCALE * unit) == pytest.approx(float(value))
    assert single(0.5 * (COSTS - IDEAL) + IDEAL, weight, IDEAL, SCALE) < value


@pytest.mark.parametrize("name", ["tchebycheff", "boundary_intersection"])
def test_the_best_of_a_front_lies_in_the_direction_of_the_weight(name):
    single, weight = decomposition(name), jnp.array([0.3, 0.7])
    angle = np.linspace(0.0, np.pi / 2, 2001)
    front = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    values = [float(single(jnp.asarray(c), weight, jnp.zeros(2), jnp.ones(2))) for c in front[::20]]
    best = front[::20][int(np.argmin(values))]
    np.testing.assert_allclose(best / best.sum(), weight, atol=0.01)
