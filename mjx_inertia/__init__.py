"""Inertial parameters of objects from robot pushes, in JAX."""
