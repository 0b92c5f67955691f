"""Cost of a push with its gradient and Gauss-Newton Hessian, in one pass through the simulation.

The sensitivities of the state run along with the state (forward mode, all unknowns at once) and
each sample adds to JᵀJ and Jᵀr; no trajectory is kept, so memory does not grow with the push.
In: coordinates, an observation and its setup. Out: `NormalEquations`, and an equivalent small
residual vector for a least-squares solver.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import jax.scipy.linalg
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.estimators.sysid.observation import Observation, sample_residual
from mjx_inertia.estimators.sysid.settings import SysidSettings
from mjx_inertia.estimators.sysid.unknowns import SensorErrors, beyond_bounds, to_parameters
from mjx_inertia.pushing import PushParameters, PushSetup, Scene
from mjx_inertia.pushing.rollout import State, initial_state, rollout
from mjx_inertia.spatial import AnyArray

DIVERGED = 1e12  # cost of a simulation that is not finite: any other is better


@struct.dataclass
class NormalEquations:
    """Half the sum of squared residuals at a point with its derivatives."""

    cost: Float[AnyArray, "*n"]  # ½ rᵀ r (or the robust cost)
    gradient: Float[AnyArray, "*n p"]  # Jᵀ r
    hessian: Float[AnyArray, "*n p p"]  # Jᵀ J


def _robust(r: Float[AnyArray, " w"], huber: float) -> tuple[Float[Array, ""], Float[Array, " w"]]:
    """Cost of residuals and the weight of each in the normal equations (Huber's loss)."""
    if huber <= 0:
        return 0.5 * jnp.sum(r * r), jnp.ones_like(r)
    size = jnp.abs(r)
    beyond = size > huber
    cost = jnp.where(beyond, huber * (size - 0.5 * huber), 0.5 * r * r)
    return jnp.sum(cost), jnp.where(beyond, huber / jnp.maximum(size, huber), 1.0)


def information(
    scene: Scene,
    z: Float[AnyArray, "n p"],
    observation: Observation,
    setup: PushSetup,
    centroid: Float[AnyArray, "2"],
    samples: Int[AnyArray, ""],
    settings: SysidSettings,
) -> NormalEquations:
    """Normal equations of the data alone, over the first `samples` samples of n pushes.

    Directions are mapped outside of pushes, so that the pushes of a batch lie side by side in
    memory.
    """
    n, p = z.shape

    def begin(z: Float[AnyArray, " p"], setup: PushSetup) -> State:
        _, instrument = to_parameters(z, setup, centroid, settings)
        pose = jnp.asarray(setup.pose) + instrument.pose_error
        return initial_state(scene, pose, jnp.asarray(setup.motion.start))

    def advance(
        z: Float[AnyArray, " p"],
        state: State,
        setup: PushSetup,
        observation: Observation,
        k: Int[Array, ""],
    ) -> tuple[State, Float[Array, " w"]]:
        parameters: PushParameters
        instrument: SensorErrors
        parameters, instrument = to_parameters(z, setup, centroid, settings)
        state, sample = rollout(scene, parameters, setup.motion, state, k, 1)
        sample = jax.tree.map(lambda x: x[0], sample)
        return state, sample_residual(observation, k, sample, instrument)

    def begin_all(z: Float[AnyArray, "n p"]) -> State:
        return jax.vmap(begin)(z, setup)

    def along(function: Callable, *primals: object) -> Callable:
        return lambda *tangents: jax.jvp(function, primals, tangents)

    unit = jnp.broadcast_to(jnp.eye(p, dtype=z.dtype)[:, None], (p, n, p))
    state, slope = jax.vmap(along(begin_all, z), out_axes=(None, 0))(unit)

    def body(k: Int[Array, ""], carry: tuple) -> tuple:
        def advance_all(z: Float[AnyArray, "n p"], state: State) -> tuple[State, Array]:
            return jax.vmap(advance, in_axes=(0, 0, 0, 0, None))(z, state, setup, observation, k)

        state, slope, sums = carry
        (state, r), (slope, rate) = jax.vmap(
            along(advance_all, z, state), out_axes=((None, None), (0, 0))
        )(unit, slope)
        cost, weight = jax.vmap(lambda r: _robust(r, settings.huber))(r)
        weighted = rate * weight
        sums = NormalEquations(
            sums.cost + cost,
            sums.gradient + jnp.sum(weighted * r, -1).T,
            sums.hessian + jnp.einsum("inw,jnw->nij", weighted, rate),
        )
        return state, slope, sums

    zero = NormalEquations(
        jnp.zeros(n, z.dtype), jnp.zeros((n, p), z.dtype), jnp.zeros((n, p, p), z.dtype)
    )
    _, _, sums = jax.lax.fori_loop(0, samples, body, (state, slope, zero))
    return sums


def wall_hessian(z: Float[AnyArray, " p"], settings: SysidSettings) -> Float[Array, "p p"]:
    """Gauss-Newton Hessian of the walls at the bounds, which is not information of the data."""
    _, slope = jax.jvp(lambda z: beyond_bounds(z, settings), (z,), (jnp.ones_like(z),))
    return jnp.diag(slope * slope)


def with_belief(
    data: NormalEquations, z: Float[AnyArray, " p"], settings: SysidSettings
) -> NormalEquations:
    """Adds the prior (each coordinate is standard normal) and the walls at the bounds.

    Where the simulation diverged, the sums are not finite. The cost is then so large that no step
    accepts it.
    """
    wall, slope = jax.jvp(lambda z: beyond_bounds(z, settings), (z,), (jnp.ones_like(z),))
    sane = jnp.isfinite(data.cost) & jnp.all(jnp.isfinite(data.hessian))
    sane &= jnp.all(jnp.isfinite(data.gradient))
    clean = jax.tree.map(lambda x: jnp.where(sane, x, 0.0), data)
    prior = jnp.eye(z.shape[0], dtype=z.dtype)
    return NormalEquations(
        cost=jnp.where(sane, clean.cost + 0.5 * (z @ z + wall @ wall), DIVERGED),
        gradient=clean.gradient + z + slope * wall,
        hessian=clean.hessian + prior + wall_hessian(z, settings),
    )


def small_residual(n: NormalEquations) -> tuple[Float[Array, " q"], Float[Array, "q p"]]:
    """A residual of p + 1 entries, and its Jacobian, with these normal equations.

    With JᵀJ = L Lᵀ the first p entries are L⁻¹ Jᵀ r, and the last one makes up the cost.
    """
    lower = jnp.linalg.cholesky(n.hessian)
    first = jax.scipy.linalg.solve_triangular(lower, n.gradient, lower=True)
    rest = jnp.sqrt(jnp.maximum(2.0 * n.cost - first @ first, 0.0))
    p = n.gradient.shape[0]
    jacobian = jnp.concatenate([lower.T, jnp.zeros((1, p), lower.dtype)])
    return jnp.append(first, rest), jacobian
