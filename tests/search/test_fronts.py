"""Fronts, knee, hypervolume and distance, by definitions written out in NumPy."""

import itertools

import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.search.fronts import (
    NONE,
    approximate_hypervolume,
    dominates,
    hypervolume,
    inverted_generational_distance,
    knee,
    pareto_set,
)

pytestmark = pytest.mark.float64


def table():
    rng = np.random.default_rng(3)
    costs = rng.uniform(1.0, 2.0, size=(200, 4))
    costs[::7, 1] = np.nan
    costs[::11, 2] = np.inf
    costs[5] = -np.inf  # not a cost: failed
    costs[::7, 0] = 0.0  # best, had they not failed elsewhere
    return costs


def front_by_definition(costs):
    costs = np.where(np.isfinite(costs).all(axis=1)[:, None], costs, np.nan)
    return [
        i
        for i, row in enumerate(costs)
        if not np.isnan(row).any()
        and not any(np.all(other <= row) and np.any(other < row) for other in costs)
    ]


@pytest.mark.parametrize("columns", [None, (0, 2), (1,)])
def test_pareto_set_over_any_columns(columns):
    costs = table()
    chosen = costs if columns is None else costs[:, columns]
    assert pareto_set(costs, columns).tolist() == front_by_definition(chosen)


@pytest.mark.parametrize("kind", ["equal rows", "chain", "one front"])
def test_pareto_set_of_tables_with_many_ties_or_none(kind):
    costs = np.random.default_rng(7).normal(size=(300, 3))
    if kind == "equal rows":
        costs = np.round(costs)
    if kind == "chain":
        costs = np.sort(costs[:, :1], axis=0) + np.zeros(3)
    if kind == "one front":
        costs = np.abs(costs) / np.linalg.norm(costs, axis=1, keepdims=True)
    assert pareto_set(costs).tolist() == front_by_definition(costs)


def test_dominance_is_a_strict_partial_order():
    costs = jnp.asarray(np.round(np.random.default_rng(7).normal(size=(80, 3))))
    beats = np.asarray(dominates(costs, costs))
    assert not np.any(np.diagonal(beats))
    assert not np.any(beats & beats.T)
    assert np.all(beats[(beats.astype(int) @ beats.astype(int)) > 0])


def test_scale_of_a_metric_does_not_matter():
    costs = table()
    scaled = costs * np.array([1e3, 1e-3, 1.0, 7.0]) + 5.0
    assert knee(costs, (0, 2)) == knee(scaled, (0, 2))


def test_knee_of_a_bent_front():
    t = np.linspace(0.0, 1.0, 101)
    front = np.stack([t, (1.0 - t**0.5) ** 2], axis=1)  # √x + √y = 1 is nearest to 0 at x = y
    rows = knee(np.concatenate([front + 0.5, front]))
    assert rows == 101 + 25


def test_nothing_succeeded():
    costs = np.full((3, 2), np.nan)
    assert knee(costs) == NONE
    assert len(pareto_set(costs)) == 0


def test_unknown_columns():
    with pytest.raises(ValueError, match="`columns`"):
        pareto_set(table(), (4,))
    with pytest.raises(ValueError, match="`columns`"):
        pareto_set(table(), ())


def by_inclusion_exclusion(costs, reference):
    total = 0.0
    for size in range(1, len(costs) + 1):
        for some in itertools.combinations(costs, size):
            total -= (-1) ** size * np.prod(reference - np.max(some, axis=0))
    return total


@pytest.mark.parametrize("columns", [1, 2, 3, 4, 5])
def test_hypervolume_is_the_volume_of_the_union(columns):
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


def test_bad_hypervolume_input():
    with pytest.raises(ValueError, match="`reference`"):
        hypervolume(np.zeros((2, 2)), np.array([1.0, np.inf]))
    with pytest.raises(ValueError, match="infinite"):
        hypervolume(np.array([[-np.inf, 0.0]]), np.ones(2))


def test_distance_is_the_mean_of_the_least_distances():
    rng = np.random.default_rng(0)
    costs, front = rng.normal(size=(30, 4)), rng.normal(size=(50, 4))
    known = np.linalg.norm(front[:, None] - costs, axis=2).min(axis=1).mean()
    assert inverted_generational_distance(costs, front) == pytest.approx(known, rel=1e-12)


def test_failed_rows_are_left_out_of_the_distance():
    front = np.array([[0.0, 1.0], [1.0, 0.0]])
    costs = np.array([[np.inf, np.inf], [np.nan, 0.0], [0.0, 1.0]])
    assert inverted_generational_distance(costs, front) == pytest.approx(np.sqrt(2.0) / 2.0)
    assert inverted_generational_distance(costs[:2], front) == np.inf


def test_bad_front():
    with pytest.raises(ValueError, match="`front`"):
        inverted_generational_distance(np.zeros((1, 2)), np.zeros((0, 2)))
