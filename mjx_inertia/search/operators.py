"""How children are made of parents: crossover, difference vectors, mutation, all within bounds.

In: parents and uniform random numbers (a key is split by the caller, so that each operator is a
plain function that can be checked number by number). Out: children within the bounds.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

_ALIKE = 1e-14  # parents nearer than this share of the range have nothing to exchange


def sbx(
    a: Float[Array, " d"],
    b: Float[Array, " d"],
    uniform: Float[Array, " d"],
    box: tuple[Float[Array, " d"], Float[Array, " d"]],
    eta: float,
) -> tuple[Float[Array, " d"], Float[Array, " d"]]:
    """Two children by simulated binary crossover of all variables; their mean is the parents'.

    Deb and Agrawal 1995, "Simulated binary crossover for continuous search space", Complex Systems
    9; near a bound the spread is cut so that children stay inside (Deb's code of NSGA-II), and
    there the mean moves.

    Args:
      a: a parent.
      b: the other.
      uniform: in [0, 1), one number a variable.
      box: lower and upper bounds.
      eta: the greater, the nearer the children to their parents.
    """
    lower, upper = box
    low, high = jnp.minimum(a, b), jnp.maximum(a, b)
    gap = high - low
    apart = gap > _ALIKE * (upper - lower)
    safe = jnp.where(apart, gap, 1.0)
    middle = 0.5 * (low + high)
    first = middle - 0.5 * _spread(uniform, 1.0 + 2.0 * (low - lower) / safe, eta) * gap
    second = middle + 0.5 * _spread(uniform, 1.0 + 2.0 * (upper - high) / safe, eta) * gap
    first, second = jnp.where(apart, first, low), jnp.where(apart, second, high)
    swapped = a > b
    one, two = jnp.where(swapped, second, first), jnp.where(swapped, first, second)
    return jnp.clip(one, lower, upper), jnp.clip(two, lower, upper)


def _spread(
    uniform: Float[Array, " d"], room: Float[Array, " d"], eta: float
) -> Float[Array, " d"]:
    """Half-distance of the children over that of the parents, at most `room`."""
    alpha = 2.0 - _power(room, -(eta + 1.0))
    scaled = uniform * alpha
    inside = jnp.where(scaled <= 1.0, scaled, 1.0 / jnp.maximum(2.0 - scaled, 1e-30))
    return _power(inside, 1.0 / (eta + 1.0))


def differential(
    base: Float[Array, " d"],
    difference: Float[Array, " d"],
    uniform: Float[Array, " d"],
    box: tuple[Float[Array, " d"], Float[Array, " d"]],
    factor: float,
) -> Float[Array, " d"]:
    """The base moved by a difference; a variable that leaves the box ends before the bound.

    Li and Zhang 2009, "MOEA/D-DE", IEEE TEC 13(2), Eq. 3 with CR = 1.

    Args:
      base: the parent.
      difference: of two others.
      uniform: in [0, 1), where between base and bound a variable ends that left the box.
      box: lower and upper bounds.
      factor: F.
    """
    lower, upper = box
    child = base + factor * difference
    child = jnp.where(child < lower, base + uniform * (lower - base), child)
    child = jnp.where(child > upper, base + uniform * (upper - base), child)
    return jnp.clip(child, lower, upper)


def polynomial_mutation(
    child: Float[Array, " d"],
    uniform: Float[Array, " d"],
    box: tuple[Float[Array, " d"], Float[Array, " d"]],
    eta: float,
) -> Float[Array, " d"]:
    """Every variable moved by a polynomial density around where it is, cut at the bounds.

    Deb and Goyal 1996, "A combined genetic adaptive search", Computer Science and Informatics
    26(4), in the form of Deb's code of NSGA-II. Which variables mutate is the caller's.

    Args:
      child: to be mutated.
      uniform: in [0, 1).
      box: lower and upper bounds.
      eta: the greater, the smaller the moves.
    """
    lower, upper = box
    span = upper - lower
    down = uniform < 0.5
    room = jnp.where(down, child - lower, upper - child) / span
    side = jnp.where(down, 2.0 * uniform, 2.0 * (1.0 - uniform))
    inner = side + (1.0 - side) * _power(1.0 - room, eta + 1.0)
    move = 1.0 - _power(inner, 1.0 / (eta + 1.0))
    return jnp.clip(child + jnp.where(down, -move, move) * span, lower, upper)


def _power(base: Float[Array, " d"], exponent: float) -> Float[Array, " d"]:
    """A power of what is not negative; on a CPU several times as fast as `**`, which is scalar."""
    return jnp.exp(exponent * jnp.log(base))
