"""The static checks, so that one command checks everything: style, types, direction of imports."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent


def execute(*command):
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "command",
    [
        ("ruff", "check", "."),
        ("ruff", "format", "--check", "."),
        # without a path pyright asks whichever python is first on PATH where the packages are
        pytest.param(("pyright", "--pythonpath", sys.executable), marks=pytest.mark.long),
        ("lint-imports",),
    ],
    ids=lambda command: " ".join(command[:2]),
)
def test_static_check(command):
    run = execute(BIN / command[0], *command[1:])
    assert run.returncode == 0, run.stdout + run.stderr


def test_import_has_no_side_effects():
    """Nothing is printed, switched or initialised by an import, and the mesh of MJX stays quiet."""
    code = (
        "import jax, os; before = dict(os.environ); x64 = jax.config.jax_enable_x64\n"
        "import mjx_inertia.settings, mjx_inertia.evaluation\n"
        "assert dict(os.environ) == before and jax.config.jax_enable_x64 == x64\n"
        "assert not jax._src.xla_bridge.backends_are_initialized()\n"
    )
    run = execute(sys.executable, "-c", code)
    assert run.returncode == 0, run.stderr
    assert run.stdout == ""
