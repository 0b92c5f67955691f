"""The whole push as a series, dense at contact and free of its scale: what a network reads.

In: `Signals`. Out: means of the six signals and of the displacement in bins of time, and the scales
that were taken out. Early bins are in seconds, where mass and contact show; the last ones are equal
parts of the push, where friction shows.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.features.onset import overlap
from mjx_inertia.features.signals import SIGNALS, FeatureSettings, Signals

# Single samples at 100 Hz, then bins that grow, s after contact.
EDGES = (*np.arange(24) * 0.01, *np.geomspace(0.24, 2.4, 10))
PARTS = 6
BINS = len(EDGES) - 1 + PARTS
MEAN_FORCE = "series/mean_force"
_MIRRORED = ("f_y", "m", "m_c", "u_y", "u_cy", "w", "y", "yaw", "tip_y")
SCALES = ("mean_force", "tip_speed", "tip_x", "tip_y")  # N; m/s; direction of the tip's motion


def series_names(settings: FeatureSettings) -> tuple[str, ...]:
    """Such as `series/f_x/30ms` (a bin by its beginning), `series/f_x/part_1` and `series/x/30ms`.

    All bins of a signal follow one another, so that the first columns are a table of 9 signals by
    `BINS`.
    """
    bins = [f"{edge * 1e3:.0f}ms" for edge in EDGES[:-1]]
    bins += [f"part_{part + 1}" for part in range(PARTS)]
    signals = (*SIGNALS[settings.reference][:6], "x", "y", "yaw")
    return (
        *(f"series/{signal}/{name}" for signal in signals for name in bins),
        *(f"series/{scale}" for scale in SCALES),
    )


def series(push: Signals) -> Float[Array, " d"]:
    """Forces over the mean force, moment over it (m), velocities over the tip's speed (w: rad/m).

    A bin beyond the end of the record holds zeros.
    """
    count = jnp.maximum(jnp.sum(push.valid), 1)
    force = jnp.sum(jnp.linalg.norm(push.values[:, :2], axis=-1)) / count
    force = jnp.maximum(force, 1e-2)
    speed = jnp.maximum(push.tip_path / (count * push.interval), 1e-3)
    tip = jnp.sum(push.values[:, 6:8], axis=0) / count / speed

    scaled = push.values[:, :6] / jnp.stack([force] * 3 + [speed] * 3)
    values = jnp.concatenate([scaled, push.displacement], axis=-1)
    edges = jnp.asarray(EDGES, values.dtype)
    parts = jnp.linspace(0.0, 1.0, PARTS + 1, dtype=values.dtype) * count * push.interval
    begin = jnp.concatenate([edges[:-1], parts[:-1]])
    end = jnp.concatenate([edges[1:], parts[1:]])
    weight = overlap(push, begin, end)
    covered = jnp.sum(weight, axis=1)
    # A sliver of a sample, left by rounding at a bin's edge, is no sample.
    seen = covered > 1e-3 * push.interval
    means = weight @ values / jnp.maximum(covered, 1e-9)[:, None]
    means = jnp.where(seen[:, None], means, 0.0)
    return jnp.concatenate([means.T.reshape(-1), jnp.stack([force, speed]), tip])


def series_grid(columns: tuple[str, ...]) -> tuple[int, int]:
    """Signals and bins of the table that the first columns hold, in this order.

    Raises:
      ValueError: they hold none.
    """
    names = [column.split("/") for column in columns if column.startswith("series/")]
    signals = len(names[: -len(SCALES)]) // BINS
    table = [signal for _, signal, *_ in names[: signals * BINS]]
    if not names or len(names) != len(columns) or len(set(table)) != signals:
        raise ValueError(
            f"no table of signals by time among the columns {columns[:3]}, ...: convolutions need "
            "the features `series` and no others"
        )
    return signals, BINS


def mirror_signs(columns: tuple[str, ...]) -> Float[np.ndarray, " d"] | None:
    """What turns a push into its mirror image about the contact normal: -1 where a column flips.

    The CoM's y flips with them, mass and I_zz stay. None for columns of other sets.
    """
    names = [column.split("/") for column in columns]
    if any(name[0] != "series" for name in names):
        return None
    return np.array([-1.0 if name[1] in _MIRRORED else 1.0 for name in names], np.float32)
