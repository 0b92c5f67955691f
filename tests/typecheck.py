"""The run-time type checker of the tests: beartype on functions, not on the making of records.

JAX rebuilds records with anything in their fields (None, axis numbers, tracers of other shapes),
so a record's shapes are checked by the functions that it crosses, never by its constructor. Modules
that work number by number are left out: they have no shapes, and a program calls them 100,000 times
while it is traced.
"""

import importlib.util
from pathlib import Path

from beartype import beartype

SCALAR = ("spatial.components", "spatial.small_cholesky", "robots.links")


def checked_modules() -> list[str]:
    """Names of all modules of the package but those that work number by number."""
    spec = importlib.util.find_spec("mjx_inertia")
    assert spec is not None and spec.origin is not None
    root = Path(spec.origin).parent
    names = [".".join(file.relative_to(root).with_suffix("").parts) for file in root.rglob("*.py")]
    return [f"mjx_inertia.{name}" for name in names if name not in SCALAR]


def check(function):
    """Checks every call of `function`, unless it is the constructor of a record."""
    return function if function.__name__ == "__init__" else beartype(function)
