"""Manoeuvres and searches as figures: thesis Figs 7.2 and 7.3, and what helps to choose.

In: fronts, paths. Out: figures, drawn without a window.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy import ndarray

from mjx_inertia.robots import Robot
from mjx_inertia.space.manoeuvre_path import ManoeuvrePath

_CHOSEN = ("tab:red", "tab:green", "tab:orange", "tab:purple")
# ten colours, then the same ones paler
_JOINTS = [color for pale in (0, 1) for color in colormaps["tab20"].colors[pale::2]]
_OTHERS, _BASELINE = "tab:blue", "0.4"


def fronts_figure(
    fronts: Mapping[str, tuple[Sequence[str], Float[ndarray, "n k"]]],
    baseline: Mapping[str, float],
) -> Figure:
    """Fig. 7.2: each front of three costs, seen along its axes; a cross is the straight quintic.

    Args:
      fronts: names of the costs and the costs themselves, by title.
      baseline: costs of the straight quintic by name.
    """
    figure, axes = _axes(len(fronts), 2, (9.0, 3.2 * len(fronts)))
    for row, (title, (names, costs)) in zip(axes, fronts.items(), strict=True):
        for ax, (i, j) in zip(row, ((0, 1), (0, 2)), strict=True):
            ax.plot(costs[:, i], costs[:, j], ".", color=_OTHERS, ms=4)
            ax.plot(baseline[names[i]], baseline[names[j]], "x", color=_BASELINE)
            ax.set_xlabel(names[i])
            ax.set_ylabel(names[j])
        row[0].set_title(title, loc="left")
    return figure


def path_figure(robot: Robot, path: ManoeuvrePath) -> Figure:
    """Fig. 7.3 and beyond: joints, their rates and accelerations, torques, wrenches, the base."""
    figure, axes = _axes(3, 2, (11.0, 9.0))
    time = np.asarray(path.time)
    names = robot.joint_names or tuple(str(i + 1) for i in range(robot.dof))
    for ax, signal, label in zip(
        axes.ravel()[:4],
        (path.motion.q, path.motion.qd, path.motion.qdd, path.torque),
        ("joints, rad", "rates, rad/s", "accelerations, rad/s²", "torques, N m"),
        strict=True,
    ):
        ax.set_prop_cycle(color=_JOINTS[: max(10, len(names))])
        lines = ax.plot(time, np.asarray(signal))
        ax.set_ylabel(label)
    figure.legend(lines, names, fontsize=7, ncols=7, loc="outside lower center")
    parts = [("fx", "fy", "fz", "nx", "ny", "nz")[i] for i in robot.axes]
    for wrench, style in ((path.nodes.total_wrench, "-"), (path.nodes.object_wrench, "--")):
        axes[2, 0].set_prop_cycle(None)
        lines = axes[2, 0].plot(time, np.asarray(wrench), style)
    axes[2, 0].legend(lines, parts, fontsize=7, ncols=2)
    axes[2, 0].set_ylabel("F_tot (–), on the object (- -), N, N m")
    place = np.asarray(path.T_world_base.translation)
    axes[2, 1].plot(time, place[:, :2] if robot.planar else place)
    axes[2, 1].set_ylabel("base, m")
    for ax in axes[2]:
        ax.set_xlabel("time, s")
    return figure


def parallel_figure(
    costs: Float[ndarray, "n k"],
    names: Sequence[str],
    chosen: Mapping[str, int],
    baseline: Float[ndarray, " k"],
) -> Figure:
    """All costs of a front beside each other, each over the straight quintic's.

    Args:
      costs: one row a decision.
      names: of the costs.
      chosen: rows to show, by name.
      baseline: costs of the straight quintic.
    """
    figure, axes = _axes(1, 1, (10.0, 4.5))
    ax = axes[0, 0]
    shown = costs / np.where(baseline > 0.0, baseline, 1.0)
    ax.plot(shown.T, color=_OTHERS, alpha=0.25, lw=0.7)
    for color, (name, row) in zip(_CHOSEN, chosen.items(), strict=False):
        ax.plot(shown[row], color=color, lw=2.0, label=name)
    ax.axhline(1.0, color=_BASELINE, ls=":", label="straight quintic")
    ax.set_xticks(range(len(names)), names, rotation=30, ha="right")
    ax.set_yscale("log")
    ax.set_ylabel("cost / that of the straight quintic")
    ax.legend(fontsize=8)
    return figure


def progress_figure(
    runs: Mapping[str, tuple[Int[ndarray, " s"], Float[ndarray, " s"]]],
) -> Figure:
    """Hypervolume against evaluations, by optimiser."""
    figure, axes = _axes(1, 1, (7.0, 4.5))
    ax = axes[0, 0]
    for name, (evaluations, volume) in runs.items():
        ax.plot(evaluations, volume, label=name)
    ax.set_xscale("log")
    ax.set_xlabel("evaluations")
    ax.set_ylabel("hypervolume")
    ax.legend(fontsize=8)
    return figure


def _axes(rows: int, columns: int, size: tuple[float, float]) -> tuple[Figure, ndarray]:
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    axes: ndarray = figure.subplots(rows, columns, squeeze=False)
    for ax in axes.ravel():
        _plain(ax)
    return figure, axes


def _plain(ax: Axes) -> None:
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=8)
