"""Figures of single pushes: what a robot measures, and what identification found in it.

In: `PushRecord` with a leading axis, and its `Fit`. Out: `matplotlib.figure.Figure`: the eight
signals (thesis Fig. 3.4); measured and fitted signals, values with their intervals, correlations
and the course of the search.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from mjx_inertia.estimators.sysid import Fit, SysidSettings, observe, to_parameters, to_value
from mjx_inertia.estimators.sysid.observation import signal_values, standard_deviation
from mjx_inertia.evaluation.appearance import (
    BLUE,
    DARK,
    GREY,
    ORANGE,
    RED,
    SERIES,
    grid_of_axes,
    note,
    styled,
)
from mjx_inertia.evaluation.summary import Z_95
from mjx_inertia.pushing import PushRecord, PushSetup, Scene, simulate
from mjx_inertia.spatial import AnyArray

# Title, factor and place among the nine compared signals.
_SHOWN = (
    ("force $f_x$, N", 1.0, 0),
    ("force $f_y$, N", 1.0, 1),
    ("moment at the contact, N mm", 1e3, 2),
    ("contact point $u_x$, mm/s", 1e3, 3),
    ("contact point $u_y$, mm/s", 1e3, 4),
    ("yaw rate ω, rad/s", 1.0, 5),
)
# Name and unit of each unknown, as `Beliefs` counts it.
_UNKNOWNS = {
    "mass": ("mass", "kg"),
    "inertia": ("$I_{zz}$", "plates"),
    "com_x": ("CoM x", "half sizes"),
    "com_y": ("CoM y", "half sizes"),
    "friction": ("friction μ", ""),
    "tip_friction": ("tip friction", ""),
    "tip_time_constant": ("contact time", "s"),
    "friction_radius": ("c", "uniform"),
    "probe_mass": ("probe mass", "kg"),
    "force_bias_x": ("force bias x", "N"),
    "force_bias_y": ("force bias y", "N"),
    "force_delay": ("force delay", "s"),
    "pose_x": ("pose x", "m"),
    "pose_y": ("pose y", "m"),
    "pose_yaw": ("pose yaw", "rad"),
}


@styled()
def sample_signals(
    records: PushRecord, pushes: Sequence[int], labels: Sequence[str] | None = None
) -> Figure:
    """The eight signals of Eq. 3.11 against time, one colour a push; world axes.

    `pushes` are up to six indices; `labels` a name for each, such as "2 kg, μ 0.4".
    """
    if not 0 < len(pushes) <= len(SERIES):
        raise ValueError(f"pushes has {len(pushes)} entries; give 1 to {len(SERIES)} indices")
    names = [f"push {p}" for p in pushes] if labels is None else labels
    time, length = np.asarray(records.time), np.asarray(records.length)
    figure, grid = grid_of_axes(2, 4, 2.25, share="x")
    for axes, (label, signal) in zip(grid.ravel(), _signals(records).items(), strict=True):
        for push, name, color in zip(pushes, names, SERIES, strict=False):
            valid = slice(0, int(length[push]))
            axes.plot(
                time[push, valid], signal[push, valid], color=color, linewidth=1.1, label=name
            )
        axes.set_title(label)
        axes.grid(True)
    for axes in grid[-1]:
        axes.set_xlabel("time, s")
    handles, texts = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside upper right", ncols=len(pushes))
    return figure


def _signals(records: PushRecord) -> Mapping[str, np.ndarray]:
    force, twist = np.asarray(records.force), np.asarray(records.twist)
    tip = np.asarray(records.tip_velocity)
    return {
        "force $f_x$, N": force[..., 0],
        "force $f_y$, N": force[..., 1],
        "moment $m$, N m": np.asarray(records.moment),
        "yaw rate ω, rad/s": twist[..., 2],
        "object $u_x$, mm/s": 1e3 * twist[..., 0],
        "object $u_y$, mm/s": 1e3 * twist[..., 1],
        "tip $u_{px}$, mm/s": 1e3 * tip[..., 0],
        "tip $u_{py}$, mm/s": 1e3 * tip[..., 1],
    }


@dataclass(frozen=True)
class FitSignals:
    """The nine signals that identification compares, taken at the contact point."""

    time: Float[np.ndarray, " t"]  # s
    measured: Float[np.ndarray, "t 9"]  # as the sensors gave them
    initial: Float[np.ndarray, "t 9"]  # simulated where the search began
    fitted: Float[np.ndarray, "t 9"]  # simulated where it ended


def _at_contact(record: PushRecord, push: int) -> Float[np.ndarray, "t 9"]:
    pose = jnp.asarray(record.pose[push])
    arm = jnp.asarray(record.contact_point[push]) - pose[0, :2]
    force, moment = jnp.asarray(record.force[push]), jnp.asarray(record.moment[push])
    twist = jnp.asarray(record.twist[push])
    return np.asarray(signal_values(force, moment, twist, pose, pose[0], arm))


def fit_signals(
    scene: Scene,
    records: PushRecord,
    setup: PushSetup,
    fit: Fit,
    push: int,
    centroid: Float[AnyArray, "2"],
    settings: SysidSettings,
) -> FitSignals:
    """Simulates a push where its search began and where it ended.

    The scene has the precision that is wanted. Records, setups and fits have a leading axis, and
    `push` is the row shown; `centroid` is that of the outline, object frame, m.
    """
    record, known = jax.tree.map(lambda x: jnp.asarray(x)[push], (records, setup))
    both = jnp.stack([jnp.asarray(fit.start[push]), jnp.asarray(fit.search.z[push])])
    parameters, instrument = jax.vmap(
        lambda z: to_parameters(z, known, jnp.asarray(centroid), settings)
    )(both)
    motion, pose, point, normal = jax.tree.map(
        lambda x: np.stack([np.asarray(x)] * 2),
        (known.motion, known.pose, record.contact_point, record.contact_normal),
    )
    simulated = simulate(
        scene,
        parameters,
        motion,
        contact_point=point,
        contact_normal=normal,
        pose=pose + np.asarray(instrument.pose_error),
    )
    # the sensor feels its own probe and bias too; both pull at the contact and have no moment there
    acceleration = np.asarray(observe(record, settings).tip_acceleration)
    length = int(np.min([record.length, *simulated.length]))
    signals = []
    for i in range(2):
        carried = instrument.probe_mass[i] * acceleration + np.asarray(instrument.force_bias[i])
        values = _at_contact(simulated, i)[:length].copy()
        values[:, :2] += np.asarray(carried)[:length]
        signals.append(values)
    measured = _at_contact(records, push)[:length]
    return FitSignals(np.asarray(record.time)[:length], measured, *signals)


@styled()
def draw_fit(
    signals: FitSignals,
    fit: Fit,
    push: int,
    settings: SysidSettings,
    *,
    truth: Mapping[str, float] | None = None,
) -> Figure:
    """Measured and simulated signals, values with 95 % intervals, correlations and the cost.

    `push` is the row of `fit` that `signals` are of. `truth` has true values of unknowns by name,
    in the units of `Beliefs`, where they are known.
    """
    figure, grid = grid_of_axes(3, 3, 2.45)
    sigma = np.asarray(standard_deviation(jnp.asarray(signals.fitted), settings.noise))
    for axes, (title, scale, column) in zip(grid[:2].ravel(), _SHOWN, strict=True):
        _draw_signal(axes, signals, sigma, scale, column)
        axes.set_title(title)
    for axes in grid[1]:
        axes.set_xlabel("time, s")
    handles, texts = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside upper right", ncols=len(texts))
    shown = jax.tree.map(lambda x: x[push], fit)
    _draw_values(grid[2, 0], shown, settings, truth or {})
    _draw_correlations(grid[2, 1], shown, settings)
    _draw_cost(grid[2, 2], shown)
    return figure


def _draw_signal(
    axes: Axes, signals: FitSignals, sigma: np.ndarray, scale: float, column: int
) -> None:
    time, fitted = signals.time, scale * signals.fitted[:, column]
    width = scale * Z_95 * sigma[:, column]
    axes.fill_between(
        time,
        fitted - width,
        fitted + width,
        color=BLUE,
        alpha=0.15,
        linewidth=0,
        label="95 % of noise",
    )
    axes.plot(time, scale * signals.measured[:, column], ".", color=DARK, markersize=2.5,
              label="measured")  # fmt: skip
    axes.plot(time, scale * signals.initial[:, column], "--", color=ORANGE, label="initial")
    axes.plot(time, fitted, color=BLUE, label="fitted")
    axes.grid(True)


def _intervals(fit: Fit, settings: SysidSettings) -> Float[np.ndarray, "p 3"]:
    """Lower end, estimate and upper end of each unknown, in its unit."""
    z = np.asarray(fit.search.z)
    variance = np.diagonal(np.asarray(fit.known.covariance))
    misfit = float(fit.misfit)
    deviation = np.sqrt(variance * (misfit if 1.0 < misfit < np.inf else 1.0))
    ends = z[:, None] + Z_95 * deviation[:, None] * np.array([-1.0, 0.0, 1.0])
    rows = [
        to_value(n, jnp.asarray(e), settings.beliefs)
        for n, e in zip(settings.estimated, ends, strict=True)
    ]
    return np.stack([np.asarray(row) for row in rows])


def _draw_values(axes: Axes, fit: Fit, settings: SysidSettings, truth: Mapping[str, float]) -> None:
    rows = []
    for name, (low, middle, high) in zip(
        settings.estimated, _intervals(fit, settings), strict=True
    ):
        word, unit = _UNKNOWNS[name]
        # two digits of the interval, as many decimals everywhere in the row
        decimals = int(np.clip(1 - np.floor(np.log10(0.5 * (high - low) + 1e-12)), 0, 5))
        known = truth.get(name, np.nan)
        value, start, end, true = (
            f"{x:.{decimals}f}".replace("-", "−") for x in (middle, low, high, known)
        )
        label = f"{word}, {unit}" if unit else word
        rows.append([label, value, f"{start} … {end}", true if name in truth else ""])
    head = ["unknown", "value", "95 %", "truth"]
    last = None if any(row[3] for row in rows) else 3
    widths = [0.35, 0.17, 0.34, 0.17][:last]
    table = axes.table(
        [row[:last] for row in rows], colLabels=head[:last], colWidths=widths, bbox=Bbox.unit(),
        cellLoc="left", colLoc="left", edges="horizontal",
    )  # fmt: skip
    table.auto_set_font_size(False)
    table.set_fontsize(7)
    for cell in table.get_celld().values():
        cell.set_edgecolor("#E6E8EB")
        cell.PAD = 0.02
    axes.set_axis_off()
    axes.set_title(f"found, misfit {float(fit.misfit):.2f}")


def _draw_correlations(axes: Axes, fit: Fit, settings: SysidSettings) -> None:
    covariance = np.asarray(fit.known.covariance)
    deviation = np.sqrt(np.diagonal(covariance))
    correlation = covariance / np.outer(deviation, deviation)
    image = axes.imshow(correlation, cmap="RdBu_r", vmin=-1, vmax=1)
    words = [_UNKNOWNS[name][0] for name in settings.estimated]
    axes.set_xticks(range(len(words)), words, rotation=45, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(words)), words)
    axes.tick_params(length=0, labelsize=7.5)
    for (row, column), value in np.ndenumerate(correlation):
        if row != column and abs(value) > 0.5:
            color = "white" if abs(value) > 0.7 else DARK
            options = {"ha": "center", "va": "center", "fontsize": 6.5, "color": color}
            axes.text(column, row, f"{value:.1f}".replace("-", "−"), **options)
    axes.figure.colorbar(image, ax=axes, shrink=0.9)
    axes.set_title("correlation of errors")


def _draw_cost(axes: Axes, fit: Fit) -> None:
    trace = np.asarray(fit.search.trace)
    trace = trace[np.isfinite(trace) & (trace > 0)]
    used = min(len(trace), max(1, int(fit.search.iterations)))
    axes.plot(np.arange(1, used + 1), trace[:used], "o-", color=RED, markersize=3)
    if trace.size and trace[0] > 10 * trace[used - 1]:
        axes.set_yscale("log")
    axes.set_title("cost on the whole push")
    axes.set_xlabel("iteration")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(True, color=GREY, alpha=0.25)
    told = float(fit.known.told)
    note(axes, f"weakest direction: {100 * told:.0f} %\ntold by the push", x=0.96)
