"""Least and greatest of computed values, with a derivative that is always that of one of them.

The derivative of `jnp.max` looks for entries equal to the maximum. Where the compiler computes the
entries twice, with other rounding, none is, and the derivative is 0 / 0; an index cannot miss.
In: values. Out: one of them; NaN if one is.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float


def greatest(values: Float[Array, "n ..."]) -> Float[Array, "..."]:
    """The greatest along the first axis."""
    return jnp.take_along_axis(values, jnp.argmax(values, 0)[None], 0)[0]


def least(values: Float[Array, "n ..."]) -> Float[Array, "..."]:
    """The least along the first axis."""
    return jnp.take_along_axis(values, jnp.argmin(values, 0)[None], 0)[0]
