"""Normal equations of many pushes at once: one compiled program over all devices.

In: points, observations, setups with a leading axis. Out: `NormalEquations` as numpy arrays.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Float

from mjx_inertia import runtime
from mjx_inertia.estimators.sysid.normal_equations import (
    NormalEquations,
    information,
    with_belief,
)
from mjx_inertia.estimators.sysid.observation import Observation
from mjx_inertia.estimators.sysid.settings import SysidSettings
from mjx_inertia.pushing import PushSetup, Scene
from mjx_inertia.spatial import AnyArray

_AXIS = "pushes"
# Pushes of a narrow block on each device, for a few that are left over: a vector of 512 bits. It
# takes half the time of a block of 32.
_NARROW = 8


@functools.lru_cache(maxsize=8)
def _program(
    scene: Scene, settings: SysidSettings
) -> tuple[Callable[..., NormalEquations], NamedSharding, int]:
    """The compiled simulation of a block: (z, observation, setup, centroid, samples)."""
    mesh = Mesh(np.array(jax.devices()), (_AXIS,))
    split, whole = PartitionSpec(_AXIS), PartitionSpec()

    def block(
        z: Array, observation: Observation, setup: PushSetup, centroid: Array, samples: Array
    ) -> NormalEquations:
        data = information(scene, z, observation, setup, centroid, samples, settings)
        return jax.vmap(functools.partial(with_belief, settings=settings))(data, z)

    run = jax.shard_map(
        block,
        mesh=mesh,
        in_specs=(split, split, split, whole, whole),
        out_specs=split,
        check_vma=False,
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
    scene: Scene,
    z: Float[AnyArray, "n p"],
    observation: Observation,
    setup: PushSetup,
    centroid: Float[AnyArray, "2"],
    settings: SysidSettings,
    *,
    rows: np.ndarray | None = None,
    seconds: float = np.inf,
) -> NormalEquations:
    """Normal equations (beliefs included) of some pushes at given points, numpy arrays.

    Args:
      scene: of the object.
      z: points, (n, p).
      observation: of each push.
      setup: of each push.
      centroid: of the object's outline, object frame, m.
      settings: of the identification.
      rows: which pushes (default: all); the others' entries are zero.
      seconds: how much of each push counts.
    """
    run, sharding, devices = _program(scene, settings)
    n, p = np.shape(z)
    total = NormalEquations(np.zeros(n), np.zeros((n, p)), np.zeros((n, p, p)))
    length = np.asarray(observation.length)
    interval = float(np.max(observation.interval))
    rows = np.arange(n) if rows is None else rows
    narrow = min(_NARROW, settings.block)
    for block in _blocks(rows, length, settings.block * devices, narrow * devices):
        inputs = jax.tree.map(lambda x: np.asarray(x)[block], (z, observation, setup))  # noqa: B023
        samples = int(min(length[block].max(), np.ceil(seconds / interval)))
        found = run(
            *jax.device_put(inputs, sharding), jnp.asarray(centroid, float), jnp.int32(samples)
        )
        for whole, part in zip(jax.tree.leaves(total), jax.tree.leaves(found), strict=True):
            whole[block] = np.asarray(part)
    return total
