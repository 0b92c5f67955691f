"""A search whose evaluations are shared over host devices, in a process of its own."""

import subprocess
import sys

import pytest

SEARCH = """
import jax, jax.numpy as jnp, numpy as np
from mjx_inertia import runtime
runtime.configure(2, float64=True)
from mjx_inertia.robots import over_states
from mjx_inertia.search import Evaluation, Problem, StrategySettings, evolution_strategies

def evaluate(x):
    costs = [jnp.sum(x**2), jnp.sum((x - 1.0) ** 2), jnp.sum(abs(x))]
    return Evaluation(jnp.stack(costs), jnp.zeros(()))

many = over_states(evaluate, 64)
problem = Problem(evaluate, np.full(16, -3.0), np.full(16, 3.0), ("a", "b", "c"), many)
result = evolution_strategies(problem, StrategySettings(weights=21), 300, key=jax.random.key(0))
assert len(jax.devices()) == 2 and len(result.front()[1]) > 10
"""


@pytest.mark.long
def test_strategies_on_two_devices_do_not_wait_for_each_other():
    """CMA-ES decomposes a batch of matrices on both devices (see `tests/test_runtime.py`)."""
    run = subprocess.run([sys.executable, "-c", SEARCH], timeout=300, check=False)
    assert run.returncode == 0
