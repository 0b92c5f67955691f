"""How JAX runs: set once by a program that starts, never by an import.

Every command line and experiment calls `configure` before its first JAX operation.
"""

import functools
import os
from pathlib import Path
from typing import Any

import jax
from jax.extend.core import Primitive, primitives
from jax.interpreters import mlir

# Matrix routines that JAX passes to LAPACK on a CPU.
_LAPACK = (
    primitives.cholesky_p,
    primitives.eig_p,
    primitives.eigh_p,
    primitives.hessenberg_p,
    primitives.householder_product_p,
    primitives.lu_p,
    primitives.qr_p,
    primitives.schur_p,
    primitives.svd_p,
    primitives.triangular_solve_p,
    primitives.tridiagonal_p,
)


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def compiler_options() -> dict[str, int] | None:
    """Options for the large programs of a simulation step on the devices in use.

    On a CPU, LLVM's first level compiles twice as fast as its second, and such a program runs as
    fast. Vectors of 512 bits, where the processor has them, run such a program a fifth faster than
    LLVM's default of 256.
    """
    if jax.default_backend() != "cpu":
        return None
    return {"xla_backend_optimization_level": 1, "xla_cpu_prefer_vector_width": 512}


def configure(devices: int | None = None, *, float64: bool = False) -> None:
    """Splits the CPU into host devices and keeps compiled programs on disk.

    Args:
      devices: host devices to split a CPU into (all cores if None); without effect on GPUs.
      float64: compute in double precision: for identification and checks, not for data.
    """
    wanted = devices or cores()
    if jax.config.jax_num_cpu_devices != wanted:  # it cannot change once JAX has begun
        jax.config.update("jax_num_cpu_devices", wanted)
    jax.config.update("jax_enable_x64", float64)
    _lower_lapack_to_loops()
    if not jax.config.jax_compilation_cache_dir:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        jax.config.update("jax_compilation_cache_dir", str(home / "mjx_inertia" / "xla"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.5)


@functools.cache
def _lower_lapack_to_loops() -> None:
    """Makes LAPACK on a CPU work on one matrix of a batch after the other.

    jaxlib 0.10 splits a batch over XLA's thread pool and waits for the parts. It does so on a
    thread of that same pool, so a program ends only if another thread is free: two such calls at
    once on two cores wait for each other for ever, on one device as on several. A call with one
    matrix does not use the pool.
    """
    for primitive in _LAPACK:
        rules = mlir._platform_specific_lowerings["cpu"]
        rule = (rules.get(primitive) or mlir._lowerings[primitive]).rule
        mlir.register_lowering(primitive, _one_by_one(primitive, rule), platform="cpu")


def _one_by_one(primitive: Primitive, rule: mlir.LoweringRule) -> mlir.LoweringRule:
    """The lowering `rule` of a matrix routine for one matrix, and a loop of it for a batch."""

    def loop(*batches: jax.Array, **parameters: Any) -> Any:
        shape = batches[0].shape[:-2]
        flat = [x.reshape(-1, *x.shape[len(shape) :]) for x in batches]
        results = jax.lax.map(lambda one: primitive.bind(*one, **parameters), flat)
        return jax.tree.map(lambda x: x.reshape(*shape, *x.shape[1:]), results)

    lower_loop = mlir.lower_fun(loop, multiple_results=primitive.multiple_results)

    def lower(context: mlir.LoweringRuleContext, *operands: Any, **parameters: Any) -> Any:
        is_batch = len(context.avals_in[0].shape) > 2  # pyright: ignore
        return (lower_loop if is_batch else rule)(context, *operands, **parameters)

    return lower
