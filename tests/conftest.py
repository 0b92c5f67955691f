"""Shapes are checked at run time in tests only; compiled programs are kept between runs."""

import os
from pathlib import Path

import pytest
from jaxtyping import install_import_hook
from typecheck import checked_modules

from mjx_inertia import runtime

install_import_hook(checked_modules(), "typecheck.check")


def pytest_configure() -> None:
    """One host device: the tests of sharding start their own processes."""
    runtime.configure(devices=1)


@pytest.fixture(scope="session")
def measurements() -> Path:
    """Folder of real measurements; tests that need it skip without `MJX_INERTIA_DATA`."""
    root = os.environ.get("MJX_INERTIA_DATA", "")
    if not root or not Path(root).is_dir():
        pytest.skip("MJX_INERTIA_DATA does not name a folder of real measurements")
    return Path(root)
