"""Shapes are checked at run time in tests only; programs compile quickly and are kept on disk."""

import ctypes
import gc
import os
import resource
import runpy
import sys
from pathlib import Path

import jax
import pytest
from jaxtyping import install_import_hook
from typecheck import checked_modules

from mjx_inertia import runtime

# Most programs of tests run once, on few numbers: compiling them costs more than running them.
# LLVM's lowest level, none of its expensive passes, and loops that XLA writes for LLVM itself
# rather than through MLIR compile up to five times faster; such a program runs slower, so
# simulations keep the level that they ask for (`runtime.compiler_options`).
QUICK_COMPILATION = (
    "--xla_backend_optimization_level=0",
    "--xla_llvm_disable_expensive_passes=true",
    "--xla_cpu_use_fusion_emitters=false",
)
# Few tests, but long ones: they start first, so that no worker is left alone with them at the end.
FIRST = ("pipeline", "test_checks.py", "space", "grasping")
# The mathematics of these folders is checked in double precision; a test of single precision
# switches back for itself.
FLOAT64 = ("grasping", "robots", "search", "space", "spatial")
ENOUGH_MEMORY = 1_200_000  # KiB, of a worker

install_import_hook([*checked_modules(), "parts"], "typecheck.check")


def pytest_configure() -> None:
    """One host device: the tests of sharding start their own processes."""
    # before XLA starts, here and in the processes that tests start; what a user sets comes last
    os.environ["XLA_FLAGS"] = " ".join([*QUICK_COMPILATION, os.environ.get("XLA_FLAGS", "")])
    runtime.configure(devices=1)
    # small programs as well: both workers and later files take them from disk
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first; the tests of a file stay together."""

    def place(item: pytest.Item) -> int:
        return min((i for i, name in enumerate(FIRST) if name in item.path.parts), default=9)

    items.sort(key=place)


def pytest_collection_finish() -> None:
    """What is imported stays: the garbage collector need not look at it after each file."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def programs_of_one_file():
    """Compiled programs are dropped between files once they begin to fill the memory."""
    yield
    if resource.getrusage(resource.RUSAGE_SELF).ru_maxrss > ENOUGH_MEMORY:
        jax.clear_caches()
        gc.collect()
        if sys.platform == "linux":
            ctypes.CDLL(None).malloc_trim(0)  # glibc keeps what is freed, else


@pytest.fixture
def run_script(monkeypatch, tmp_path):
    """Runs a script in this process and an empty folder; returns exit status and globals."""
    monkeypatch.chdir(tmp_path)
    # Hydra's logging closes the handlers that there are, and absl's closes pytest's stream with it
    monkeypatch.setattr("logging.config.DictConfigurator.configure", lambda self: None)

    def run(script: Path, *arguments: str) -> tuple:
        monkeypatch.setattr(sys, "argv", [str(script), *arguments])
        try:
            return 0, runpy.run_path(str(script), run_name="__main__")
        except SystemExit as error:
            return error.code, {}
        except ModuleNotFoundError as error:  # of an extra
            pytest.skip(f"{script.name} needs {error.name}")

    return run


@pytest.fixture(autouse=True)
def precision(request: pytest.FixtureRequest):
    """Double precision for tests in the folders `FLOAT64` and those marked `float64`."""
    marked = request.node.get_closest_marker("float64") is not None
    if marked or request.path.parent.name in FLOAT64:
        with jax.enable_x64(True):
            yield
    else:
        yield


@pytest.fixture(scope="session")
def measurements() -> Path:
    """Folder of real measurements; tests that need it skip without `MJX_INERTIA_DATA`."""
    root = os.environ.get("MJX_INERTIA_DATA", "")
    if not root or not Path(root).is_dir():
        pytest.skip("MJX_INERTIA_DATA does not name a folder of real measurements")
    return Path(root)
