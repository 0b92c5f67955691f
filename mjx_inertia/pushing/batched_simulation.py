"""Batches of pushes in one compiled program, over all devices.

Pushes differ sixfold in duration, so the program simulates a short segment of a block of pushes;
blocks are filled with pushes of like duration, and each is run for as many segments as it needs.
In: a scene, parameters and motions with a leading axis. Out: a `PushRecord` with that axis.
"""

import functools
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Float, Int

from mjx_inertia import runtime
from mjx_inertia.pushing.parameters import PushParameters
from mjx_inertia.pushing.push_checks import check_shapes, impossible_pushes, named_arrays
from mjx_inertia.pushing.record import Motion, PushRecord, push_length, push_status
from mjx_inertia.pushing.rollout import Sample, initial_state, rollout
from mjx_inertia.pushing.scene import Scene
from mjx_inertia.spatial import AnyArray

SEGMENT = 125  # samples: the four speeds of the data take 2, 3, 6 and 12 segments
BLOCK_PER_DEVICE = {"cpu": 600}  # pushes: enough to vectorise, and few enough for the cache
_BLOCK_ON_ACCELERATOR = 16_384  # pushes
_GRAIN = 50  # pushes; fewer take no less time
_AXIS = "pushes"


@functools.lru_cache(maxsize=16)
def _programs(scene: Scene) -> tuple[Callable[..., Any], Callable[..., Any], int, NamedSharding]:
    """The compiled functions of a scene (start of a block, one segment of it)."""
    mesh = Mesh(np.array(jax.devices()), (_AXIS,))
    split = PartitionSpec(_AXIS)

    def start(pose: Array, tip: Array) -> Any:
        return jax.vmap(functools.partial(initial_state, scene))(pose, tip)

    def segment(parameters: PushParameters, motion: Motion, state: Any, first: Array) -> Any:
        one = functools.partial(rollout, scene, samples=SEGMENT)
        return jax.vmap(one, in_axes=(0, 0, 0, None))(parameters, motion, state, first)

    run = jax.shard_map(
        segment,
        mesh=mesh,
        in_specs=(split, split, split, PartitionSpec()),
        out_specs=split,
        check_vma=False,
    )
    sharding = NamedSharding(mesh, split)
    return (
        jax.jit(start, out_shardings=sharding),
        jax.jit(run, donate_argnums=2, compiler_options=runtime.compiler_options()),
        mesh.devices.size,
        sharding,
    )


