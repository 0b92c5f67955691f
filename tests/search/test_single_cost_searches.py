"""Evolution strategies and gradients on bowls with known fronts."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from search.bowls import FLOOR, bowls, front, in_units, walled_bowls

from mjx_inertia.search import (
    Evaluation,
    GradientSettings,
    Recording,
    StrategySettings,
    evolution_strategies,
    gradient_descent,
)
from mjx_inertia.search.fronts import inverted_generational_distance
from mjx_inertia.search.gradient_search import smooth_tchebycheff
from mjx_inertia.search.problem import into_box, out_of_box

KEY = jax.random.key(0)


def distance(result, floor=0.0):
    return inverted_generational_distance(in_units(result.front()[1]), front(floor))


@pytest.mark.parametrize("name", ["CMA_ES", "DifferentialEvolution"])
def test_strategies_keep_to_constraints_and_survive_failures(name):
    result = evolution_strategies(walled_bowls(), StrategySettings(name=name), 60, key=KEY)
    decisions, costs = result.front()
    assert int(result.evaluations) == 20 * 12 * 60
    assert np.all(decisions[:, 1] >= FLOOR) and np.all(np.isfinite(costs))
    assert distance(result, FLOOR) < 0.04


@pytest.mark.parametrize("name", ["DifferentialEvolution", "PSO", "SimpleGA"])
def test_members_that_are_not_allowed_give_way(name):
    """One in a hundred is allowed; members are compared with those of generations before."""
    free = walled_bowls()

    def evaluate(x):
        return Evaluation(free.evaluate(x).costs, jnp.maximum(0.98 - x[1], 0.0))

    problem = dataclasses.replace(free, evaluate=evaluate)
    settings = StrategySettings(name=name, population=24)
    result = evolution_strategies(problem, settings, 80, key=KEY)
    decisions, costs = result.front()
    assert np.all(decisions[:, 1] >= 0.98)
    assert np.min(in_units(costs)[:, 0]) < 1.3 and np.min(in_units(costs)[:, 1]) < 1.3


def test_a_violation_may_be_a_count():
    free = bowls()

    def evaluate(x):
        return Evaluation(free.evaluate(x).costs, (x[1] < FLOOR).astype(int))

    problem = dataclasses.replace(free, evaluate=evaluate)
    result = gradient_descent(problem, GradientSettings(), 5, key=KEY)
    assert np.all(result.front()[0][:, 1] >= FLOOR)


def test_unknown_strategy():
    with pytest.raises(ValueError, match="`name` 'NSGA'"):
        evolution_strategies(bowls(), StrategySettings(name="NSGA"), 5, key=KEY)


@pytest.mark.parametrize(("optimizer", "steps"), [("adam", 120), ("lbfgs", 25)])
def test_gradients_reach_the_front(optimizer, steps):
    result = gradient_descent(bowls(), GradientSettings(optimizer=optimizer), steps, key=KEY)
    assert distance(result) < 0.03
    if optimizer == "adam":
        assert int(result.evaluations) == 40 * steps
    else:
        assert int(result.evaluations) > 40 * steps


def test_a_start_that_fails_ends_alone():
    result = gradient_descent(walled_bowls(), GradientSettings(starts=4), 150, key=KEY)
    decisions, _ = result.front()
    assert np.all(decisions[:, 1] >= FLOOR)
    assert int(result.evaluations) < 80 * 150
    assert distance(result, FLOOR) < 0.06


def test_unknown_optimizer():
    with pytest.raises(ValueError, match="`optimizer` 'newton'"):
        gradient_descent(bowls(), GradientSettings(optimizer="newton"), 5, key=KEY)


def test_smooth_tchebycheff_is_near_the_greatest():
    costs, weight = jnp.array([1.0, 2.0, 4.0]), jnp.array([0.5, 0.25, 0.25])
    scaling = (jnp.zeros(3), jnp.array([1.0, 1.0, 4.0]))
    # λ z is 1, 4 and 2
    for smoothing in (1.0, 0.1, 0.01):
        above = float(smooth_tchebycheff(costs, weight, scaling, smoothing)) - 4.0
        assert 0.0 <= above <= smoothing * np.log(3.0)


def test_the_box_has_no_walls():
    problem = bowls()
    free = jnp.linspace(-2.5, 3.5, 301)[:, None] * jnp.ones(3)
    inside = jax.vmap(lambda x: into_box(problem, x))(free)
    assert np.all((inside >= problem.lower - 1e-12) & (inside <= problem.upper + 1e-12))
    back = jax.vmap(lambda x: into_box(problem, out_of_box(problem, x)))(inside)
    np.testing.assert_allclose(back, inside, atol=1e-9)


def test_history_of_all_searches_is_of_one_kind():
    settings = dataclasses.replace(GradientSettings(), weights=5)
    result = gradient_descent(bowls(), settings, 4, key=KEY, recording=Recording(2))
    np.testing.assert_array_equal(result.history.evaluations, [0, 20, 40])
    assert result.history.costs.shape == (3, 100, 2)


def test_a_strategy_that_needs_other_arguments_is_refused_by_name():
    with pytest.raises(ValueError, match="'SV_CMA_ES' takes arguments that no setting gives"):
        evolution_strategies(bowls(), StrategySettings(name="SV_CMA_ES"), 5, key=KEY)
