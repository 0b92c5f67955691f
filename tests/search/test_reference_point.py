"""The decision whose worst cost, over what is wished for it, is least."""

import jax
import numpy as np
import pytest
from search.bowls import FLOOR, bowls, walled_bowls

from mjx_inertia.search import StrategySettings, evolution_strategies, toward


def closest(problem, wish):
    settings = StrategySettings(weights=1, population=16)
    result = evolution_strategies(
        toward(problem, np.asarray(wish)), settings, 80, key=jax.random.key(0)
    )
    decisions, costs = result.front()
    return decisions[0], costs[0, 0]


def test_costs_are_in_proportion_to_the_wish():
    """On the front t² and 100 (1 - t)²: with wishes 1 and 25 both shares are (2 / 3)² / 1 ..."""
    decision, share = closest(bowls(), [1.0, 25.0])
    # t² = 4 (1 - t)²
    np.testing.assert_allclose(decision, [2.0 / 3.0, 0.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(share, (2.0 / 3.0) ** 2, rtol=2e-3)


def test_constraints_stay():
    decision, share = closest(walled_bowls(), [1.0, 100.0])
    np.testing.assert_allclose(decision, [0.5, FLOOR, 0.0], atol=2e-3)
    np.testing.assert_allclose(share, 0.25 + FLOOR**2, rtol=2e-3)


@pytest.mark.parametrize("wish", [[1.0], [1.0, 0.0], [1.0, np.inf], [1.0, np.nan]])
def test_a_wish_is_positive_for_each_cost(wish):
    with pytest.raises(ValueError, match="for each of near, far"):
        toward(bowls(), np.array(wish))
