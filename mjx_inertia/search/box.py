"""A box without walls, for searches that know no bounds.

In: any number. Out: a decision within its bounds, smoothly.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.search.problem import Problem


def into_box(problem: Problem, free: Float[Array, " d"]) -> Float[Array, " d"]:
    """The decision for a free variable: from 0 to 1 the box is crossed once, and then back.

    A sine, so that a search that steps over a bound comes back inside, and one that tends to the
    bound arrives there with finite numbers.

    Args:
      problem: for its bounds.
      free: of any value.
    """
    lower, upper = jnp.asarray(problem.lower), jnp.asarray(problem.upper)
    return lower + (upper - lower) * 0.5 * (1.0 - jnp.cos(jnp.pi * free))


def out_of_box(problem: Problem, decision: Float[Array, " d"]) -> Float[Array, " d"]:
    """The free variable from 0 to 1 of a decision; `into_box` backwards.

    Args:
      problem: for its bounds.
      decision: within them.
    """
    lower, upper = jnp.asarray(problem.lower), jnp.asarray(problem.upper)
    share = jnp.clip((decision - lower) / (upper - lower), 0.0, 1.0)
    return jnp.arccos(1.0 - 2.0 * share) / jnp.pi
