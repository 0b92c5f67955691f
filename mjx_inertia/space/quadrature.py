"""Integrals over a motion from few samples: the signals are smooth.

In: signals at the Gauss-Legendre nodes of 0 to 1. Out: integrals, values in between, and how well
the samples resolve a signal. Everything but the signals is a matrix made once.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

_TAIL = 3  # last Legendre coefficients: what they hold, the samples do not resolve


class Rule(NamedTuple):
    """A quadrature of n nodes."""

    nodes: Float[ndarray, " n"]  # shares of the duration, ascending
    weights: Float[ndarray, " n"]  # they sum to one
    # from samples to the last Legendre coefficients, normalised to root mean square
    tail: Float[ndarray, "t n"]


@functools.lru_cache
def gauss_legendre(count: int) -> Rule:
    """The Gauss-Legendre rule, exact for polynomials of degree 2 `count` - 1."""
    x, w = np.polynomial.legendre.leggauss(count)
    weights = w / 2.0
    values = np.polynomial.legendre.legvander(x, count - 1)
    norms = np.sqrt(2.0 * np.arange(count) + 1.0)  # of Legendre's polynomials: 1 / root mean square
    return Rule((x + 1.0) / 2.0, weights, ((values * norms).T * weights)[-_TAIL:])


def integrate(signal: Float[Array, "n ..."], rule: Rule, duration: float) -> Float[Array, "..."]:
    """Over the whole motion."""
    return duration * jnp.tensordot(jnp.asarray(rule.weights, signal.dtype), signal, 1)


def unresolved(signal: Float[Array, "n c"], rule: Rule) -> Float[Array, ""]:
    """Share of a signal's root mean square in its last coefficients.

    The error of the root mean square is below that, of a rough signal too; what is in between the
    nodes errs by up to a few times as much.
    """
    last = jnp.sum((jnp.asarray(rule.tail, signal.dtype) @ signal) ** 2)
    whole = jnp.sum(jnp.asarray(rule.weights, signal.dtype) @ signal**2)
    return jnp.sqrt(last / jnp.maximum(whole, jnp.finfo(signal.dtype).tiny))


@functools.lru_cache
def interpolation_matrix(count: int, at: tuple[float, ...]) -> Float[ndarray, "m n"]:
    """Matrix from samples at the nodes to values at other shares of the duration."""
    rule = gauss_legendre(count)
    degrees = count - 1
    known = np.polynomial.legendre.legvander(2.0 * rule.nodes - 1.0, degrees)
    wanted = np.polynomial.legendre.legvander(2.0 * np.array(at) - 1.0, degrees)
    norms = 2.0 * np.arange(count) + 1.0
    return (wanted * norms) @ (known.T * rule.weights)
