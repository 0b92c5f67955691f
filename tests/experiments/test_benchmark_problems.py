"""Known problems against pymoo where it is installed, and against their own fronts."""

import jax
import jax.numpy as jnp
import moocore
import numpy as np
import pytest

from parts.benchmark_problems import dtlz, dtlz_front, zdt, zdt_front

pytestmark = pytest.mark.float64
PROBLEMS = {
    **{f"zdt{i}": (zdt(i), zdt_front(i, 101)) for i in (1, 2, 3, 4, 6)},
    **{f"dtlz{i}": (dtlz(i), dtlz_front(i, 3, 12)) for i in (1, 2)},
}


def values(problem, decisions):
    return np.asarray(jax.jit(jax.vmap(problem.evaluate))(jnp.asarray(decisions)).costs)


@pytest.mark.parametrize("name", PROBLEMS)
def test_costs_are_pymoos(name):
    pymoo = pytest.importorskip("pymoo.problems", reason="pymoo is in the extra `rival`")
    problem = PROBLEMS[name][0]
    more = {} if name[0] == "z" else {"n_var": problem.dimension, "n_obj": 3}
    rng = np.random.default_rng(0)
    decisions = rng.uniform(problem.lower, problem.upper, (100, problem.dimension))
    known = pymoo.get_problem(name, **more).evaluate(decisions)
    np.testing.assert_allclose(values(problem, decisions), known, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", PROBLEMS)
def test_front_is_reached_by_the_best_decisions(name):
    problem, front = PROBLEMS[name]
    centre = 0.5 if name.startswith("dtlz") else 0.0
    decisions = np.full((2000, problem.dimension), centre)
    places = 2 if name.startswith("dtlz") else 1
    decisions[:, :places] = np.random.default_rng(0).uniform(size=(2000, places))
    costs = values(problem, decisions)
    if name == "dtlz1":
        np.testing.assert_allclose(costs.sum(axis=1), 0.5)
        np.testing.assert_allclose(front.sum(axis=1), 0.5)
    elif name == "dtlz2":
        np.testing.assert_allclose(np.linalg.norm(costs, axis=1), 1.0)
        np.testing.assert_allclose(np.linalg.norm(front, axis=1), 1.0)
    else:
        # the best decisions lie on the front, and all along it
        best = costs[moocore.is_nondominated(costs, keep_weakly=True)]
        dense = zdt_front(int(name[-1]), 20_001)
        apart = np.linalg.norm(best[::10, None] - dense, axis=2).min(axis=1)
        assert apart.max() < 0.005
        apart = np.linalg.norm(front[:, None] - best, axis=2).min(axis=1)
        assert apart.max() < 0.06  # near the steep end few decisions lie


def test_unknown_numbers():
    with pytest.raises(ValueError, match="`number` 5"):
        zdt(5)
    with pytest.raises(ValueError, match="`number` 3"):
        dtlz(3)
