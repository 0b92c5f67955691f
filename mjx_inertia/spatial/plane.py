"""Vectors in the plane of the table: the moment of a force and the turn of an arm."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.spatial.arrays import AnyArray


def planar_cross(a: Float[AnyArray, "*n 2"], b: Float[AnyArray, "*n 2"]) -> Float[AnyArray, "*n"]:
    """The z component of a × b: moment of a force b at a."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def planar_rotate(angle: Float[AnyArray, "*n"], p: Float[AnyArray, "2"]) -> Float[Array, "*n 2"]:
    """One vector turned counterclockwise by each angle (rad)."""
    cos, sin = jnp.cos(angle), jnp.sin(angle)
    return jnp.stack([cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]], axis=-1)
