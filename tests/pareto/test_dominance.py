"""Fronts against the definition, peeled off one by one, and against moocore."""

import jax
import jax.numpy as jnp
import moocore
import numpy as np
import pytest

from mjx_inertia.pareto import (
    UNRANKED,
    crowding_distance,
    dominates,
    is_non_dominated,
    non_dominated_ranks,
)

ranks_of = jax.jit(non_dominated_ranks)
first_front_of = jax.jit(is_non_dominated)
crowding_of = jax.jit(crowding_distance)


def table(kind, rows=300, columns=3):
    rng = np.random.default_rng(7)
    costs = rng.normal(size=(rows, columns))
    if kind == "duplicates":
        costs = np.round(costs)
    if kind == "infinities":
        costs = np.round(costs)
        costs[rng.uniform(size=costs.shape) < 0.1] = np.inf
        costs[rng.uniform(size=costs.shape) < 0.05] = -np.inf
    if kind == "chain":
        costs = np.sort(costs[:, :1], axis=0) + np.zeros(columns)
    if kind == "one front":
        costs = np.abs(costs) / np.linalg.norm(costs, axis=1, keepdims=True)
    return costs.astype(np.float32)


def peeled(costs):
    """Fronts by the definition."""
    smaller = np.all(costs[:, None] <= costs[None], axis=2) & np.any(costs[:, None] < costs, axis=2)
    ranks, left, front = np.full(len(costs), UNRANKED), np.ones(len(costs), dtype=bool), 0
    while left.any():
        best = left & ~np.any(smaller & left[:, None], axis=0)
        ranks[best], left, front = front, left & ~best, front + 1
    return ranks


@pytest.mark.parametrize("kind", ["plain", "duplicates", "infinities", "chain", "one front"])
def test_fronts_are_those_of_the_definition(kind):
    costs = table(kind)
    ranks = np.asarray(ranks_of(costs))
    np.testing.assert_array_equal(ranks, peeled(costs))
    np.testing.assert_array_equal(np.asarray(first_front_of(costs)), ranks == 0)


@pytest.mark.parametrize("kind", ["plain", "duplicates"])
def test_fronts_agree_with_moocore(kind):
    costs = table(kind)
    np.testing.assert_array_equal(ranks_of(costs), moocore.pareto_rank(costs.astype(np.float64)))


def test_a_chain_has_as_many_fronts_as_rows():
    ranks = np.asarray(ranks_of(table("chain")))
    np.testing.assert_array_equal(ranks, np.arange(300))


def test_rows_with_nan_take_no_part():
    costs = table("plain")
    holed = costs.copy()
    holed[::5, 1] = np.nan
    whole = ~np.isnan(holed).any(axis=1)
    ranks = np.asarray(ranks_of(holed))
    assert np.all(ranks[~whole] == UNRANKED)
    assert not np.any(np.asarray(first_front_of(holed))[~whole])
    np.testing.assert_array_equal(ranks[whole], peeled(costs[whole]))


def test_dominance_is_a_strict_partial_order():
    costs = jnp.asarray(table("duplicates", rows=80))
    beats = np.asarray(dominates(costs, costs))
    assert not np.any(np.diagonal(beats))
    assert not np.any(beats & beats.T)
    assert np.all(beats[(beats.astype(int) @ beats.astype(int)) > 0])


def crowding_by_definition(costs, ranks):
    total = np.zeros(len(costs))
    for front in range(ranks.max() + 1):
        rows = np.flatnonzero(ranks == front)
        for column in costs[rows].T:
            order = rows[np.argsort(column, kind="stable")]
            span = np.ptp(column)
            total[order[[0, -1]]] = np.inf
            for before, row, after in zip(order[:-2], order[1:-1], order[2:], strict=True):
                k = np.flatnonzero(rows == before)[0], np.flatnonzero(rows == after)[0]
                total[row] += (column[k[1]] - column[k[0]]) / span
    return total


def test_crowding_is_that_of_the_definition():
    costs = table("plain", rows=150)
    ranks = np.asarray(ranks_of(jnp.asarray(np.concatenate([costs, costs]))))[:150]
    expected = crowding_by_definition(costs.astype(np.float64), ranks)
    np.testing.assert_allclose(crowding_of(costs, ranks), expected, rtol=1e-5)


def test_crowding_leaves_out_unranked_rows_and_flat_costs():
    costs = jnp.array([[0.0, 5.0], [1.0, 5.0], [2.0, 5.0], [9.0, 9.0]])
    distance = np.asarray(crowding_of(costs, jnp.array([0, 0, 0, UNRANKED])))
    # in a flat cost too the rows at the ends are infinitely far
    assert np.isinf(distance[0]) and np.isinf(distance[2])
    np.testing.assert_allclose(distance[[1, 3]], [1.0, 0.0])
