"""Figures of what a robot measures during a push. Thesis Fig. 3.4.

In: `PushRecord` with a leading axis. Out: `matplotlib.figure.Figure`.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from mjx_inertia.evaluation.appearance import SERIES, grid_of_axes, styled
from mjx_inertia.pushing import PushRecord


@styled()
def sample_signals(
    records: PushRecord, pushes: Sequence[int], labels: Sequence[str] | None = None
) -> Figure:
    """The eight signals of Eq. 3.11 against time, one colour a push; world axes.

    Args:
      records: pushes with one leading axis.
      pushes: up to six indices of those to show.
      labels: a name for each, such as "2 kg, μ 0.4"; their indices if None.
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
