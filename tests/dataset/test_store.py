"""The store: interrupted, refused, damaged, shared. Signals here are made up, not simulated."""

import errno
import json
import os
import platform
import shutil
import subprocess
import sys

import jax
import numpy as np
import pytest
import zarr

from mjx_inertia.dataset import CubesProtocol, SensorNoise, cubes_plan, open_store
from mjx_inertia.dataset.plan import Range
from mjx_inertia.dataset.store import (
    StoreError,
    create_store,
    read_batches,
    read_block,
    remove_leftovers,
    write_block,
)
from mjx_inertia.pushing import PushRecord

SMALL = CubesProtocol(
    mass=Range(1, 2, 2), friction=Range(0.3, 0.3, 1), edge=Range(0.1, 0.1, 1), pushes_per_cube=8
)
PLAN = cubes_plan(SMALL, seed=0)


def make(path, **changes):
    options = {"config": {"a": 1}, "rate": 100.0, "block": 6, "seed": 0, "provenance": {}}
    return create_store(path, PLAN, **{**options, **changes})


def record(n, seed=0):
    rng = np.random.default_rng(seed)
    return PushRecord(
        time=np.tile(np.arange(1, 11, dtype=np.float32) / 100, (n, 1)),
        force=rng.normal(size=(n, 10, 2)).astype(np.float32),
        moment=rng.normal(size=(n, 10)).astype(np.float32),
        pose=rng.normal(size=(n, 10, 3)).astype(np.float32),
        twist=rng.normal(size=(n, 10, 3)).astype(np.float32),
        tip_position=rng.normal(size=(n, 10, 2)).astype(np.float32),
        tip_velocity=rng.normal(size=(n, 10, 2)).astype(np.float32),
        contact_point=np.zeros((n, 2), np.float32),
        contact_normal=np.tile(np.float32([1, 0]), (n, 1)),
        length=np.full(n, 10, np.int32),
        status=np.zeros(n, np.int32),
    )


def fill(store):
    for block in store.missing():
        write_block(store, block, record(len(store.rows(block)), seed=block))


def test_what_is_written_is_read(tmp_path):
    store = make(tmp_path / "s.zarr")
    assert store.blocks == 3 and store.missing() == [0, 1, 2]
    fill(store)
    again = open_store(tmp_path / "s.zarr")
    jax.tree.map(np.testing.assert_array_equal, again.plan, PLAN)
    for block in range(3):
        read, written = read_block(again, block), record(len(again.rows(block)), seed=block)
        for name in ("time", "force", "pose", "length", "status"):
            np.testing.assert_array_equal(getattr(read, name), getattr(written, name))
    batches = list(read_batches(again, noise=SensorNoise(0.0), key=jax.random.key(0)))
    assert sum(len(b.truth.mass) for b in batches) == 16
    np.testing.assert_array_equal(np.concatenate([b.truth.mass for b in batches]), PLAN.truth.mass)


def test_another_config_is_refused_and_named(tmp_path):
    make(tmp_path / "s.zarr")
    with pytest.raises(StoreError, match=r"a: stored 1, asked for 2.*dataset\.path"):
        make(tmp_path / "s.zarr", config={"a": 2})
    with pytest.raises(StoreError, match="another seed"):
        make(tmp_path / "s.zarr", seed=5)


def test_a_folder_that_is_no_store_is_named(tmp_path):
    (tmp_path / "s.zarr").mkdir()
    with pytest.raises(StoreError, match="not a readable store"):
        make(tmp_path / "s.zarr")
    with pytest.raises(StoreError, match="not a readable store"):
        open_store(tmp_path / "nothing.zarr")


def test_an_unwritable_place_is_named(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StoreError, match="cannot make the store"):
        make(tmp_path / "file" / "s.zarr")


