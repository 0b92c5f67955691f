"""Least and greatest of values, and their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia.spatial.extremes import greatest, least

VALUES = np.random.default_rng(0).normal(size=(7, 3))


def test_values_are_those_of_numpy():
    np.testing.assert_array_equal(greatest(jnp.asarray(VALUES)), VALUES.max(0))
    np.testing.assert_array_equal(least(jnp.asarray(VALUES[:, 0])), VALUES[:, 0].min())


def test_what_is_not_a_number_is_not_passed_over():
    values = VALUES.copy()
    values[3, 1] = np.nan
    for extreme in (greatest, least):
        assert list(np.isnan(np.asarray(extreme(jnp.asarray(values))))) == [False, True, False]


def test_derivative_is_that_of_one_entry():
    equal = jnp.array([1.0, 3.0, 3.0, 2.0])
    np.testing.assert_array_equal(jax.grad(greatest)(equal), [0.0, 1.0, 0.0, 0.0])
    np.testing.assert_array_equal(jax.jacfwd(least)(equal), [1.0, 0.0, 0.0, 0.0])
