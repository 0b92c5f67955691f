"""The 12 features of the thesis' real pushes: mean and variance of six signals (§3.3.4).

In: `Signals`. Out: mean and variance of f_x, f_y, torque, x, y, yaw; the last three count from the
start of contact.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.features.signals import SIGNALS, FeatureSettings, Signals


def moments_names(settings: FeatureSettings) -> tuple[str, ...]:
    """Such as `moments/f_x/mean`."""
    placed = ("x", "y", "yaw") if settings.reference == "tracked" else ("x_c", "y_c", "yaw")
    signals = (*SIGNALS[settings.reference][:3], *placed)
    return tuple(f"moments/{signal}/{kind}" for signal in signals for kind in ("mean", "variance"))


def moments(push: Signals) -> Float[Array, "12"]:
    """Mean and variance over the samples in contact."""
    values = jnp.concatenate([push.values[:, :3], push.displacement], axis=-1)
    valid = push.valid[:, None]
    count = jnp.maximum(jnp.sum(push.valid), 1)
    mean = jnp.sum(jnp.where(valid, values, 0.0), axis=0) / count
    variance = jnp.sum(jnp.where(valid, (values - mean) ** 2, 0.0), axis=0) / count
    return jnp.stack([mean, variance], axis=-1).reshape(-1)
