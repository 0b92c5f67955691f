"""A push as a vector with named entries."""

from mjx_inertia.features.examples import Examples

__all__ = ["Examples"]
