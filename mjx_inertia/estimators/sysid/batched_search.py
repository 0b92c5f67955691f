"""Least-squares searches of many pushes, or bodies with several pushes, in one batch.

In: a `SysidProblem` and starts. Out: `Search`.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.estimators.sysid.levenberg_marquardt import (
    LevenbergMarquardtState,
    is_minimum,
    levenberg_marquardt_start,
    levenberg_marquardt_step,
)
from mjx_inertia.estimators.sysid.normal_equations import (
    DIVERGED,
    NormalEquations,
    equations_at,
    with_belief,
)
from mjx_inertia.estimators.sysid.observation import SysidProblem
from mjx_inertia.spatial import AnyArray

_PATIENCE, _GAIN = 3, 0.01  # evaluations without this gain in cost end a search that fits

_begin = jax.jit(jax.vmap(levenberg_marquardt_start))
_step = jax.jit(jax.vmap(levenberg_marquardt_step))


@struct.dataclass
class Search:
    """Where searches ended and how they went, with a leading axis."""

    z: Float[AnyArray, "n p"]  # best point found
    cost: Float[AnyArray, " n"]  # there
    hessian: Float[AnyArray, "n p p"]  # Gauss-Newton Hessian there, belief included
    # cost of the best point after each iteration; the last one is repeated
    trace: Float[AnyArray, "n i"]
    iterations: Int[AnyArray, " n"]  # evaluations of the simulation with its sensitivities
    converged: Bool[AnyArray, " n"]  # whether z is a minimum


def search(
    problem: SysidProblem,
    z: Float[AnyArray, "b p"],
    *,
    seconds: float = np.inf,
    report: Callable[[str], None] | None = None,
) -> Search:
    """Minimises the cost of each body from one start, all bodies in one batch.

    Bodies that have converged leave the batch. The others then take less time.

    Args:
      problem: the pushes.
      z: starts, one for each body.
      seconds: how much of each push is fitted.
      report: called after each iteration with a line on how far the search is.
    """
    settings, body = problem.settings, np.asarray(problem.body)
    n, length = len(np.asarray(z)), np.asarray(problem.observation.length)
    pushes = np.bincount(body[length > 0], minlength=n)
    progress = jax.tree.map(np.array, _begin(jnp.asarray(z)))
    trace = np.full((n, settings.iterations), np.inf)
    iterations, converged = np.zeros(n, np.int32), np.zeros(n, bool)
    rows = np.flatnonzero(pushes > 0)
    for i in range(settings.iterations):
        if not len(rows):
            break
        under_way = np.flatnonzero(np.isin(body, rows) & (length > 0))
        each = equations_at(problem, progress.ask[body], rows=under_way, seconds=seconds)
        equations = _summed(problem, each, progress.ask, pushes)
        # one shape for the small program: pushes that are done are stepped too and not taken over
        stepped = jax.tree.map(np.asarray, _step(progress, equations))
        for whole, new in zip(jax.tree.leaves(progress), jax.tree.leaves(stepped), strict=True):
            whole[rows] = new[rows]
        iterations[rows] += 1
        trace[:, i] = progress.cost
        stalled = np.zeros(n, bool) if i < _PATIENCE else _stalled(trace[:, i - _PATIENCE : i + 1])
        stalled &= fits(progress, problem, seconds)
        converged = progress.done | stalled & is_minimum(progress) | converged
        rows = rows[~(progress.done | stalled)[rows]]
        if report:
            cost = float(np.median(progress.cost))
            report(f"iteration {i + 1}, {len(rows)} under way, median cost {cost:.4g}")
    trace = np.minimum.accumulate(trace, axis=1)
    return Search(
        z=progress.z,
        cost=progress.cost,
        hessian=progress.hessian,
        trace=trace,
        iterations=iterations,
        converged=converged,
    )


def _summed(
    problem: SysidProblem, each: NormalEquations, z: np.ndarray, pushes: np.ndarray
) -> NormalEquations:
    """Normal equations of bodies: sums over their pushes, in which the belief counts once."""
    body = np.asarray(problem.body)
    if np.array_equal(body, np.arange(len(z))):
        return each
    prior = jax.vmap(functools.partial(with_belief, settings=problem.settings))(
        jax.tree.map(lambda x: jnp.zeros((len(z), *x.shape[1:])), each), jnp.asarray(z)
    )

    def total(parts: np.ndarray, belief: Array) -> np.ndarray:
        extra = np.maximum(pushes - 1, 0).reshape(-1, *[1] * (parts.ndim - 1))
        whole = -extra * np.asarray(belief)
        np.add.at(whole, body, parts)
        return whole

    summed = jax.tree.map(total, each, prior)
    return summed.replace(cost=np.minimum(summed.cost, DIVERGED))


def _stalled(costs: np.ndarray) -> np.ndarray:
    """Whether the last few evaluations did not reduce the cost: at a kink every step fails."""
    with np.errstate(invalid="ignore"):  # both infinite: a push without signals
        return costs[:, 0] - costs[:, -1] < _GAIN


def misfit(
    found: Search | LevenbergMarquardtState, problem: SysidProblem, seconds: float = np.inf
) -> np.ndarray:
    """Mean squared residual of each body, without the belief's part of the cost."""
    cost, z = np.asarray(found.cost), np.asarray(found.z)
    total = _residuals(problem, len(z), seconds)
    return (2.0 * cost - np.sum(z**2, -1)) / np.maximum(total, 1)


def fits(
    found: Search | LevenbergMarquardtState, problem: SysidProblem, seconds: float = np.inf
) -> np.ndarray:
    """Whether sensor noise alone explains the residuals of each body.

    The mean square of n normal residuals is off by √(2/n) by chance; five of these are allowed.
    """
    total = _residuals(problem, len(np.asarray(found.z)), seconds)
    chance = np.sqrt(2.0 / np.maximum(total, 1))
    return misfit(found, problem, seconds) < problem.settings.misfit + 5.0 * chance


def _residuals(problem: SysidProblem, bodies: int, seconds: float) -> np.ndarray:
    """How many residuals each body has."""
    weight = np.asarray(problem.observation.weight)
    samples = min(seconds / float(np.max(problem.observation.interval)), weight.shape[1])
    compared = (weight[:, : int(np.ceil(samples))] > 0).sum((1, 2))
    return np.bincount(np.asarray(problem.body), weights=compared, minlength=bodies)
