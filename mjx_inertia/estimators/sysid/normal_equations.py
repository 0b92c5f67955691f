"""Cost of a push with its gradient and Gauss-Newton Hessian, in one pass through the simulation.

The sensitivities of the state run along with the state (forward mode, all unknowns at once) and
each sample adds to JᵀJ and Jᵀr; no trajectory is kept, so memory does not grow with the push.
In: coordinates and a `SysidProblem`. Out: `NormalEquations`, and an equivalent small residual
vector for a least-squares solver. `equations_at` runs many pushes on all devices.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import jax.scipy.linalg
import numpy as np
from flax import struct
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Float, Int

from mjx_inertia import runtime
from mjx_inertia.estimators.sysid.observation import SysidProblem, sample_residual
from mjx_inertia.estimators.sysid.unknowns import (
    SensorErrors,
    SysidSettings,
    beyond_bounds,
    to_parameters,
)
from mjx_inertia.pushing import PushParameters, Scene
from mjx_inertia.pushing.rollout import State, initial_state, rollout
from mjx_inertia.spatial import AnyArray

DIVERGED = 1e12  # cost of a simulation that is not finite: any other is better
_AXIS = "pushes"
# Pushes of a narrow block on each device, for a few that are left over: a vector of 512 bits. It
# takes half the time of a block of 32.
_NARROW = 8


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
    problem: SysidProblem, z: Float[AnyArray, "n p"], samples: Int[AnyArray, ""]
) -> NormalEquations:
    """Normal equations of the data alone, over the first `samples` samples of each push.

    Directions are mapped outside of pushes, so that the pushes of a batch lie side by side in
    memory.
    """
    (n, p), scene, settings = z.shape, problem.scene, problem.settings

    def begin(z: Float[AnyArray, " p"], push: SysidProblem) -> State:
        _, instrument = to_parameters(z, push.setup, push.centroid, settings)
        pose = jnp.asarray(push.setup.pose) + instrument.pose_error
        return initial_state(scene, pose, jnp.asarray(push.setup.motion.start))

    def advance(
        z: Float[AnyArray, " p"], state: State, push: SysidProblem, k: Int[Array, ""]
    ) -> tuple[State, Float[Array, " w"]]:
        parameters: PushParameters
        instrument: SensorErrors
        parameters, instrument = to_parameters(z, push.setup, push.centroid, settings)
        state, sample = rollout(scene, parameters, push.setup.motion, state, k, 1)
        sample = jax.tree.map(lambda x: x[0], sample)
        return state, sample_residual(push.observation, k, sample, instrument)

    def begin_all(z: Float[AnyArray, "n p"]) -> State:
        return jax.vmap(begin)(z, problem)

    def along(function: Callable, *primals: object) -> Callable:
        return lambda *tangents: jax.jvp(function, primals, tangents)

    unit = jnp.broadcast_to(jnp.eye(p, dtype=z.dtype)[:, None], (p, n, p))
    state, slope = jax.vmap(along(begin_all, z), out_axes=(None, 0))(unit)

    def body(k: Int[Array, ""], carry: tuple) -> tuple:
        def advance_all(z: Float[AnyArray, "n p"], state: State) -> tuple[State, Array]:
            return jax.vmap(advance, in_axes=(0, 0, 0, None))(z, state, problem, k)

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


@functools.lru_cache(maxsize=8)
def _program(
    scene: Scene, settings: SysidSettings
) -> tuple[Callable[..., NormalEquations], NamedSharding, int]:
    """The compiled simulation of a block of a problem's pushes, its sharding, and devices."""
    del scene  # a program of its own for each, which goes when it has not been used for long
    mesh = Mesh(np.array(jax.devices()), (_AXIS,))
    split, whole = PartitionSpec(_AXIS), PartitionSpec()

    def block(problem: SysidProblem, z: Array, samples: Array) -> NormalEquations:
        data = information(problem, z, samples)
        return jax.vmap(functools.partial(with_belief, settings=settings))(data, z)

    run = jax.shard_map(
        block, mesh=mesh, in_specs=(split, split, whole), out_specs=split, check_vma=False
    )
    program = jax.jit(run, compiler_options=runtime.compiler_options())
    return program, NamedSharding(mesh, split), mesh.devices.size


def _blocks(rows: np.ndarray, length: np.ndarray, size: int, narrow: int) -> list[np.ndarray]:
    """Rows in blocks of like length and of `size` rows; the last row fills up the last block.

    The last block has `narrow` rows where no more are left over.
    """
    order = rows[np.argsort(length[rows], kind="stable")]
    blocks = [order[i : i + size] for i in range(0, len(order), size)]
    sizes = [narrow if len(r) <= narrow else size for r in blocks]
    return [np.pad(r, (0, n - len(r)), mode="edge") for r, n in zip(blocks, sizes, strict=True)]


def equations_at(
    problem: SysidProblem,
    z: Float[AnyArray, "n p"],
    *,
    rows: Int[np.ndarray, " m"] | None = None,
    seconds: float = np.inf,
) -> NormalEquations:
    """Normal equations (beliefs included) of each push at its point, numpy arrays.

    Only `seconds` of each push count. Entries of pushes that are not in `rows` are zero.
    """
    run, sharding, devices = _program(problem.scene, problem.settings)
    n, p = np.shape(z)
    total = NormalEquations(np.zeros(n), np.zeros((n, p)), np.zeros((n, p, p)))
    length = np.asarray(problem.observation.length)
    interval = float(np.max(problem.observation.interval))
    rows = np.arange(n) if rows is None else rows
    size = problem.settings.block
    for block in _blocks(rows, length, size * devices, min(_NARROW, size) * devices):
        samples = int(min(length[block].max(), np.ceil(seconds / interval)))
        inputs = jax.device_put((problem.take(block), np.asarray(z)[block]), sharding)
        found = run(*inputs, jnp.int32(samples))
        for whole, part in zip(jax.tree.leaves(total), jax.tree.leaves(found), strict=True):
            whole[block] = np.asarray(part)
    return total
