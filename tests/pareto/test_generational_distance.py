"""Distance to a front by hand and by all pairs."""

import numpy as np
import pytest

from mjx_inertia.pareto import inverted_generational_distance


def test_is_the_mean_of_the_least_distances():
    rng = np.random.default_rng(0)
    costs, front = rng.normal(size=(30, 4)), rng.normal(size=(50, 4))
    known = np.linalg.norm(front[:, None] - costs, axis=2).min(axis=1).mean()
    assert inverted_generational_distance(costs, front) == pytest.approx(known, rel=1e-12)


def test_failed_rows_are_left_out():
    front = np.array([[0.0, 1.0], [1.0, 0.0]])
    costs = np.array([[np.inf, np.inf], [np.nan, 0.0], [0.0, 1.0]])
    assert inverted_generational_distance(costs, front) == pytest.approx(np.sqrt(2.0) / 2.0)
    assert inverted_generational_distance(costs[:2], front) == np.inf


def test_bad_front():
    with pytest.raises(ValueError, match="`front`"):
        inverted_generational_distance(np.zeros((1, 2)), np.zeros((0, 2)))
