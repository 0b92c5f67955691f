"""What an archive keeps, against peeling all rows off by the definition."""

import functools

import jax
import jax.numpy as jnp
import moocore
import numpy as np
import pytest

from mjx_inertia.search import ArchiveSettings, Evaluation
from mjx_inertia.search.archive import empty_archive, update_archive
from mjx_inertia.search.decomposition import simplex_lattice

WEIGHTS = simplex_lattice(3, 12)


@functools.partial(jax.jit, static_argnames="settings")
def filled(decisions, found, settings):
    """Adds batch after batch."""
    start = empty_archive(settings, decisions[0, 0], found.costs.shape[2])

    def one(archive, batch):
        return update_archive(archive, *batch, WEIGHTS, settings), archive.costs

    return jax.lax.scan(one, start, (decisions, found))


def batches(count=8, rows=50, columns=3):
    rng = np.random.default_rng(3)
    costs = np.abs(rng.normal(size=(count, rows, columns)))
    costs *= rng.uniform(1.0, 1.3, (count, rows, 1)) / np.linalg.norm(costs, axis=2, keepdims=True)
    costs[:, ::7] = costs[:, :1]  # some are equal
    violation = np.where(rng.uniform(size=(count, rows)) < 0.1, 0.5, 0.0)
    violation[:, 3] = np.inf
    costs[:, 3] = np.inf
    costs[:, 4, 0] *= 1e-9  # not allowed, and better than the rest
    violation[:, 4] = 1e-9
    return jnp.asarray(costs), jnp.asarray(violation)


def used(archive):
    rows = np.asarray(archive.violation) == 0.0
    assert np.all(np.isinf(np.asarray(archive.costs)[~rows]))
    return np.asarray(archive.decisions)[rows], np.asarray(archive.costs)[rows]


def test_large_archive_is_the_front_of_all_allowed_rows():
    costs, violation = batches()
    settings = ArchiveSettings(capacity=400, least_trade_off=0.0)
    archive, _ = filled(costs, Evaluation(costs, violation), settings)
    decisions, kept = used(archive)
    allowed = np.asarray(costs).reshape(-1, 3)[np.asarray(violation).ravel() == 0.0]
    known = np.unique(allowed[moocore.is_nondominated(allowed, keep_weakly=True)], axis=0)
    np.testing.assert_array_equal(np.unique(kept, axis=0), known)
    assert len(kept) == len(known)  # equal rows once
    np.testing.assert_array_equal(decisions, kept)  # each with its own decision


@pytest.mark.parametrize("directions", [False, True])
def test_small_archive_is_full_and_even(directions):
    rng = np.random.default_rng(0)
    costs = np.abs(rng.normal(size=(12, 80, 3))) ** np.array([1.0, 1.0, 3.0])  # crowded at f3 = 0
    costs /= np.linalg.norm(costs, axis=2, keepdims=True)
    found = Evaluation(jnp.asarray(costs), jnp.zeros((12, 80)))
    settings = ArchiveSettings(capacity=91, directions=directions)
    archive, _ = filled(found.costs, found, settings)
    _, kept = used(archive)
    assert len(kept) == 91

    def gap(rows):
        apart = np.linalg.norm(rows[:, None] - rows, axis=2) + 9.0 * np.eye(len(rows))
        return np.median(apart.min(axis=1))

    assert gap(kept) > 2.0 * gap(costs.reshape(-1, 3)[:91])
    if directions:  # most weights of the lattice have a row of their own
        units = WEIGHTS / np.linalg.norm(WEIGHTS, axis=1, keepdims=True)
        assert len(np.unique(np.argmax(kept @ units.T, axis=1))) >= 80


def test_a_row_hardly_better_in_one_cost_and_far_worse_in_another_goes():
    front = np.stack([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)], axis=1)
    costs = np.concatenate([front, [[-1e-4, 5.0]]])[None, :, :]
    costs = jnp.asarray(np.concatenate([costs, costs]))
    found = Evaluation(costs, jnp.zeros(costs.shape[:2]))
    for trade_off, greatest in [(0.0, 5.0), (0.01, 1.0)]:
        settings = ArchiveSettings(capacity=40, least_trade_off=trade_off)
        archive, _ = filled(costs, found, settings)
        assert used(archive)[1].max() == pytest.approx(greatest)


def test_no_capacity():
    with pytest.raises(ValueError, match="`capacity` 0"):
        empty_archive(ArchiveSettings(capacity=0), jnp.zeros(2), 2)
