"""Checks array shapes at run time in tests only, and names what must be shared by all tests."""

import os
from pathlib import Path

import pytest
from jaxtyping import install_import_hook

_HOOK = install_import_hook("mjx_inertia", "typecheck.check")


@pytest.fixture(scope="session")
def measurements() -> Path:
    """Folder of real measurements; tests that need it skip without `MJX_INERTIA_DATA`."""
    root = os.environ.get("MJX_INERTIA_DATA", "")
    if not root or not Path(root).is_dir():
        pytest.skip("MJX_INERTIA_DATA does not name a folder of real measurements")
    return Path(root)
