"""Problems with known fronts: ZDT1 to 4 and 6 of two costs, DTLZ1 and 2 of any number.

Zitzler, Deb and Thiele 2000, "Comparison of multiobjective evolutionary algorithms: empirical
results", Evol. Comput. 8(2), Sec. 4; Deb, Thiele, Laumanns and Zitzler 2005, "Scalable test
problems for evolutionary multiobjective optimization", Sec. 6.7.
In: the name of a problem. Out: a `Problem`, and points of its front.
"""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

from mjx_inertia.search import Evaluation, Problem
from mjx_inertia.search.decomposition import simplex_lattice

ZDT3_PARTS = (  # of the first cost, where the front is; Zitzler et al. 2000 by its definition
    (0.0, 0.0830015349),
    (0.1822287280, 0.2577623634),
    (0.4093136748, 0.4538821041),
    (0.6183967944, 0.6525117038),
    (0.8233317983, 0.8518328654),
)
_ZDT6_LEAST = 0.2807753191  # first cost of ZDT6 at its least


def zdt(number: int) -> Problem:
    """ZDT1, 2, 3, 4 or 6.

    Raises:
      ValueError: another number.
    """
    if number not in _ZDT:
        raise ValueError(f"`number` {number} is not one of {sorted(_ZDT)} (ZDT5 is of bits)")
    costs, dimension = _ZDT[number]
    lower, upper = np.zeros(dimension), np.ones(dimension)
    if number == 4:
        lower[1:], upper[1:] = -5.0, 5.0
    return _free(costs, lower, upper, 2)


def dtlz(number: int, costs: int = 3) -> Problem:
    """DTLZ1 of k + 4 variables or DTLZ2 of k + 9.

    Raises:
      ValueError: another number, or less than two costs.
    """
    if number not in _DTLZ or costs < 2:
        raise ValueError(f"`number` {number} must be 1 or 2 and `costs` {costs} at least 2")
    of_one, rest = _DTLZ[number]
    dimension = costs - 1 + rest
    return _free(lambda x: of_one(x, costs), np.zeros(dimension), np.ones(dimension), costs)


def zdt_front(number: int, count: int = 1000) -> Float[ndarray, "n 2"]:
    """Points of the front, evenly in the first cost."""
    if number == 3:
        total = sum(high - low for low, high in ZDT3_PARTS)
        parts = [
            np.linspace(low, high, max(2, round(count * (high - low) / total)))
            for low, high in ZDT3_PARTS
        ]
        first = np.concatenate(parts)
        return np.stack([first, 1.0 - np.sqrt(first) - first * np.sin(10.0 * np.pi * first)], 1)
    first = np.linspace(_ZDT6_LEAST if number == 6 else 0.0, 1.0, count)
    second = 1.0 - (np.sqrt(first) if number in {1, 4} else first**2)
    return np.stack([first, second], axis=1)


def dtlz_front(number: int, costs: int = 3, divisions: int = 99) -> Float[ndarray, "n k"]:
    """Points of the front in the directions of a lattice.

    Args:
      number: of the problem.
      costs: k.
      divisions: of the lattice; 99 give 5050 points of three costs.
    """
    weights = simplex_lattice(costs, divisions)
    if number == 1:
        return 0.5 * weights
    return weights / np.linalg.norm(weights, axis=1, keepdims=True)


def _free(
    costs: Callable[[Float[Array, " d"]], Float[Array, " k"]],
    lower: Float[ndarray, " d"],
    upper: Float[ndarray, " d"],
    count: int,
) -> Problem:
    """A problem without constraints."""
    names = tuple(f"f{i + 1}" for i in range(count))
    return Problem(lambda x: Evaluation(costs(x), jnp.zeros((), x.dtype)), lower, upper, names)


def _zdt1(x: Float[Array, " d"]) -> Float[Array, "2"]:
    g = 1.0 + 9.0 * jnp.mean(x[1:])
    return jnp.stack([x[0], g * (1.0 - jnp.sqrt(x[0] / g))])


def _zdt2(x: Float[Array, " d"]) -> Float[Array, "2"]:
    g = 1.0 + 9.0 * jnp.mean(x[1:])
    return jnp.stack([x[0], g * (1.0 - (x[0] / g) ** 2)])


def _zdt3(x: Float[Array, " d"]) -> Float[Array, "2"]:
    g = 1.0 + 9.0 * jnp.mean(x[1:])
    ratio = x[0] / g
    return jnp.stack([x[0], g * (1.0 - jnp.sqrt(ratio) - ratio * jnp.sin(10.0 * jnp.pi * x[0]))])


def _zdt4(x: Float[Array, " d"]) -> Float[Array, "2"]:
    rest = x[1:]
    g = 1.0 + jnp.sum(10.0 + rest**2 - 10.0 * jnp.cos(4.0 * jnp.pi * rest))
    return jnp.stack([x[0], g * (1.0 - jnp.sqrt(x[0] / g))])


def _zdt6(x: Float[Array, " d"]) -> Float[Array, "2"]:
    first = 1.0 - jnp.exp(-4.0 * x[0]) * jnp.sin(6.0 * jnp.pi * x[0]) ** 6
    g = 1.0 + 9.0 * jnp.mean(x[1:]) ** 0.25
    return jnp.stack([first, g * (1.0 - (first / g) ** 2)])


def _dtlz1(x: Float[Array, " d"], costs: int) -> Float[Array, " k"]:
    place, rest = x[: costs - 1], x[costs - 1 :] - 0.5
    g = 100.0 * jnp.sum(1.0 + rest**2 - jnp.cos(20.0 * jnp.pi * rest))
    shares = jnp.cumprod(jnp.concatenate([jnp.ones(1, x.dtype), place]))[::-1]
    others = jnp.concatenate([jnp.ones(1, x.dtype), 1.0 - place[::-1]])
    return 0.5 * (1.0 + g) * shares * others


def _dtlz2(x: Float[Array, " d"], costs: int) -> Float[Array, " k"]:
    angle, rest = 0.5 * jnp.pi * x[: costs - 1], x[costs - 1 :] - 0.5
    g = jnp.sum(rest**2)
    shares = jnp.cumprod(jnp.concatenate([jnp.ones(1, x.dtype), jnp.cos(angle)]))[::-1]
    others = jnp.concatenate([jnp.ones(1, x.dtype), jnp.sin(angle[::-1])])
    return (1.0 + g) * shares * others


_ZDT = {1: (_zdt1, 30), 2: (_zdt2, 30), 3: (_zdt3, 30), 4: (_zdt4, 10), 6: (_zdt6, 10)}
_DTLZ = {1: (_dtlz1, 5), 2: (_dtlz2, 10)}
