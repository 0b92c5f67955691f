"""The mathematics is checked in float64; a test of float32 switches back for itself."""

import jax
import pytest


@pytest.fixture(autouse=True)
def float64():
    with jax.enable_x64(True):
        yield
