"""Decisions spread over a box before anything is known.

In: bounds, how many. Out: a Latin hypercube.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.search.problem import Problem


def latin_hypercube(
    problem: Problem, count: int, *, key: Array, spread: float = 1.0
) -> Float[Array, "n d"]:
    """Decisions of which each variable has one in each of n equal slices of its range.

    McKay, Beckman and Conover 1979, Technometrics 21(2).

    Args:
      problem: for its bounds.
      count: n.
      key: of the draw.
      spread: share of the range, about its middle, that is covered.
    """
    lower, upper = jnp.asarray(problem.lower), jnp.asarray(problem.upper)
    within, order = jax.random.split(key)
    shape = (count, problem.dimension)
    rows = jnp.broadcast_to(jnp.arange(count)[:, None], shape)
    slices = jax.random.permutation(order, rows, axis=0, independent=True)
    place = (slices + jax.random.uniform(within, shape, lower.dtype)) / count
    place = 0.5 + spread * (place - 0.5)
    return lower + place * (upper - lower)
