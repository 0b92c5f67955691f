"""A made-up estimation problem whose answer is in the features."""

import jax.numpy as jnp
import numpy as np

from mjx_inertia.dataset import PushTruth
from mjx_inertia.features import Examples

COLUMNS = (*(f"windows/a{k}" for k in range(6)), *(f"onset/b{k}" for k in range(4)))


def problem(seed, number, noise=0.0):
    """Features from which mass, I_zz and the CoM follow; `noise` is relative, per feature."""
    rng = np.random.default_rng(seed)
    mass = np.exp(rng.uniform(np.log(0.5), np.log(5), number))
    inertia = mass * rng.uniform(0.002, 0.007, number)
    com = rng.uniform([0.05, -0.05], [0.1, 0.05], (number, 2))
    known = np.stack([np.log(mass), np.log(inertia), com[:, 0] * 40, com[:, 1] * 20], axis=1)
    mixed = np.stack([mass * com[:, 0], np.sin(known[:, 3])], axis=1)
    features = np.concatenate([known, mixed, known[:, ::-1] ** 3], axis=1)
    features = features + noise * features.std(axis=0) * rng.normal(size=features.shape)
    return Examples(
        features=jnp.asarray(features, jnp.float32),
        status=jnp.zeros(number, jnp.int32),
        truth=PushTruth(
            mass=jnp.asarray(mass, jnp.float32),
            inertia=jnp.asarray(inertia, jnp.float32),
            com=jnp.asarray(com, jnp.float32),
        ),
        columns=COLUMNS,
    )
