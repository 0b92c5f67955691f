"""Random bodies that are physical by construction: eight point masses each, and their moments."""

import functools

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np

from mjx_inertia.spatial import InertialParameters


@functools.cache
def batched(function, in_axes=0):
    """`function` over many bodies, compiled as one and once for all tests."""
    return jax.jit(jax.vmap(function, in_axes))


def random_clouds(count, seed=0):
    """Masses (count, 8) in kg and positions (count, 8, 3) in m of bodies of unlike shapes."""
    rng = np.random.default_rng(seed)
    masses = rng.uniform(0.01, 1.0, (count, 8)) * 10.0 ** rng.uniform(-2, 2, (count, 1))
    extent = 10.0 ** rng.uniform(-2, 0, (count, 1, 3))
    points = rng.normal(size=(count, 8, 3)) * extent + rng.normal(size=(count, 1, 3)) * 0.3
    return masses, points


def body_of_points(masses, points):
    """`InertialParameters` of point masses, by the definition of the integrals, in NumPy."""
    mass = masses.sum(-1)
    com = (masses[..., None] * points).sum(-2) / mass[..., None]
    r = points - com[..., None, :]
    squared = (r**2).sum(-1)[..., None, None]
    tensors = squared * np.eye(3) - r[..., :, None] * r[..., None, :]
    inertia = (masses[..., None, None] * tensors).sum(-3)
    return InertialParameters(jnp.asarray(mass), jnp.asarray(com), jnp.asarray(inertia))


def random_bodies(count, seed=0):
    return body_of_points(*random_clouds(count, seed))


def random_poses(count, seed=0):
    rng = np.random.default_rng(seed + 1000)
    wxyz = rng.normal(size=(count, 4))
    wxyz /= np.linalg.norm(wxyz, axis=-1, keepdims=True)
    return jaxlie.SE3(jnp.asarray(np.concatenate([wxyz, rng.normal(size=(count, 3))], axis=-1)))


def assert_same_bodies(actual, expected, rtol=1e-11):
    """Compares each field relative to its largest entry per body (and the CoM to 1 m at least)."""
    for name, floor in (("mass", 0.0), ("com", 1.0), ("inertia", 0.0)):
        a, e = np.asarray(getattr(actual, name)), np.asarray(getattr(expected, name))
        assert a.shape == e.shape, name
        axes = tuple(range(np.ndim(expected.mass), e.ndim))
        scale = np.maximum(np.abs(e).max(axis=axes, keepdims=True), floor)
        worst = np.max(np.abs(a - e) / np.maximum(scale, 1e-300))
        assert worst <= rtol, f"{name} differs by {worst:.3g} of its largest entry"
