"""The thesis' 72 features: mean, std and RMS of eight signals in three equal windows (§3.4).

In: `Signals`. Out: the features, in the order signal, window, statistic (errata 8).
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.features.signals import SIGNALS, FeatureSettings, Signals

WINDOWS = 3
STATISTICS = ("mean", "std", "rms")


def windows_names(settings: FeatureSettings) -> tuple[str, ...]:
    """Such as `windows/f_x/1/mean`; windows count from 1."""
    return tuple(
        f"windows/{signal}/{window + 1}/{statistic}"
        for signal in SIGNALS[settings.reference]
        for window in range(WINDOWS)
        for statistic in STATISTICS
    )


def windows(push: Signals) -> Float[Array, "72"]:
    """Statistics over the samples in contact; a window without samples holds zeros."""
    count = jnp.sum(push.valid)
    order = jnp.cumsum(push.valid) - 1
    window = jnp.where(push.valid, order * WINDOWS // jnp.maximum(count, 1), -1)
    member = (window == jnp.arange(WINDOWS)[:, None]).astype(push.values.dtype)
    size = jnp.maximum(jnp.sum(member, axis=1), 1.0)[:, None]
    mean = member @ push.values / size
    deviation = push.values - member.T @ mean  # two passes: float32 would cancel otherwise
    std = jnp.sqrt(member @ deviation**2 / size)
    rms = jnp.sqrt(member @ push.values**2 / size)
    return jnp.stack([mean, std, rms], axis=-1).transpose(1, 0, 2).reshape(-1)
