"""Levenberg and Marquardt's method (optimistix), one step at a time, on normal equations.

The caller simulates with sensitivities, which takes nearly all of the time, and only for those
problems of a batch that have not converged. The steps here are cheap. In: `NormalEquations` at the
point asked for. Out: `LevenbergMarquardtState` with the next point to evaluate. Written for one
problem.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from flax import struct
from jaxtyping import Array, Bool, Float, PyTree

from mjx_inertia.estimators.sysid.normal_equations import DIVERGED, NormalEquations, small_residual
from mjx_inertia.spatial import AnyArray

# In standard deviations of the beliefs, and of the residuals: below what a fit can tell.
_ACCURACY = 1e-3
# Cost that a Newton step would still gain: a step of 0.03 standard deviations of the answer.
_DECREMENT = 5e-4
# The same for a search that has stalled: a step of one standard deviation.
_DECREMENT_AT_KINK = 0.5
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

    Args:
      progress: of the search.
      equations: normal equations at `progress.ask`, belief included.
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