def _rounded(pushes: int) -> int:
    """Pushes a device, rounded up so that batches of nearly one size share a compiled program."""
    return -(-pushes // _GRAIN) * _GRAIN


def _take(tree: Any, index: np.ndarray) -> Any:
    return jax.tree.map(lambda x: np.asarray(x)[index], tree)


def _simulate_block(
    scene: Scene, parameters: PushParameters, motion: Motion, pose: np.ndarray, segments: int
) -> Iterator[Sample]:
    """Signals of one block of pushes, segment by segment, (n, SEGMENT, ...)."""
    start, run, _, sharding = _programs(scene)
    parameters, motion, pose = jax.device_put((parameters, motion, pose), sharding)
    state = start(pose, motion.start)
    done = []
    for i in range(segments):
        state, sample = run(parameters, motion, state, jnp.int32(i * SEGMENT))
        yield from done  # read while the devices are at the next one
        done = [sample]
    yield from done


def simulate(
    scene: Scene,
    parameters: PushParameters,
    motion: Motion,
    *,
    contact_point: Float[AnyArray, "n 2"],
    contact_normal: Float[AnyArray, "n 2"],
    pose: Float[AnyArray, "n 3"] | None = None,
    progress: Callable[[int], None] | None = None,
) -> PushRecord:
    """Simulates many pushes of one scene.

    Args:
      scene: from `build_scene`.
      parameters: of each push, leading axis n.
      motion: of each tip, leading axis n.
      contact_point: where the tip first meets the object, m, world.
      contact_normal: inward unit normal of the object there, world.
      pose: of the object at the start (default: at the origin).
      progress: called with the number of pushes done after each block.

    Returns:
      The signals at `scene.settings.rate`, padded to the longest push, with a status on each: one
      bad push leaves the others as they are. A push that cannot be is not simulated: its signals
      are one sample of NaN, its status is `DIVERGED`.

    Raises:
      ValueError: no push at all, arrays of different lengths, or not one push that can be; by the
        name of the argument.
    """
    n = len(contact_point)
    if n == 0:
        raise ValueError("contact_point has no rows: simulate needs at least one push")
    # inputs in the precision of the scene, and how many samples each push takes
    dtype = scene.data.qpos.dtype
    start = np.zeros((n, 3), dtype) if pose is None else np.asarray(pose, dtype)
    parameters, motion = jax.tree.map(lambda x: np.asarray(x, dtype), (parameters, motion))
    where = {"contact_point": contact_point, "contact_normal": contact_normal, "pose": start}
    arrays = named_arrays(parameters, motion, where)
    check_shapes(arrays, n)
    impossible, fault = impossible_pushes(scene, arrays, motion)
    if impossible.all():
        raise ValueError(fault)
    rate = scene.settings.rate
    if impossible.any():  # another push takes the place of each, for one sample
        stand_in = np.where(impossible, np.flatnonzero(~impossible)[0], np.arange(n))
        parameters, motion, start = _take((parameters, motion, start), stand_in)
        motion = motion.replace(duration=np.where(impossible, 1.0 / rate, motion.duration))
    planned = np.ceil(np.round(np.asarray(motion.duration) * rate, 3)).astype(int)
    # blocks of one size, as large as the devices take
    devices = _programs(scene)[2]
    most = BLOCK_PER_DEVICE.get(jax.default_backend(), _BLOCK_ON_ACCELERATOR)
    blocks = -(-n // (devices * most))
    block = devices * _rounded(-(-n // (devices * blocks)))
    # block by block, pushes of like duration together; the last block is filled with its last push
    longest = int(planned.max())
    signals: Sample | None = None
    order = np.argsort(planned, kind="stable")
    for first in range(0, n, block):
        index = order[first : first + block]
        filled = np.pad(index, (0, block - len(index)), mode="edge")
        inputs = _take(parameters, filled), _take(motion, filled), start[filled]
        segments = -(-int(planned[index].max()) // SEGMENT)
        for i, part in enumerate(_simulate_block(scene, *inputs, segments)):
            if signals is None:
                signals = jax.tree.map(
                    lambda x: np.zeros((n, longest, *x.shape[2:]), x.dtype), part
                )
            times = slice(i * SEGMENT, min(longest, (i + 1) * SEGMENT))
            width = times.stop - times.start
            for whole, piece in zip(jax.tree.leaves(signals), jax.tree.leaves(part), strict=True):
                whole[index, times] = np.asarray(piece)[: len(index), :width]
        if progress:
            progress(len(index))
    assert signals is not None
    for signal in jax.tree.leaves(signals):
        signal[impossible] = np.nan
    return _record(signals, planned, rate, contact_point, contact_normal)


def _record(
    signals: Sample,
    planned: Int[np.ndarray, " n"],
    rate: float,
    contact_point: AnyArray,
    contact_normal: AnyArray,
) -> PushRecord:
    n, t = signals.moment.shape
    dtype = signals.moment.dtype
    record = PushRecord(
        time=np.broadcast_to((np.arange(t) + 1) / rate, (n, t)).astype(dtype),
        **{name: getattr(signals, name) for name in Sample.__dataclass_fields__},
        contact_point=np.asarray(contact_point, dtype),
        contact_normal=np.asarray(contact_normal, dtype),
        length=planned.astype(np.int32),
        status=np.zeros(n, np.int32),
    )
    status = push_status(record, rate)
    record = record.replace(status=status, length=push_length(record, rate))
    return _hold_last(record)


def _hold_last(record: PushRecord) -> PushRecord:
    """Repeats the last valid sample beyond the length, in place."""
    t = record.time.shape[1]
    rows = np.flatnonzero(record.length < t)
    index = np.minimum(np.arange(t), np.maximum(record.length[rows, None] - 1, 0))
    for name in Sample.__dataclass_fields__:
        signal = getattr(record, name)
        signal[rows] = signal[rows[:, None], index]
    return record