def test_a_full_disk_keeps_what_is_stored(tmp_path, monkeypatch):
    store = make(tmp_path / "s.zarr")
    write_block(store, 0, record(6))

    def full(*_args, **_options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(zarr, "create_group", full)
        with pytest.raises(StoreError, match=r"No space left.*1 of 3 blocks are stored"):
            write_block(store, 1, record(6))
    assert store.missing() == [1, 2]
    read_block(store, 0)
    fill(store)  # with space again it goes on
    assert store.missing() == []


@pytest.mark.parametrize("damage", ["truncated", "flipped", "removed", "metadata"])
def test_a_damaged_chunk_is_named_and_can_be_mended(tmp_path, damage):
    store = make(tmp_path / "s.zarr")
    fill(store)
    chunk = store.block_path(1) / "force" / "c" / "0" / "0" / "0"
    content = bytearray(chunk.read_bytes())
    if damage == "truncated":
        chunk.write_bytes(content[: len(content) // 2])
    elif damage == "flipped":
        content[len(content) // 2] ^= 0xFF
        chunk.write_bytes(content)
    elif damage == "removed":
        chunk.unlink()
    else:
        (store.block_path(1) / "force" / "zarr.json").unlink()
    with pytest.raises(StoreError, match=r"00001: damaged.*remove this folder and run again"):
        read_block(store, 1)
    read_block(store, 0)
    shutil.rmtree(store.block_path(1))
    assert store.missing() == [1]
    fill(store)
    read_block(store, 1)


@pytest.mark.parametrize("name", ["parameters.friction", "truth.mass"])
def test_a_lost_or_changed_chunk_of_the_plan_is_named(tmp_path, name):
    store = make(tmp_path / "s.zarr")
    fill(store)
    array = zarr.open_array(store.path / "plan" / name, mode="r+")
    array[0] = 7.0
    with pytest.raises(StoreError, match=rf"damaged plan \({name} is not.*run again"):
        open_store(store.path)
    shutil.rmtree(store.path / "plan" / name / "c")
    with pytest.raises(StoreError, match=rf"damaged plan \({name} is not.*run again"):
        open_store(store.path)


@pytest.mark.parametrize(
    "content",
    ["", "{", "[]", "null", "[" * 100_000, '{"zarr_format": 3}', '{"zarr_format": "x", "a": {}}'],
    ids=["empty", "open", "list", "null", "deep", "bare", "other"],
)
def test_damaged_metadata_is_named_wherever_it_is(tmp_path, content):
    store = make(tmp_path / "s.zarr")
    fill(store)
    (store.block_path(1) / "zarr.json").write_text(content)
    (store.block_path(2) / "force" / "zarr.json").write_text(content)
    for block in (1, 2):
        with pytest.raises(StoreError, match=rf"0000{block}: damaged.*remove this folder"):
            read_block(store, block)
    (store.path / "plan" / "truth.mass" / "zarr.json").write_text(content)
    with pytest.raises(StoreError, match="not a readable store"):
        open_store(store.path)
    (store.path / "zarr.json").write_text(content)
    with pytest.raises(StoreError, match=r"not a readable store|format None"):
        open_store(store.path)


@pytest.mark.parametrize(
    ("old", "new"),
    [('"block": 6', '"block": "six"'), ('"block": 6', '"block": 0'), ('"rate"', '"rat"')],
)
def test_attributes_that_no_store_has_are_named(tmp_path, old, new):
    store = make(tmp_path / "s.zarr")
    file = store.path / "zarr.json"
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(StoreError, match="not a readable store"):
        open_store(store.path)


def test_an_array_that_declares_terabytes_is_not_allocated(tmp_path):
    store = make(tmp_path / "s.zarr")
    fill(store)
    file = store.block_path(0) / "moment" / "zarr.json"
    metadata = json.loads(file.read_text())
    metadata["shape"] = [10**9, 1000]
    file.write_text(json.dumps(metadata))
    with pytest.raises(StoreError, match="moment: expected an array of up to"):
        read_block(store, 0)


def test_blocks_are_known_by_their_place_and_their_store(tmp_path):
    store, other = make(tmp_path / "s.zarr"), make(tmp_path / "o.zarr", config={"a": 2})
    fill(store)
    fill(other)
    shutil.move(store.block_path(0), tmp_path / "aside")
    shutil.copytree(store.block_path(1), store.block_path(0))
    with pytest.raises(StoreError, match="written as block 1, expected 0"):
        read_block(store, 0)
    shutil.rmtree(store.block_path(0))
    shutil.copytree(other.block_path(0), store.block_path(0))
    with pytest.raises(StoreError, match="written as plan"):
        read_block(store, 0)


def test_unfinished_blocks_do_not_count_and_are_cleared(tmp_path):
    """What a killed job leaves beside a block's place is not taken for the block."""
    store = make(tmp_path / "s.zarr")
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    names = [f".00001-{platform.node()}-{pid}" for pid in (ended.pid, os.getpid())]
    others = [f".00001-{node}-{ended.pid}" for node in ("else", f"a-{platform.node()}")]
    for name in (*names, *others):
        (store.path / "blocks" / name).mkdir()
    assert store.missing() == [0, 1, 2]
    remove_leftovers(store)
    left = {folder.name for folder in (store.path / "blocks").glob(".0*")}
    assert left == {names[1], *others}


def test_other_pushes_of_the_same_config_are_refused(tmp_path):
    make(tmp_path / "s.zarr")
    options = {"config": {"a": 1}, "rate": 100.0, "block": 6, "seed": 0, "provenance": {}}
    with pytest.raises(StoreError, match="another version of this package planned other pushes"):
        create_store(tmp_path / "s.zarr", cubes_plan(SMALL, seed=1), **options)


def test_two_jobs_may_write_the_same_block(tmp_path):
    store = make(tmp_path / "s.zarr")
    write_block(store, 0, record(6))
    write_block(store, 0, record(6))
    assert store.has(0)


def test_noise_is_a_matter_of_key_and_push_alone(tmp_path):
    """Same key, same noise, whatever the block; sigma is spread/3 of each value."""
    coarse, fine = make(tmp_path / "a.zarr", block=16), make(tmp_path / "b.zarr", block=4)
    whole = record(16)
    write_block(coarse, 0, whole)
    for block in range(4):
        rows = fine.rows(block)
        write_block(fine, block, jax.tree.map(lambda x, r=rows: x[r], whole))
    key = jax.random.key(9)
    (one,) = read_batches(coarse, noise=SensorNoise(0.12), key=key)
    parts = list(read_batches(fine, noise=SensorNoise(0.12), key=key))
    joined = np.concatenate([p.records.force for p in parts])
    np.testing.assert_array_equal(one.records.force, joined)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(one.records))
    ratio = np.asarray(one.records.force / whole.force).ravel() - 1
    assert ratio.std() == pytest.approx(0.04, rel=0.15)
    assert abs(ratio.mean()) < 0.01
    np.testing.assert_array_equal(one.records.pose[:, 0], whole.pose[:, 0])
    (other,) = read_batches(coarse, noise=SensorNoise(0.12), key=jax.random.key(10))
    assert not np.array_equal(one.records.force, other.records.force)
