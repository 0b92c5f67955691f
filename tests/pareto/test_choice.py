"""Choosing: failed rows never, and the rest by definitions written out in NumPy."""

import jax
import numpy as np
import pytest

from mjx_inertia.pareto import (
    NONE,
    UNRANKED,
    best_per_metric,
    knee,
    normalised,
    pareto_ranks,
    pareto_set,
    weighted_choice,
)


@pytest.fixture(autouse=True)
def float64():
    with jax.enable_x64(True):
        yield


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
    rows = pareto_set(costs, columns)
    chosen = costs if columns is None else costs[:, columns]
    assert rows.tolist() == front_by_definition(chosen)
    ranks = pareto_ranks(costs, columns)
    assert np.array_equal(np.flatnonzero(ranks == 0), rows)
    assert np.array_equal(ranks == UNRANKED, ~np.isfinite(chosen).all(axis=1))


def test_best_per_metric_and_weighted_choice():
    costs = table()
    best = np.asarray(jax.jit(best_per_metric)(costs))
    valid = np.where(np.isfinite(costs), costs, np.inf)
    np.testing.assert_array_equal(best, valid.argmin(axis=0))
    chosen = int(jax.jit(weighted_choice)(costs, np.array([1.0, 2.0, 0.5, 0.0])))
    alive = np.isfinite(costs[:, :3]).all(axis=1)
    part = costs[:, :3]
    low, high = part[alive].min(axis=0), part[alive].max(axis=0)
    total = np.where(alive, ((part - low) / (high - low)) @ [1.0, 2.0, 0.5], np.inf)
    assert chosen == total.argmin()


def test_weight_zero_ignores_failures_of_its_metric():
    costs = np.array([[1.0, np.nan], [2.0, 1.0]])
    assert int(weighted_choice(costs, np.array([1.0, 0.0]))) == 0
    assert int(weighted_choice(costs, np.array([1.0, 1.0]))) == 1


def test_scale_of_a_metric_does_not_matter():
    costs = table()
    scaled = costs * np.array([1e3, 1e-3, 1.0, 7.0]) + 5.0
    weights = np.ones(4)
    assert int(weighted_choice(costs, weights)) == int(weighted_choice(scaled, weights))
    assert knee(costs, (0, 2)) == knee(scaled, (0, 2))
    np.testing.assert_allclose(normalised(costs), normalised(scaled), atol=1e-4)


def test_knee_of_a_bent_front():
    t = np.linspace(0.0, 1.0, 101)
    front = np.stack([t, (1.0 - t**0.5) ** 2], axis=1)  # √x + √y = 1 is nearest to 0 at x = y
    rows = knee(np.concatenate([front + 0.5, front]))
    assert rows == 101 + 25


def test_nothing_succeeded():
    costs = np.full((3, 2), np.nan)
    assert np.all(np.asarray(best_per_metric(costs)) == NONE)
    assert int(weighted_choice(costs, np.ones(2))) == NONE
    assert knee(costs) == NONE
    assert len(pareto_set(costs)) == 0


def test_unknown_columns():
    with pytest.raises(ValueError, match="`columns`"):
        pareto_set(table(), (4,))
    with pytest.raises(ValueError, match="`columns`"):
        pareto_set(table(), ())
