"""Random pairs of contacts, and what is asked of all tests of holding."""

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia.grasping import Contacts, SoftFinger

PAD = SoftFinger(0.5, 0.004)


def contact_pairs(count, tilt=0.15, seed=0):
    """Contacts (count, 2, 3) some cm apart whose normals lean from the line between them."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 2, 3)) * 0.04
    across = points[:, 1] - points[:, 0]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    normals = np.stack([across, -across], axis=1) + tilt * rng.normal(size=(count, 2, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return Contacts(jnp.asarray(points), jnp.asarray(normals))


def one(contacts, row):
    return jax.tree.map(lambda x: x[row], contacts)


def facing(width):
    """Two pads that face each other along y, `width` apart about the origin."""
    points = jnp.array([[0.0, -0.5 * width, 0.0], [0.0, 0.5 * width, 0.0]])
    return Contacts(points, jnp.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]))


def turned(contacts, pose):
    """The contacts in another frame."""
    rotation = pose.rotation()
    return Contacts(
        jax.vmap(jax.vmap(pose.apply))(contacts.points),
        jax.vmap(jax.vmap(rotation.apply))(contacts.normals),
    )
