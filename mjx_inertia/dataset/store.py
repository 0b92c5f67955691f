"""Pushes on disk: a zarr group that several jobs fill block by block and that survives `kill -9`.

Layout of `<path>` (zarr v3):
  attributes       format, config, seed, provenance, rate (Hz), block (pushes), digests of the plan
  plan/<field>     parameters, motion, truth and conditions of every push, (n, ...)
  blocks/<number>  signals of one block of pushes, (block, samples, ...), with length and status;
                   attributes: number, digest of the plan, digests of the signals

A block is written beside its place and moved there whole, so a block that is there is complete.
zarr reads a chunk that is lost as its fill value, so every array has a digest. Signals are stored
without noise.
"""

import contextlib
import hashlib
import json
import os
import platform
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
import zarr
from zarr.codecs import BloscCodec, Crc32cCodec

from mjx_inertia.dataset.batch import PushBatch
from mjx_inertia.dataset.noise import SensorNoise, add_noise
from mjx_inertia.dataset.plan import (
    CubesProtocol,
    PushPlan,
    Range,
    cubes_plan,
    known_setup,
    select_pushes,
)
from mjx_inertia.pushing import PushRecord

# 1: contacts that chatter; 2: a contact solver that did not always converge; 3: no digests
FORMAT = 4
_LARGEST_ARRAY = 1 << 33  # bytes
_SIGNALS = ("force", "moment", "pose", "twist", "tip_position", "tip_velocity", "length", "status")
_COMPRESSORS = (BloscCodec(cname="lz4", clevel=1, shuffle="bitshuffle"), Crc32cCodec())


def _digest(values: np.ndarray) -> str:
    """Of an array's type, shape and values."""
    header = f"{values.dtype.str} {values.shape}".encode()
    return hashlib.blake2b(header + values.tobytes(), digest_size=16).hexdigest()


def _digests(arrays: Mapping[str, np.ndarray]) -> dict[str, str]:
    return {name: _digest(values) for name, values in arrays.items()}


def _check(arrays: Mapping[str, np.ndarray], digests: Mapping[str, str]) -> None:
    """Raises ValueError for the first array that is not what was written."""
    for name, found in _digests(arrays).items():
        if digests.get(name) != found:
            raise ValueError(f"{name} is not what was written: lost or changed")


class StoreError(RuntimeError):
    """A store that cannot be used as asked; the message says what to do."""


