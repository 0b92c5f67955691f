"""How JAX runs: set once by a program that starts, never by an import.

Every command line and experiment calls `configure` before its first JAX operation.
"""

import os
from pathlib import Path

import jax

# of XLA's pool for each host device. A LAPACK routine on a batch waits for others of its pool; two
# devices that do so in a pool of two wait for ever (jaxlib 0.10).
_THREADS = 4


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def compiler_options() -> dict[str, int] | None:
    """Options for the large programs of a simulation step on the devices in use.

    On a CPU, LLVM's first level compiles twice as fast as its second, and such a program runs as
    fast.
    """
    return {"xla_backend_optimization_level": 1} if jax.default_backend() == "cpu" else None


def configure(devices: int | None = None, *, float64: bool = False) -> None:
    """Shares CPU work over host devices and keeps compiled programs on disk.

    Args:
      devices: host devices to split a CPU into (all cores if None); without effect on GPUs.
      float64: compute in double precision: for identification and checks, not for data.
    """
    wanted = devices or cores()
    os.environ.setdefault("NPROC", str(_THREADS * wanted))  # read when JAX begins
    if jax.config.jax_num_cpu_devices != wanted:  # it cannot change once JAX has begun
        jax.config.update("jax_num_cpu_devices", wanted)
    jax.config.update("jax_enable_x64", float64)
    if not jax.config.jax_compilation_cache_dir:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        jax.config.update("jax_compilation_cache_dir", str(home / "mjx_inertia" / "xla"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.5)
