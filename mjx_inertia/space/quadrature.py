"""Integrals and attitude over a motion from few samples: the signals are smooth.

In: signals at the Gauss-Legendre nodes of 0 to 1. Out: integrals, values in between, the attitude
that an angular velocity leads to, and how well the samples resolve a signal. Everything but the
signals is a matrix made once.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

_TAIL = 3  # last Legendre coefficients: what they hold, the samples do not resolve
_STEPS = 48  # at least, of the attitude's integration


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


def attitude(omega: Float[Array, "n 3"], duration: float) -> Float[Array, "3 3"]:
    """R_start_end of a body with angular velocity `omega` (rad/s, in its own axes)."""
    return attitudes(omega, duration, np.ones(1))[0]


def attitudes(
    omega: Float[Array, "n 3"], duration: float, at: Float[ndarray, " m"]
) -> Float[Array, "m 3 3"]:
    """Attitude of a body against its start at shares `at` of the duration.

    Magnus' expansion to sixth order over short steps (Blanes, Casas, Oteo and Ros 2009, "The Magnus
    expansion and some of its applications", Sec. 5.4), on the polynomial through the samples.

    Args:
      omega: angular velocity at the nodes, rad/s, in the body's axes.
      duration: s.
      at: from 0 to 1.
    """
    edges = np.union1d(np.linspace(0.0, 1.0, _STEPS + 1), at)

    def onward(R: Float[Array, "3 3"], turn: Float[Array, "3 3"]) -> tuple[Array, Array]:
        return R @ turn, R @ turn

    start = jnp.eye(3, dtype=omega.dtype)
    _, reached = jax.lax.scan(onward, start, _turns(omega, duration, edges))
    return jnp.concatenate([start[None], reached])[np.searchsorted(edges, at)]


def _turns(
    omega: Float[Array, "n 3"], duration: float, edges: Float[ndarray, " m"]
) -> Float[Array, "s 3 3"]:
    """Rotations over the steps between `edges`."""
    three = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
    steps = np.diff(edges)
    at = (edges[:-1, None] + steps[:, None] * three).ravel()
    fine = (
        jnp.asarray(interpolation_matrix(omega.shape[0], tuple(at.tolist())), omega.dtype) @ omega
    )
    longs = jnp.asarray(duration * steps, omega.dtype)
    return jax.vmap(_magnus)(fine.reshape(-1, 3, 3), longs)


def _magnus(omega: Float[Array, "3 3"], h: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation over one step from ω at its three Gauss nodes; brackets are cross products."""
    # the transpose obeys Y' = A Y with A = -[ω]
    a1 = -h * omega[1]
    a2 = -np.sqrt(15.0) / 3.0 * h * (omega[2] - omega[0])
    a3 = -10.0 / 3.0 * h * (omega[2] - 2.0 * omega[1] + omega[0])
    c1 = jnp.cross(a1, a2)
    c2 = -jnp.cross(a1, 2.0 * a3 + c1) / 60.0
    rest = jnp.cross(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0
    return jaxlie.SO3.exp(-(a1 + a3 / 12.0 + rest)).as_matrix()
