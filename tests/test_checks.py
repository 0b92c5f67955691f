"""The static checks, so that one command checks everything: style, types, direction of imports."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent


@pytest.mark.parametrize(
    "command",
    [("ruff", "check", "."), ("ruff", "format", "--check", "."), ("pyright",), ("lint-imports",)],
    ids=" ".join,
)
def test_static_check(command):
    run = subprocess.run([BIN / command[0], *command[1:]], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr


def test_import_has_no_side_effects():
    """Nothing is printed, switched or initialised by an import, and the mesh of MJX stays quiet."""
    code = (
        "import jax, os; before = dict(os.environ); x64 = jax.config.jax_enable_x64\n"
        "import mjx_inertia.settings, mjx_inertia.evaluation\n"
        "assert dict(os.environ) == before and jax.config.jax_enable_x64 == x64\n"
        "assert not jax._src.xla_bridge.backends_are_initialized()\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert run.returncode == 0, run.stderr
    assert run.stdout == ""
