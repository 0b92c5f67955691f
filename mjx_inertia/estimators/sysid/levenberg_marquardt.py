"""Levenberg and Marquardt's method (optimistix) for many bodies in one batch.

A step is written for one problem, on its normal equations, and is cheap. The simulation with its
sensitivities takes nearly all of the time, so bodies that have converged leave the batch. In: a
`SysidProblem` and starts. Out: `Search`.
"""

import functools
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from flax import struct
from jaxtyping import Array, Bool, Float, Int, PyTree

from mjx_inertia.estimators.sysid.normal_equations import (
    DIVERGED,
    NormalEquations,
    equations_at,
    small_residual,
    with_belief,
)
from mjx_inertia.estimators.sysid.observation import SysidProblem
from mjx_inertia.spatial import AnyArray

# In standard deviations of the beliefs, and of the residuals: below what a fit can tell.
_ACCURACY = 1e-3
# Cost that a Newton step would still gain: a step of 0.03 standard deviations of the answer.
_DECREMENT = 5e-4
# The same for a search that has stalled: a step of one standard deviation.
_DECREMENT_AT_KINK = 0.5
_PATIENCE, _GAIN = 3, 0.01  # evaluations without this gain in cost end a search that fits
_SOLVER = optx.LevenbergMarquardt(rtol=_ACCURACY, atol=_ACCURACY)


@struct.dataclass
class LevenbergMarquardtState:
    """A search under way."""

    ask: Float[Array, " p"]  # the point whose normal equations the next step needs
    z: Float[Array, " p"]  # best point so far
    cost: Float[Array, ""]  # there; infinite before the first step
    hessian: Float[Array, "p p"]  # Gauss-Newton Hessian there
    # decrease of the cost that the linear model at the best point predicts for a Newton step
    decrement: Float[Array, ""]
    done: Bool[Array, ""]  # the search has converged
    state: PyTree  # arrays of the solver


@jax.custom_jvp
def _residual(z: Float[Array, " p"], equations: NormalEquations) -> Float[Array, " q"]:
    """The small residual at the point that `equations` belong to."""
    del z
    return small_residual(equations)[0]


@_residual.defjvp
def _(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    value, jacobian = small_residual(primals[1])
    return value, jacobian @ tangents[0]


def _function(z: Float[Array, " p"], equations: NormalEquations) -> tuple[Float[Array, " q"], None]:
    return _residual(z, equations), None


def _initial(z: Float[Array, " p"], equations: NormalEquations) -> PyTree:
    shape = jax.ShapeDtypeStruct((z.shape[0] + 1,), z.dtype)
    return _SOLVER.init(_function, z, equations, {}, shape, None, frozenset())


def levenberg_marquardt_start(z: Float[Array, " p"]) -> LevenbergMarquardtState:
    """A search that has not evaluated anything yet."""
    p = z.shape[0]
    nothing = NormalEquations(jnp.zeros((), z.dtype), jnp.zeros_like(z), jnp.eye(p, dtype=z.dtype))
    return LevenbergMarquardtState(
        ask=z,
        z=z,
        cost=jnp.full((), jnp.inf, z.dtype),
        hessian=jnp.eye(p, dtype=z.dtype),
        decrement=jnp.full((), jnp.inf, z.dtype),
        done=jnp.array(False),
        state=eqx.filter(_initial(z, nothing), eqx.is_array),
    )


def levenberg_marquardt_step(
    progress: LevenbergMarquardtState, equations: NormalEquations
) -> LevenbergMarquardtState:
    """One iteration: accepts the point asked for if its cost is lower, and asks for the next.

    `equations` are those at `progress.ask`, belief included.
    """
    static = eqx.filter(_initial(progress.z, equations), eqx.is_array, inverse=True)
    state = eqx.combine(progress.state, static)
    fixed = {"args": equations, "options": {}, "tags": frozenset()}
    z, state, _ = _SOLVER.step(_function, progress.z, state=state, **fixed)
    done, _ = _SOLVER.terminate(_function, z, state=state, **fixed)
    better = jnp.isinf(progress.cost) | (equations.cost < progress.cost)
    newton = jnp.linalg.solve(equations.hessian, equations.gradient)
    decrement = jnp.where(equations.cost < DIVERGED, 0.5 * equations.gradient @ newton, jnp.inf)
    at_minimum = better & (decrement < _DECREMENT)
    return LevenbergMarquardtState(
        ask=state.y_eval,
        z=z,
        cost=jnp.where(better, equations.cost, progress.cost),
        hessian=jnp.where(better, equations.hessian, progress.hessian),
        decrement=jnp.where(better, decrement, progress.decrement),
        done=done | at_minimum,
        state=eqx.filter(state, eqx.is_array),
    )


def is_minimum(stalled: LevenbergMarquardtState) -> Bool[AnyArray, "*n"]:
    """Whether stalled searches are at a minimum where the derivative is discontinuous.

    At such a minimum the linear model of the best point predicts a small decrease of the cost. If
    it predicts a large one, the search is at a kink and a lower cost lies beyond it.
    """
    return stalled.decrement < _DECREMENT_AT_KINK


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

    Bodies that have converged leave the batch. The others then take less time. `z` are the starts,
    one for each body; `seconds` of each push are fitted. `report` is called after each iteration
    with a line on how far the search is.
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
