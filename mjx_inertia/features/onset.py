"""The first half second after contact, finer towards contact: where the mass shows.

Once the object slides steadily, a push shows friction times mass only (errata 12); three equal
windows average the transient away. In: `Signals`. Out: means of the eight signals in bins whose
edges are seconds (so at any sampling rate), a few quantities that mechanics suggests, and both
freed of the scale of the push.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.features.signals import SIGNALS, FeatureSettings, Signals

# Single samples at 100 Hz, then bins that grow, s after contact.
EDGES = (*np.arange(13) * 0.01, 0.14, 0.17, 0.21, 0.27, 0.36, 0.5)
HORIZONS = (0.02, 0.04, 0.06, 0.09, 0.14, 0.27)  # s after contact, each also an edge of a bin
SUMMARY = (
    "duration",  # s in contact
    "path",  # of the tip, m
    "tip_speed",  # mean, m/s
    "peak_force",  # N
    "peak_time",  # s
    "peak_ratio",  # of peak to steady force
    "turn",  # yaw at the end by path, rad/m
    "slide",  # lateral displacement at the end by path
)


def onset_names(settings: FeatureSettings) -> tuple[str, ...]:
    """Such as `onset/f_x/30ms` (a bin by its beginning) and `onset/effective_mass/60ms`."""
    bins = [
        f"onset/{signal}/{edge * 1e3:.0f}ms"
        for signal in SIGNALS[settings.reference]
        for edge in EDGES[:-1]
    ]
    derived = [
        f"onset/{quantity}/{horizon * 1e3:.0f}ms"
        for quantity in ("impulse", "effective_mass", "net_effective_mass", "turn_by_speed")
        for horizon in HORIZONS
    ]
    relative = [
        f"onset/relative/{signal}/{edge * 1e3:.0f}ms"
        for signal in SIGNALS[settings.reference][:6]
        for edge in EDGES[:-1]
    ]
    effective = [
        f"onset/relative/{quantity}/{horizon * 1e3:.0f}ms"
        for quantity in ("impulse", "effective_mass", "net_effective_mass")
        for horizon in HORIZONS
    ]
    return (*bins, *derived, *(f"onset/{quantity}" for quantity in SUMMARY), *relative, *effective)


def _ratio(
    above: Float[Array, "*n"], below: Float[Array, "*n"], least: float
) -> Float[Array, "*n"]:
    """A quotient that stays finite: |below| is taken as at least `least`."""
    return above / jnp.where(below < 0, jnp.minimum(below, -least), jnp.maximum(below, least))


def overlap(
    push: Signals, begin: Float[Array, " b"], end: Float[Array, " b"]
) -> Float[Array, "b t"]:
    """Seconds that each sampling interval shares with each bin; zero outside contact."""
    first, last = push.elapsed, push.elapsed + push.interval
    shared = jnp.minimum(last, end[:, None]) - jnp.maximum(first, begin[:, None])
    return jnp.where(push.valid, jnp.maximum(shared, 0.0), 0.0)


def onset(push: Signals) -> Float[Array, "302"]:
    """Means by bin, then derived quantities; a bin beyond the end of the record holds zeros.

    `relative` columns are free of the push's scale: forces over the steady force, motion over the
    tip's speed. They are alike for cubes of any mass pushed alike, and so tell friction and shape.
    """
    edges = jnp.asarray(EDGES, push.values.dtype)
    weight = overlap(push, edges[:-1], edges[1:])
    covered = jnp.sum(weight, axis=1)
    integral = weight @ push.values
    # A sliver of a sample, left by rounding at a bin's edge, is no sample.
    seen = covered > 1e-3 * push.interval
    means = jnp.where(seen[:, None], integral / jnp.maximum(covered, 1e-9)[:, None], 0.0)

    # Momentum of what is moved, normal to the surface: m_eff du_cx = (f_x - friction) dt.
    ends = jnp.asarray([EDGES.index(horizon) for horizon in HORIZONS]) - 1
    elapsed, impulse = jnp.cumsum(covered)[ends], jnp.cumsum(integral[:, 0])[ends]
    speed, turning = means[ends, 3], means[ends, 5]
    final = jnp.maximum(jnp.sum(push.valid) // 3, 1)
    from_end = jnp.sum(push.valid) - jnp.cumsum(push.valid)
    steady = jnp.sum(jnp.where(from_end < final, push.values[:, 0], 0.0)) / final
    tip_speed = jnp.maximum(push.tip_path / jnp.maximum(jnp.sum(push.valid), 1) / push.interval, 0)
    slow = 1e-3  # m/s
    derived = [
        impulse,
        _ratio(impulse, speed, slow),
        _ratio(impulse - steady * elapsed, speed, slow),
        _ratio(turning, speed, slow),
    ]

    force = jnp.linalg.norm(push.values[:, :2], axis=-1)
    peak = jnp.argmax(force)
    last = jnp.argmax(jnp.where(push.valid, push.elapsed, -1.0))
    summary = [
        jnp.sum(push.valid) * push.interval,
        push.tip_path,
        tip_speed,
        force[peak],
        jnp.maximum(push.elapsed[peak], 0.0),
        _ratio(force[peak], steady, 1e-2),
        _ratio(push.displacement[last, 2], push.tip_path, slow),
        _ratio(push.displacement[last, 1], push.tip_path, slow),
    ]
    force_scale = jnp.maximum(jnp.abs(steady), 1e-2)
    scale = jnp.repeat(jnp.stack([force_scale, jnp.maximum(tip_speed, slow)]), 3)
    relative = (means[:, :6] / scale).T.reshape(-1)
    effective = jnp.concatenate(derived[:3]) / force_scale
    return jnp.concatenate([means.T.reshape(-1), *derived, jnp.stack(summary), relative, effective])
