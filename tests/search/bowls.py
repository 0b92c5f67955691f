"""Two bowls whose front is known: convex, constrained, and with a region where nothing is known."""

import jax.numpy as jnp
import numpy as np

from mjx_inertia.search import Evaluation, Problem

FLOOR = 0.3


def costs(x):
    rest = jnp.sum(x[1:] ** 2)
    return jnp.stack([x[0] ** 2 + rest, 100.0 * ((x[0] - 1.0) ** 2 + rest)])


def bowls():
    """No constraint; the second cost is in another unit."""
    lower, upper = np.array([-1.0, -1.0, -1.0]), np.array([2.0, 1.0, 1.0])
    return Problem(lambda x: Evaluation(costs(x), jnp.zeros(())), lower, upper, ("near", "far"))


def walled_bowls():
    """x[1] must be at least `FLOOR`, and evaluations fail where x[2] is beyond 0.4."""

    def evaluate(x):
        good = jnp.abs(x[2]) < 0.4
        return Evaluation(jnp.where(good, costs(x), jnp.nan), jnp.maximum(FLOOR - x[1], 0.0))

    free = bowls()
    return Problem(evaluate, free.lower, free.upper, free.cost_names)


def front(floor=0.0):
    t = np.linspace(0.0, 1.0, 300)
    return np.stack([t**2 + floor**2, (1.0 - t) ** 2 + floor**2], axis=1)


def in_units(rows):
    """Costs with both in the first one's unit."""
    return np.asarray(rows) / np.array([1.0, 100.0])
