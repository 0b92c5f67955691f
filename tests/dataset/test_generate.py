"""Generation, really simulated: killed and resumed, sharded, reproducible."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mjx_inertia.dataset import CubesProtocol, GenerateSettings, generate, open_store
from mjx_inertia.dataset.plan import Range
from mjx_inertia.dataset.store import StoreError, create_store, read_block, write_block
from mjx_inertia.pushing import SceneSettings

PROTOCOL = CubesProtocol(
    mass=Range(1.0, 4.0, 4),
    friction=Range(0.3, 0.5, 2),
    edge=Range(0.1, 0.15, 2),
    speeds=(0.06,),
    pushes_per_cube=25,
)
SCRIPT = """
import sys
from pathlib import Path
from test_generate import PROTOCOL
from mjx_inertia import runtime
from mjx_inertia.dataset import GenerateSettings, generate
runtime.configure(devices=1)
generate(GenerateSettings(Path(sys.argv[1]), PROTOCOL, block=50, shard=sys.argv[2]))
"""


def job(path, shard="0/1"):
    here = Path(__file__).parent
    environment = {**os.environ, "PYTHONPATH": str(here)}
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(path), shard], env=environment, stderr=subprocess.DEVNULL
    )


def signals(path):
    store = open_store(path)
    assert store.missing() == []
    return [read_block(store, b) for b in range(store.blocks)]


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    path = tmp_path_factory.mktemp("reference") / "s.zarr"
    store = generate(GenerateSettings(path, PROTOCOL, block=50), progress=False)
    assert store.blocks == 8
    return signals(path)


def assert_equal(a, b):
    for x, y in zip(a, b, strict=True):
        np.testing.assert_array_equal(x.force, y.force)
        np.testing.assert_array_equal(x.pose, y.pose)
        np.testing.assert_array_equal(x.status, y.status)


@pytest.mark.long
def test_killed_at_any_moment_it_goes_on_and_the_result_is_the_same(tmp_path, reference):
    path = tmp_path / "s.zarr"
    for blocks in (1, 3):  # kill -9 once some blocks are there
        process = job(path)
        deadline = time.monotonic() + 120
        while len(list(path.glob("blocks/0*"))) < blocks and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert 0 < len(open_store(path).missing()) < 8
    assert job(path).wait() == 0
    assert_equal(signals(path), reference)


@pytest.mark.long
def test_shards_of_parallel_jobs_make_up_the_whole(tmp_path, reference):
    path = tmp_path / "s.zarr"
    jobs = [job(path, "0/2"), job(path, "1/2")]
    assert [j.wait() for j in jobs] == [0, 0]
    assert_equal(signals(path), reference)


def test_nothing_left_to_do_is_no_work(tmp_path, reference):
    path = tmp_path / "s.zarr"
    settings = GenerateSettings(path, PROTOCOL, block=400)
    generate(settings, progress=False)
    before = time.monotonic()
    generate(settings, progress=False)
    assert time.monotonic() - before < 5
    assert all((r.status == 0).all() for r in signals(path))


def test_more_shards_than_blocks_leave_some_without_work(tmp_path):
    path = tmp_path / "s.zarr"
    store = generate(GenerateSettings(path, PROTOCOL, block=400, shard="0/2"), progress=False)
    assert store.missing() == [0]


def test_settings_that_contradict_each_other_are_named(tmp_path):
    with pytest.raises(ValueError, match="tip_radius"):
        GenerateSettings(tmp_path, PROTOCOL, SceneSettings(tip_radius=0.01))
    with pytest.raises(ValueError, match=r"dataset\.block=0"):
        GenerateSettings(tmp_path, PROTOCOL, block=0)


@pytest.mark.parametrize("shard", ["2/2", "-1/2", "half", "1"])
def test_bad_shards_are_named(tmp_path, shard):
    with pytest.raises(ValueError, match=r"dataset\.shard"):
        generate(GenerateSettings(tmp_path / "s.zarr", PROTOCOL, shard=shard), progress=False)


def test_a_store_of_other_devices_is_not_gone_on_with(reference, tmp_path):
    settings = GenerateSettings(tmp_path / "s.zarr", PROTOCOL, block=50)
    store = create_store(
        settings.path, settings.plan(), settings.config(), rate=settings.scene.rate, block=50,
        seed=0, provenance={"device": "3 x cpu"},
    )  # fmt: skip
    write_block(store, 0, reference[0])
    with pytest.raises(StoreError, match=r"begun on 3 x cpu, this process has 1 x cpu.*devices="):
        generate(settings, progress=False)
