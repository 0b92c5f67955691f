"""The four sets of features of one push, each with its names: windows, moments, onset, series.

In: `Signals` of one push. Out: a vector.

`windows` are the thesis' 72: mean, std and RMS of eight signals in three equal windows, in this
order: signal, window, statistic (§3.4, errata 8). `moments` are the 12 of its real pushes: mean and
variance of f_x, f_y, torque, x, y, yaw, the last three from the start of contact (§3.3.4).

`onset` is the first half second after contact, finer towards contact, where the mass shows. Once
the object slides steadily, a push shows friction times mass only (errata 12), and three equal
windows average the transient away. It holds means of the eight signals in bins whose edges are
seconds (so at any sampling rate), a few quantities that mechanics suggests, and both freed of the
scale of the push.

`series` is the whole push, dense at contact and free of its scale, for a network: means of the six
signals and of the displacement in bins of time, and the scales that were taken out. Early bins are
in seconds, where mass and contact show; the last ones are equal parts of the push, where friction
shows.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.features.signals import SIGNALS, FeatureSettings, Signals

WINDOWS = 3
STATISTICS = ("mean", "std", "rms")
# Single samples at 100 Hz, then bins that grow, s after contact.
ONSET_EDGES = (*np.arange(13) * 0.01, 0.14, 0.17, 0.21, 0.27, 0.36, 0.5)
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
# Single samples at 100 Hz, then bins that grow, s after contact.
SERIES_EDGES = (*np.arange(24) * 0.01, *np.geomspace(0.24, 2.4, 10))
PARTS = 6
BINS = len(SERIES_EDGES) - 1 + PARTS
MEAN_FORCE = "series/mean_force"
_MIRRORED = ("f_y", "m", "m_c", "u_y", "u_cy", "w", "y", "yaw", "tip_y")
SCALES = ("mean_force", "tip_speed", "tip_x", "tip_y")  # N; m/s; direction of the tip's motion


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


def onset_names(settings: FeatureSettings) -> tuple[str, ...]:
    """Such as `onset/f_x/30ms` (a bin by its beginning) and `onset/effective_mass/60ms`."""
    bins = [
        f"onset/{signal}/{edge * 1e3:.0f}ms"
        for signal in SIGNALS[settings.reference]
        for edge in ONSET_EDGES[:-1]
    ]
    derived = [
        f"onset/{quantity}/{horizon * 1e3:.0f}ms"
        for quantity in ("impulse", "effective_mass", "net_effective_mass", "turn_by_speed")
        for horizon in HORIZONS
    ]
    relative = [
        f"onset/relative/{signal}/{edge * 1e3:.0f}ms"
        for signal in SIGNALS[settings.reference][:6]
        for edge in ONSET_EDGES[:-1]
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


def _binned(
    push: Signals, values: Float[Array, "t d"], begin: Float[Array, " b"], end: Float[Array, " b"]
) -> tuple[Float[Array, "b d"], Float[Array, "b d"], Float[Array, " b"]]:
    """Means and integrals of values over bins, s after contact, and the seconds that they cover.

    A bin beyond the end of the record holds zeros.
    """
    # seconds that each sampling interval shares with each bin; zero outside contact
    first, last = push.elapsed, push.elapsed + push.interval
    shared = jnp.minimum(last, end[:, None]) - jnp.maximum(first, begin[:, None])
    weight = jnp.where(push.valid, jnp.maximum(shared, 0.0), 0.0)
    covered = jnp.sum(weight, axis=1)
    integral = weight @ values
    # A sliver of a sample, left by rounding at a bin's edge, is no sample.
    seen = covered > 1e-3 * push.interval
    means = jnp.where(seen[:, None], integral / jnp.maximum(covered, 1e-9)[:, None], 0.0)
    return means, integral, covered


def onset(push: Signals) -> Float[Array, "302"]:
    """Means by bin, then derived quantities; a bin beyond the end of the record holds zeros.

    `relative` columns are free of the push's scale: forces over the steady force, motion over the
    tip's speed. They are alike for cubes of any mass pushed alike, and so tell friction and shape.
    """
    edges = jnp.asarray(ONSET_EDGES, push.values.dtype)
    means, integral, covered = _binned(push, push.values, edges[:-1], edges[1:])

    # Momentum of what is moved, normal to the surface: m_eff du_cx = (f_x - friction) dt.
    ends = jnp.asarray([ONSET_EDGES.index(horizon) for horizon in HORIZONS]) - 1
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


def series_names(settings: FeatureSettings) -> tuple[str, ...]:
    """Such as `series/f_x/30ms` (a bin by its beginning), `series/f_x/part_1` and `series/x/30ms`.

    All bins of a signal follow one another, so that the first columns are a table of 9 signals by
    `BINS`.
    """
    bins = [f"{edge * 1e3:.0f}ms" for edge in SERIES_EDGES[:-1]]
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
    edges = jnp.asarray(SERIES_EDGES, values.dtype)
    parts = jnp.linspace(0.0, 1.0, PARTS + 1, dtype=values.dtype) * count * push.interval
    begin = jnp.concatenate([edges[:-1], parts[:-1]])
    end = jnp.concatenate([edges[1:], parts[1:]])
    means, _, _ = _binned(push, values, begin, end)
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


@dataclass(frozen=True)
class FeatureSet:
    """Names of the features under given settings, and the features of one push."""

    names: Callable[[FeatureSettings], tuple[str, ...]]
    compute: Callable[[Signals], Float[Array, " d"]]


def _onset_names(settings: FeatureSettings) -> tuple[str, ...]:
    return windows_names(settings) + onset_names(settings)


def _onset(push: Signals) -> Float[Array, " d"]:
    return jnp.concatenate([windows(push), onset(push)])


FEATURE_SETS = {
    "windows": FeatureSet(windows_names, windows),
    "moments": FeatureSet(moments_names, moments),
    "series": FeatureSet(series_names, series),
    "onset": FeatureSet(_onset_names, _onset),  # holds `windows` too
}


def feature_set_of(feature_set: str) -> FeatureSet:
    """The set of that name.

    Raises:
      ValueError: there is none.
    """
    if feature_set not in FEATURE_SETS:
        raise ValueError(f"feature_set={feature_set!r} is not one of {sorted(FEATURE_SETS)}")
    return FEATURE_SETS[feature_set]


_FAMILIES = {"onset": ("windows", "onset")}


def families_of(feature_set: str) -> tuple[str, ...]:
    """The sets whose columns a set holds, itself among them."""
    return _FAMILIES.get(feature_set, (feature_set,))
