"""Children of a population: who mates, and what crossover and mutation make of them.

In: decisions, who is near whom, uniform random numbers (a key is split by the caller, so that each
operator is a plain function that can be checked number by number). Out: children within the bounds.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

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
    there the mean moves. `uniform` has one number in [0, 1) a variable, `box` is lower and upper
    bounds; the greater `eta`, the nearer the children to their parents.
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

    Li and Zhang 2009, "MOEA/D-DE", IEEE TEC 13(2), Eq. 3 with CR = 1. `difference` is that of two
    others, `uniform` in [0, 1) says where between base and bound a variable ends that left the box;
    `factor` is F.
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
    26(4), in the form of Deb's code of NSGA-II. Which variables mutate is the caller's. `uniform`
    is in [0, 1); the greater `eta`, the smaller the moves.
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


@dataclass(frozen=True)
class VariationSettings:
    """How children are made."""

    # probability that both parents are of the archive. With none, multimodal problems converge
    # slowly.
    elite_share: float = 0.9
    # probability that parents from the population are neighbours, else any two
    mating_near: float = 0.9
    # share of children made by DE/rand/1 from their own decision, else by simulated binary
    # crossover of the parents
    difference_share: float = 0.0
    # of simulated binary crossover; the greater, the nearer to the parents
    crossover_eta: float = 15.0
    crossover_rate: float = 0.5  # probability that a variable is crossed
    difference_factor: float = 0.5  # F of DE
    mutation_eta: float = 20.0  # of polynomial mutation; the greater, the smaller the moves
    mutations: float = 1.0  # variables that mutate in a child, on average


def children(
    decisions: Float[Array, "n d"],
    elite: tuple[Float[Array, "m d"], Int[Array, ""]],
    owners: tuple[Int[Array, " c"], Int[Array, "c t"]],
    box: tuple[Float[Array, " d"], Float[Array, " d"]],
    settings: VariationSettings,
    *,
    key: Array,
) -> Float[Array, "c d"]:
    """Children within the box.

    Args:
      decisions: the population.
      elite: rows of the archive, and how many of them, from the first, are in use.
      owners: the decisions that children are made for, and those near to each.
      box: lower and upper bounds.
      settings: of the operators.
      key: of this generation.
    """
    count, dimension = len(owners[0]), decisions.shape[1]
    per_child, per_variable = jax.random.split(key)
    u = jax.random.uniform(per_child, (count, 5), decisions.dtype)
    v = jax.random.uniform(per_variable, (count, 2, dimension), decisions.dtype)
    one, other = _parents(owners, len(decisions), elite[1], u[:, :4], settings)
    both = jnp.concatenate([decisions, elite[0]])
    rate = min(settings.mutations / dimension, 1.0)

    def child(own: Array, a: Array, b: Array, coin: Array, numbers: Array) -> Array:
        made = _crossed((own, a, b), coin, numbers[0], box, settings)
        mutates, uniform = _coin(numbers[1], rate)
        mutant = polynomial_mutation(made, uniform, box, settings.mutation_eta)
        return jnp.where(mutates, mutant, made)

    return jax.vmap(child)(decisions[owners[0]], both[one], both[other], u[:, 4], v)


def _crossed(
    parents: tuple[Float[Array, " d"], Float[Array, " d"], Float[Array, " d"]],
    coin: Float[Array, ""],
    uniform: Float[Array, " d"],
    box: tuple[Float[Array, " d"], Float[Array, " d"]],
    settings: VariationSettings,
) -> Float[Array, " d"]:
    own, a, b = parents
    crossed, rest = _coin(uniform, settings.crossover_rate)
    first, rest = _coin(rest, 0.5)
    by_sbx = jnp.where(first, *sbx(a, b, rest, box, settings.crossover_eta))
    by_sbx = jnp.where(crossed, by_sbx, a)
    if settings.difference_share == 0.0:
        return by_sbx
    by_difference = differential(own, a - b, uniform, box, settings.difference_factor)
    return jnp.where(coin < settings.difference_share, by_difference, by_sbx)


def _parents(
    owners: tuple[Int[Array, " c"], Int[Array, "c t"]],
    population: int,
    elites: Int[Array, ""],
    uniform: Float[Array, "n 4"],
    settings: VariationSettings,
) -> tuple[Int[Array, " n"], Int[Array, " n"]]:
    """Two different parents for each child, counted through the population and then the archive."""
    near = owners[1]
    count, neighbours = near.shape
    from_elite = (uniform[:, 0] < settings.elite_share) & (elites > 1)
    from_near = uniform[:, 1] < settings.mating_near
    size = jnp.where(from_elite, elites, jnp.where(from_near, neighbours, population))
    first = jnp.floor(uniform[:, 2] * size).astype(jnp.int32)
    step = 1 + jnp.floor(uniform[:, 3] * (size - 1)).astype(jnp.int32)
    second = (first + step) % size
    rows = jnp.arange(count)

    def chosen(place: Int[Array, " n"]) -> Int[Array, " n"]:
        neighbour = near[rows, jnp.minimum(place, neighbours - 1)]
        return jnp.where(from_elite, population + place, jnp.where(from_near, neighbour, place))

    return chosen(first), chosen(second)


def _coin(uniform: Array, share: float) -> tuple[Bool[Array, "..."], Array]:
    """True with this probability, and a number that is again uniform in [0, 1) and independent."""
    heads = uniform < share
    rest = jnp.where(heads, uniform / max(share, 1e-9), (uniform - share) / max(1.0 - share, 1e-9))
    return heads, jnp.clip(rest, 0.0, 1.0)