@dataclass(frozen=True)
class PushStore:
    """An open store."""

    path: Path  # of the zarr group
    plan: PushPlan  # all pushes that belong in it
    attributes: Mapping[str, Any]  # config and provenance

    @property
    def blocks(self) -> int:
        """Number of blocks that the whole store has."""
        return -(-len(self.plan) // self.attributes["block"])

    def rows(self, block: int) -> np.ndarray:
        """Numbers of the pushes in a block."""
        size = self.attributes["block"]
        return np.arange(block * size, min((block + 1) * size, len(self.plan)))

    def has(self, block: int) -> bool:
        """Whether a block is stored."""
        return self.block_path(block).is_dir()

    def block_path(self, block: int) -> Path:
        """Folder of a block."""
        return self.path / "blocks" / f"{block:05d}"

    def missing(self, blocks: range | None = None) -> list[int]:
        """Blocks that are not stored yet."""
        todo = range(self.blocks) if blocks is None else blocks
        return [b for b in todo if not self.has(b)]


def _leaves(plan: PushPlan) -> dict[str, np.ndarray]:
    paths, _ = jax.tree_util.tree_flatten_with_path(plan)
    return {".".join(key.name for key in path): np.asarray(leaf) for path, leaf in paths}


def _template(*, polygons: bool) -> PushPlan:
    """Some plan: it has the structure that a stored one is read into."""
    one = CubesProtocol(mass=Range(1, 1, 1), friction=Range(1, 1, 1), edge=Range(0.1, 0.1, 1))
    plan = cubes_plan(one, 0)
    if not polygons:
        return plan
    shaped = plan.parameters.replace(polygons=np.zeros((len(plan), 1, 3, 2)))
    return plan.replace(parameters=shaped, outline_radius=np.zeros(len(plan)))


def create_store(
    path: Path, plan: PushPlan, config: Mapping[str, Any], *, rate: float, block: int, seed: int,
    provenance: Mapping[str, Any],
) -> PushStore:  # fmt: skip
    """Opens the store at `path`, making it if it is not there; jobs may race to do so.

    Args:
      path: of the zarr group.
      plan: the pushes that it is for.
      config: everything that decides the signals; a store made with another one is refused.
      rate: samples a second, Hz.
      block: pushes in a block.
      seed: of the plan.
      provenance: versions and device of this run, kept for the reader.

    Raises:
      StoreError: another config, another format, or a folder that cannot be written.
    """
    attributes = {
        "format": FORMAT,
        "config": json.loads(json.dumps(config)),
        "seed": seed,
        "rate": rate,
        "block": block,
        "provenance": dict(provenance),
        "digests": _digests(_leaves(plan)),
    }
    if not path.exists():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = Path(tempfile.mkdtemp(prefix=f".{path.name}-", dir=path.parent))
            group = zarr.create_group(temporary, attributes=attributes)
            for name, leaf in _leaves(plan).items():
                group.create_array(f"plan/{name}", data=leaf, compressors=_COMPRESSORS)
            group.create_group("blocks")
            temporary.chmod(0o755)
        except OSError as error:
            raise StoreError(f"{path}: cannot make the store: {error}") from error
        try:
            os.rename(temporary, path)
        except OSError:  # another job made it first
            shutil.rmtree(temporary, ignore_errors=True)
    store = open_store(path)
    for key in ("config", "seed", "rate", "block"):
        if store.attributes[key] != attributes[key]:
            changed = _difference(store.attributes[key], attributes[key])
            raise StoreError(
                f"{path}: made with another {key} ({changed}); name another folder with "
                "dataset.path=..., or remove this one"
            )
    if store.attributes["digests"] != attributes["digests"]:
        raise StoreError(
            f"{path}: another version of this package planned other pushes for the same config; "
            "name another folder with dataset.path=..., or remove this one"
        )
    return store


def _difference(stored: Any, asked: Any, where: str = "") -> str:
    if isinstance(stored, dict) and isinstance(asked, dict):
        parts = [
            _difference(stored.get(k), asked.get(k), f"{where}.{k}".lstrip("."))
            for k in sorted({*stored, *asked})
            if stored.get(k) != asked.get(k)
        ]
        return "; ".join(parts)
    return f"{where + ': ' if where else ''}stored {stored!r}, asked for {asked!r}"


def open_store(path: Path) -> PushStore:
    """Opens an existing store for reading.

    Raises:
      StoreError: no store there, or one of another format.
    """
    try:
        group = zarr.open_group(path, mode="r")
        attributes: dict[str, Any] = dict(group.attrs)
        if attributes.get("format") != FORMAT:
            raise StoreError(
                f"{path}: format {attributes.get('format')}, this version reads {FORMAT}; name "
                "another folder with dataset.path=..., or remove this one"
            )
        template = _template(polygons="plan/parameters.polygons" in group)
        leaves = {name: _values(group, f"plan/{name}") for name in _leaves(template)}
        try:
            _check(leaves, attributes["digests"])
        except ValueError as error:
            raise StoreError(
                f"{path}: damaged plan ({error}); remove this folder and run again"
            ) from None
        plan = jax.tree.unflatten(jax.tree.structure(template), list(leaves.values()))
        _check_attributes(attributes)
    except StoreError:
        raise
    except Exception as error:  # zarr raises nearly any type for damaged metadata
        raise StoreError(f"{path}: not a readable store of pushes: {error}") from error
    return PushStore(path, plan, attributes)


def _values(group: zarr.Group, name: str) -> np.ndarray:
    """An array of a group; one that declares more than it can hold is not allocated."""
    array = group[name]
    if not isinstance(array, zarr.Array) or array.nbytes > _LARGEST_ARRAY:
        raise ValueError(f"{name}: expected an array of up to {_LARGEST_ARRAY} bytes, {array}")
    return np.asarray(array)


def _check_attributes(attributes: Mapping[str, Any]) -> None:
    """Raises ValueError for attributes that `create_store` does not write."""
    kinds = {"block": int, "seed": int, "rate": (int, float), "config": dict, "provenance": dict}
    for name, kind in kinds.items():
        if not isinstance(attributes[name], kind):
            raise ValueError(f"{name}={attributes[name]} is not what was written")
    for name in ("block", "rate"):
        if not attributes[name] > 0:
            raise ValueError(f"{name}={attributes[name]} is not what was written")


def write_block(store: PushStore, block: int, record: PushRecord) -> None:
    """Stores the signals of a block; it appears whole or not at all.

    Raises:
      StoreError: the disk is full or not writable; blocks stored before stay as they are.
    """
    final = store.block_path(block)
    temporary = final.parent / f".{final.name}-{platform.node()}-{os.getpid()}"
    shutil.rmtree(temporary, ignore_errors=True)
    signals = {name: np.asarray(getattr(record, name)) for name in _SIGNALS}
    attributes = _block_attributes(store, block) | {"digests": _digests(signals)}
    try:
        group = zarr.create_group(temporary, attributes=attributes)
        for name, values in signals.items():
            group.create_array(name, data=values, chunks=values.shape, compressors=_COMPRESSORS)
        os.rename(temporary, final)
    except OSError as error:
        shutil.rmtree(temporary, ignore_errors=True)
        if final.is_dir():  # another job was given the same shard
            return
        stored = store.blocks - len(store.missing())
        raise StoreError(
            f"{final}: cannot write ({error.strerror or error}); {stored} of {store.blocks} blocks "
            "are stored and stay valid: free some space or mend the folder and run again"
        ) from error


def _block_attributes(store: PushStore, block: int) -> dict[str, Any]:
    """Which pushes of which store a block holds."""
    digests = json.dumps([store.attributes[key] for key in ("config", "digests", "rate")])
    plan = hashlib.blake2b(digests.encode(), digest_size=16).hexdigest()
    return {"block": block, "plan": plan}


def remove_leftovers(store: PushStore) -> None:
    """Removes unfinished blocks of processes of this machine that have ended."""
    for folder in (store.path / "blocks").glob(".*-*"):
        place, _, pid = folder.name.rpartition("-")
        if place.partition("-")[2] != platform.node():
            continue
        with contextlib.suppress(PermissionError):  # of another user, and alive
            try:
                os.kill(int(pid), 0)
            except (ProcessLookupError, ValueError, OverflowError):
                shutil.rmtree(folder, ignore_errors=True)


def read_block(store: PushStore, block: int) -> PushRecord:
    """The records of one block, noiseless.

    Raises:
      StoreError: a block that is missing or damaged.
    """
    path = store.block_path(block)
    if not path.is_dir():
        raise StoreError(f"{path}: block {block} of {store.blocks} is not generated yet")
    try:
        group = zarr.open_group(path, mode="r")
        signals = {name: _values(group, name) for name in _SIGNALS}
        attributes: dict[str, Any] = dict(group.attrs)
        for key, value in _block_attributes(store, block).items():
            if attributes[key] != value:
                raise ValueError(f"written as {key} {attributes[key]}, expected {value}")
        _check(signals, attributes["digests"])
    except Exception as error:  # zarr raises nearly any type for damaged metadata
        raise StoreError(
            f"{path}: damaged ({error}); remove this folder and run again to simulate it anew"
        ) from error
    rows = store.rows(block)
    n, t = signals["moment"].shape
    time = (np.arange(t, dtype=np.float32) + 1) / np.float32(store.attributes["rate"])
    return PushRecord(
        time=np.broadcast_to(time, (n, t)),
        contact_point=store.plan.contact_point[rows].astype(np.float32),
        contact_normal=store.plan.contact_normal[rows].astype(np.float32),
        **signals,
    )


def read_batches(store: PushStore, *, noise: SensorNoise, key: jax.Array) -> Iterator[PushBatch]:
    """All pushes of a complete store, block by block, with sensor noise.

    Args:
      store: a complete store.
      noise: of the sensors, see `add_noise`.
      key: of the noise; the same key gives the same noise whatever the blocks.

    Raises:
      StoreError: a block that is missing or damaged.
    """
    for block in range(store.blocks):
        rows = store.rows(block)
        records = read_block(store, block)
        if noise.spread > 0 or noise.floor > 0:
            records = add_noise(records, rows.astype(np.uint32), noise, key=key)
        part = select_pushes(store.plan, rows)
        yield PushBatch(records, part.truth, part.conditions, known_setup(part))
