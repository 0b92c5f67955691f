"""MOEA/D on problems with known fronts, with failures, and interrupted."""

import dataclasses

import jax
import jax.numpy as jnp
import moocore
import numpy as np
import pytest
from search.bowls import FLOOR, bowls, front, in_units, walled_bowls

from mjx_inertia.search import (
    ArchiveSettings,
    Evaluation,
    MoeadSettings,
    Problem,
    Recording,
    moead,
    progress,
)
from mjx_inertia.search.decomposition import decomposition, spread_weights
from mjx_inertia.search.fronts import inverted_generational_distance
from mjx_inertia.search.moead_search import Moead
from parts.benchmark_problems import zdt, zdt_front

SMALL = MoeadSettings(population=30, archive=ArchiveSettings(capacity=40))


def distance(costs, points):
    return inverted_generational_distance(costs, points)


def test_zdt1_is_solved_within_its_evaluations():
    result = moead(zdt(1), MoeadSettings(), 1000, key=jax.random.key(0))
    decisions, costs = result.front()
    assert int(result.evaluations) == 100 + 20 * 1000
    assert distance(costs, zdt_front(1)) < 0.006
    assert np.all(moocore.is_nondominated(costs, keep_weakly=True))
    again = jax.vmap(zdt(1).evaluate)(decisions).costs
    np.testing.assert_allclose(again, costs, rtol=1e-12)
    evaluations, volume = progress(result, np.full(2, 1.1))
    assert evaluations[0] == 100 and evaluations[-1] == 20_100 and len(evaluations) == 21
    assert volume[-1] > 0.86 and np.all(np.diff(volume) > -1e-3)


def test_constraints_and_failures():
    result = moead(walled_bowls(), SMALL, 150, key=jax.random.key(1))
    decisions, costs = result.front()
    assert np.all(decisions[:, 1] >= FLOOR) and np.all(np.abs(decisions[:, 2]) < 0.4)
    assert np.all(np.isfinite(costs))
    assert distance(in_units(costs), front(FLOOR)) < 0.02


@pytest.mark.parametrize("name", ["tchebycheff", "weighted_sum", "boundary_intersection"])
def test_each_weight_has_the_decision_that_its_single_cost_asks_for(name):
    """On the bowls' front (t², (1 - t)²) in units of its range, for weights that look inside."""
    settings = dataclasses.replace(SMALL, decomposition=name)
    method = Moead(bowls(), settings)
    state = jax.lax.fori_loop(0, 150, lambda _, s: method.step(s), method.start(jax.random.key(2)))
    weights = spread_weights(2, SMALL.population)
    t = np.linspace(0.0, 1.0, 2001)
    points = jnp.asarray(np.stack([t**2, (1.0 - t) ** 2], 1))
    value = jax.vmap(jax.vmap(decomposition(name), (0, None, None, None)), (None, 0, None, None))
    zero, one = jnp.zeros(2), jnp.ones(2)
    least = np.asarray(value(points, jnp.asarray(weights), zero, one)).min(1)
    held = jnp.asarray(in_units(state.held.costs))
    own = np.asarray(jax.vmap(decomposition(name), (0, 0, None, None))(held, weights, zero, one))
    np.testing.assert_allclose(own[3:-3], least[3:-3], rtol=0.05, atol=0.01)


def test_nothing_allowed_is_an_empty_front():
    def evaluate(x):
        return Evaluation(jnp.full(2, jnp.nan) * x[0], jnp.zeros(()))

    problem = dataclasses.replace(bowls(), evaluate=evaluate)
    result = moead(problem, SMALL, 3, key=jax.random.key(0))
    assert result.front()[1].shape == (0, 2)
    np.testing.assert_array_equal(progress(result, np.full(2, 1.0))[1], 0.0)


def test_compiles_once_and_the_key_decides():
    traces = []
    free = bowls()

    def evaluate(x):
        traces.append(1)
        return free.evaluate(x)

    problem = dataclasses.replace(free, evaluate=evaluate)
    first = moead(problem, SMALL, 40, key=jax.random.key(0))
    assert len(traces) == 1  # the first population is evaluated where the children are
    again = moead(problem, dataclasses.replace(SMALL), 40, key=jax.random.key(0))
    other = moead(problem, SMALL, 60, key=jax.random.key(1))
    assert len(traces) == 1
    jax.tree.map(np.testing.assert_array_equal, first, again)
    assert np.any(np.asarray(first.costs) != np.asarray(other.costs))


class Interrupted(Exception):
    pass


def interrupt_at(count):
    calls = []

    def report(result):
        calls.append(int(result.evaluations))
        if len(calls) == count:
            raise Interrupted

    return report


def test_what_was_interrupted_goes_on_bit_for_bit(tmp_path):
    problem, key, seen = bowls(), jax.random.key(4), []
    whole = moead(problem, SMALL, 30, key=key, recording=Recording(5, report=seen.append))
    assert [int(r.evaluations) for r in seen] == [40 + 20 * i for i in (0, 6, 12, 18, 24, 30)]
    path = tmp_path / "new" / "search.npz"
    with pytest.raises(Interrupted):
        moead(problem, SMALL, 30, key=key, recording=Recording(5, path, interrupt_at(3)))
    assert [p.name for p in path.parent.iterdir()] == ["search.npz"]
    later = []
    resumed = moead(problem, SMALL, 30, key=key, recording=Recording(5, path, later.append))
    assert len(later) == 3
    jax.tree.map(np.testing.assert_array_equal, whole, resumed)
    finished = moead(problem, SMALL, 30, key=key, recording=Recording(5, path))
    jax.tree.map(np.testing.assert_array_equal, whole, finished)

    def fails(message, **changes):
        kind = {"settings": SMALL, "key": key, "problem": problem, **changes}
        with pytest.raises(ValueError, match=message):
            moead(
                kind["problem"],
                kind["settings"],
                30,
                key=kind["key"],
                recording=Recording(5, path),
            )

    fails("of another", key=jax.random.key(5))
    fails("of another", settings=dataclasses.replace(SMALL, replacements=3))
    fails("of another", problem=Problem(problem.evaluate, problem.lower, problem.upper, ("a", "b")))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    fails("damaged")
    path.write_bytes(b"not a checkpoint")
    fails("damaged")


def test_bad_input():
    with pytest.raises(ValueError, match=r"`lower`\[1\] = 1.0"):
        Problem(bowls().evaluate, np.array([0.0, 1.0]), np.array([1.0, 1.0]), ("a",))
    with pytest.raises(ValueError, match="one length"):
        Problem(bowls().evaluate, np.zeros(2), np.ones(3), ("a",))
    with pytest.raises(ValueError, match="`cost_names` is empty"):
        Problem(bowls().evaluate, np.zeros(2), np.ones(2), ())
    named = dataclasses.replace(bowls(), cost_names=("a", "b", "c"))
    with pytest.raises(ValueError, match="returned 2 costs"):
        moead(named, SMALL, 5, key=jax.random.key(0))
    with pytest.raises(ValueError, match="0 steps"):
        moead(bowls(), SMALL, 0, key=jax.random.key(0))
    with pytest.raises(ValueError, match="`children` 0"):
        moead(bowls(), dataclasses.replace(SMALL, children=0), 5, key=jax.random.key(0))
