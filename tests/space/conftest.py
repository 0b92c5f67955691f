"""The mathematics is checked in float64; a test of float32 switches back for itself.

What is compiled here runs for milliseconds: it is compiled without optimisation, in half the time.
"""

import jax
import pytest


@pytest.fixture(autouse=True)
def float64():
    with jax.enable_x64(True):
        yield


@pytest.fixture(autouse=True, scope="module")
def quick_compilation():
    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", False)
