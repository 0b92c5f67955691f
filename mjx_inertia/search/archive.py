"""A bounded set of the best allowed decisions, spread evenly over their front.

In: evaluated decisions, a generation at a time. Out: at most `capacity` of all so far, none of
which dominates another; where there are more, the most crowded are left out one by one.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int
from numpy import ndarray

from mjx_inertia.search.fronts import dominates
from mjx_inertia.search.problem import Evaluation

_NEAREST = 0.02  # distances below this share of an even spacing count as it: sums stay exact


@dataclass(frozen=True)
class ArchiveSettings:
    """What an archive keeps."""

    capacity: int = 100  # rows, at most
    # t; of k costs, a row must gain in one more than about t / k of what it loses in the others
    # together, all in ranges of the costs on the front. With 0, rows that are hardly better in one
    # cost and far worse in the rest stay for ever and spoil the ranges of the front.
    least_trade_off: float = 0.01
    # whether a full archive keeps the best row of each direction before rows that are far from
    # others: more hypervolume on regular fronts of three and more costs
    directions: bool = False


@struct.dataclass
class Archive:
    """Rows of decisions that do not dominate each other."""

    decisions: Float[Array, "m d"]  # zero in unused rows
    costs: Float[Array, "m k"]  # infinite in unused rows
    violation: Float[Array, " m"]  # 0; infinite in unused rows


def empty_archive(settings: ArchiveSettings, decision: Float[Array, " d"], costs: int) -> Archive:
    """An archive with no row in use.

    Raises:
      ValueError: no row may be kept.
    """
    if settings.capacity < 1:
        raise ValueError(f"`capacity` {settings.capacity} of the archive must be at least 1")
    rows = jnp.zeros((settings.capacity, *decision.shape), decision.dtype)
    none = jnp.full((settings.capacity, costs), jnp.inf, decision.dtype)
    return Archive(rows, none, none[:, 0])


def update_archive(
    archive: Archive,
    decisions: Float[Array, "n d"],
    found: Evaluation,
    directions: Float[Array | ndarray, "w k"],
    settings: ArchiveSettings,
) -> Archive:
    """The archive of the rows in it and new ones.

    Only rows with violation 0 enter. Of equal rows the first stays.

    Args:
      archive: so far.
      decisions: new ones.
      found: at the new ones; failures are infinite, as from `evaluate_all`.
      directions: of which a full archive keeps the best rows first, if the settings say so.
      settings: of the archive.
    """
    costs = jnp.concatenate([archive.costs, found.costs])
    allowed = jnp.concatenate([archive.violation, found.violation]) == 0.0
    leaning = _leaning(costs, archive, allowed, settings.least_trade_off)
    best = allowed & ~_beaten(leaning, allowed)
    first = jnp.asarray(directions) if settings.directions else None
    kept = truncated(costs, best, settings.capacity, first)
    rows = jnp.argsort(~kept, stable=True)[: settings.capacity]
    used = kept[rows]
    all_decisions = jnp.concatenate([archive.decisions, decisions])
    return Archive(
        jnp.where(used[:, None], all_decisions[rows], 0.0),
        jnp.where(used[:, None], costs[rows], jnp.inf),
        jnp.where(used, 0.0, jnp.inf).astype(archive.violation.dtype),
    )


def in_use(archive: Archive) -> Int[Array, ""]:
    """How many rows are in use; they come first."""
    return jnp.sum(archive.violation == 0.0)


def cost_range(archive: Archive, ideal: Float[Array, " k"]) -> Float[Array, " k"]:
    """From the ideal point to the greatest costs in the archive; 1 where that is not positive."""
    used = archive.violation == 0.0
    span = jnp.max(jnp.where(used[:, None], archive.costs, -jnp.inf), axis=0) - ideal
    return jnp.where((span > 0.0) & jnp.isfinite(span), span, 1.0)


def truncated(
    costs: Float[Array, "n k"],
    rows: Bool[Array, " n"],
    capacity: int,
    directions: Float[Array, "w k"] | None = None,
) -> Bool[Array, " n"]:
    """Of the rows at most `capacity`, evenly spread.

    As long as there are too many, the row with the greatest Riesz energy, the sum of 1 / distance^s
    to all others, is left out (Falcón-Cardona, Ishibuchi and Coello 2020, "Riesz s-energy-based
    reference sets for multi-objective optimization", IEEE CEC). Costs are divided by their range.
    Rows that are the best of those nearest to one of `directions` go last.
    """

    def thin() -> Bool[Array, " n"]:
        z = jnp.where(rows[:, None], _in_range(costs, rows), 0.0)
        pairs = _repulsion(z, rows, capacity)
        last = jnp.zeros_like(rows) if directions is None else _best_of(directions, z, rows)
        reprieve = jnp.where(last, jnp.sum(pairs) + 1.0, 0.0)

        def leave_out(state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            left, energy, count = state
            worst = jnp.argmax(jnp.where(left, energy, -jnp.inf))
            return left.at[worst].set(False), energy - pairs[worst], count - 1

        start = (rows, jnp.sum(pairs, axis=1) - reprieve, jnp.sum(rows))
        return jax.lax.while_loop(lambda state: state[2] > capacity, leave_out, start)[0]

    return jax.lax.cond(jnp.sum(rows) > capacity, thin, lambda: rows)


def _in_range(costs: Float[Array, "n k"], rows: Bool[Array, " n"]) -> Float[Array, "n k"]:
    """Costs such that those of the given rows are from 0 to 1."""
    part = rows[:, None]
    low = jnp.min(jnp.where(part, costs, jnp.inf), axis=0)
    span = jnp.max(jnp.where(part, costs, -jnp.inf), axis=0) - low
    usable = (span > 0.0) & jnp.isfinite(span)
    return (costs - jnp.where(jnp.isfinite(low), low, 0.0)) / jnp.where(usable, span, 1.0)


def _leaning(
    costs: Float[Array, "n k"], archive: Archive, allowed: Bool[Array, " n"], trade_off: float
) -> Float[Array, "n k"]:
    """Costs in ranges of the archive, each with a share of the mean of all.

    Dominance in them asks for a trade-off (Ikeda, Kita and Kobayashi 2001, "Failure of Pareto-based
    MOEAs: does non-dominated really mean near to optimal?", IEEE CEC).
    """
    if trade_off == 0.0:
        return costs
    inside = jnp.arange(len(costs)) < len(archive.violation)
    known = jnp.where(in_use(archive) > 1, allowed & inside, allowed)
    z = jnp.where(allowed[:, None], _in_range(costs, known), jnp.inf)
    return z + trade_off * jnp.mean(z, axis=1, keepdims=True)


def _repulsion(
    z: Float[Array, "n k"], rows: Bool[Array, " n"], capacity: int
) -> Float[Array, "n n"]:
    """1 / distance^s between rows that take part, else 0.

    s is to be no less than the dimension of the front, or rows crowd at its border.
    """
    columns = z.shape[1]
    square = jnp.zeros((len(z), len(z)), z.dtype)
    for column in range(columns):
        square += (z[:, None, column] - z[None, :, column]) ** 2
    nearest = _NEAREST * capacity ** (-1.0 / max(columns - 1, 1))
    inverse = nearest**2 / jnp.maximum(square, nearest**2)
    power = inverse**2 if columns < 6 else inverse**3
    apart = ~jnp.eye(len(z), dtype=bool)
    return jnp.where(apart & rows & rows[:, None], power, 0.0)


def _best_of(
    directions: Float[Array, "w k"], z: Float[Array, "n k"], rows: Bool[Array, " n"]
) -> Bool[Array, " n"]:
    """Whether a row is the best, by PBI, of those that are nearest to one direction."""
    units = directions / jnp.linalg.norm(directions, axis=1, keepdims=True)
    along = z @ units.T
    niche = jnp.argmax(along, axis=1)
    main = jnp.max(along, axis=1)
    off = jnp.sqrt(jnp.maximum(jnp.sum(z * z, axis=1) - main**2, 0.0))
    value = jnp.where(rows, main + 5.0 * off, jnp.inf)
    least = jax.ops.segment_min(value, niche, len(directions))
    return rows & (value == least[niche])


def _beaten(costs: Float[Array, "n k"], allowed: Bool[Array, " n"]) -> Bool[Array, " n"]:
    """Whether an allowed row dominates a row, or an earlier one equals it."""
    equal = jnp.ones((len(costs), len(costs)), dtype=bool)
    for column in range(costs.shape[1]):
        equal &= costs[:, None, column] == costs[None, :, column]
    index = jnp.arange(len(costs))
    earlier = equal & (index[:, None] < index)
    return jnp.any((dominates(costs, costs) | earlier) & allowed[:, None], axis=0)
