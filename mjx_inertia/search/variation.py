"""Children of a population: who mates, and what crossover and mutation make of them.

In: decisions, who is near whom, uniform random numbers. Out: children.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.search.operators import differential, polynomial_mutation, sbx


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
