"""Hypervolume against inclusion and exclusion, and against counted random points."""

import itertools

import numpy as np
import pytest

from mjx_inertia.pareto import approximate_hypervolume, hypervolume


def by_inclusion_exclusion(costs, reference):
    total = 0.0
    for size in range(1, len(costs) + 1):
        for some in itertools.combinations(costs, size):
            total -= (-1) ** size * np.prod(reference - np.max(some, axis=0))
    return total


@pytest.mark.parametrize("columns", [1, 2, 3, 4, 5])
def test_is_the_volume_of_the_union(columns):
    rng = np.random.default_rng(columns)
    costs = rng.uniform(size=(8, columns))
    costs[3] = costs[2]
    reference = np.full(columns, 1.0)
    expected = by_inclusion_exclusion(costs, reference)
    assert hypervolume(costs, reference) == pytest.approx(expected, rel=1e-12)


def test_larger_front_against_random_points():
    rng = np.random.default_rng(0)
    costs = np.abs(rng.normal(size=(40, 5)))
    costs /= np.linalg.norm(costs, axis=1, keepdims=True)
    points = rng.uniform(size=(100_000, 5))
    inside = np.zeros(len(points), dtype=bool)
    for cost in costs:
        inside |= np.all(points > cost, axis=1)
    assert hypervolume(costs, np.ones(5)) == pytest.approx(inside.mean(), abs=6e-3)


@pytest.mark.parametrize("columns", [2, 5, 9])
def test_approximation_of_costs_in_different_units(columns):
    rng = np.random.default_rng(columns)
    unit = 10.0 ** rng.uniform(-6.0, 6.0, columns)
    costs = np.append(rng.uniform(0.1, 1.0, (10, columns)), np.full((1, columns), 1.2), 0) * unit
    expected = by_inclusion_exclusion(costs[:10], unit)
    found = approximate_hypervolume(costs, unit)
    assert found == pytest.approx(expected, rel=1e-2)
    assert found == approximate_hypervolume(costs, unit)
    assert approximate_hypervolume(costs[10:], unit) == 0.0


def test_rows_beyond_the_reference_and_failed_ones_add_nothing():
    costs = np.array([[0.2, 0.3], [0.1, 1.5], [np.nan, 0.0], [np.inf, 0.0], [0.4, 0.4]])
    assert hypervolume(costs, np.ones(2)) == pytest.approx(0.8 * 0.7)
    assert hypervolume(costs[1:4], np.ones(2)) == 0.0


def test_bad_input():
    with pytest.raises(ValueError, match="`reference`"):
        hypervolume(np.zeros((2, 2)), np.array([1.0, np.inf]))
    with pytest.raises(ValueError, match="infinite"):
        hypervolume(np.array([[-np.inf, 0.0]]), np.ones(2))
