"""What pushes can tell, drawn: maps of the bound, and errors from push to push.

In: arrays of bounds or errors. Out: `matplotlib.figure.Figure`.
"""

import math

import numpy as np
from jaxtyping import Float
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from mjx_inertia.evaluation.appearance import BLUE, DARK, ORANGE, grid_of_axes, styled

_TITLES = ("mass, %", "$I_{zz}$, %", "CoM, mm")


def _round_numbers(low: float, high: float) -> list[float]:
    """Ticks of a logarithmic scale: 1, 2, 5 of each decade, or 1 alone where that is too many."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [m * 10.0**e for e in decades for m in (1, 2, 5)]
    ticks = [t for t in ticks if 0.999 * low <= t <= 1.001 * high]
    return ticks if len(ticks) <= 6 else [t for t in ticks if f"{t:e}"[0] == "1"]


@styled()
def draw_bound_maps(
    x: tuple[str, Float[np.ndarray, " c"]],
    y: tuple[str, Float[np.ndarray, " r"]],
    values: Float[np.ndarray, "r c 3"],
    log: str,
) -> Figure:
    """Maps of the bounds of mass (%), I_zz (%) and CoM (mm), with colours by decades.

    Args:
      x: label and values of the horizontal axis.
      y: label and values of the vertical axis.
      values: bounds.
      log: the axes that are logarithmic: "", "x", "y" or "xy".
    """
    figure, axes = grid_of_axes(1, 3, 3.0)
    for k, (panel, title) in enumerate(zip(axes[0], _TITLES, strict=True)):
        part = values[..., k]
        norm = LogNorm(part.min(), max(part.max(), 1.01 * part.min()))
        mesh = panel.pcolormesh(x[1], y[1], part, cmap="viridis_r", norm=norm, shading="nearest")
        for axis, at in ((panel.xaxis, x[1]), (panel.yaxis, y[1])):
            if ("x" if axis is panel.xaxis else "y") in log:
                panel.set(**{f"{axis.axis_name}scale": "log"})
                ticks = _round_numbers(at.min(), at.max())
                axis.set_ticks(ticks, [f"{t:g}" for t in ticks])
                axis.set_ticks([], minor=True)
        best = np.unravel_index(np.argmin(part), part.shape)
        panel.plot(x[1][best[1]], y[1][best[0]], "o", mfc="none", mec=DARK, clip_on=False)
        panel.set_title(f"{title} (least {part.min():.3g})")
        panel.set_xlabel(x[0])
        panel.set_ylabel(y[0] if k == 0 else "")
        bar = figure.colorbar(mesh, ax=panel, pad=0.02)
        ticks = _round_numbers(norm.vmin or part.min(), norm.vmax or part.max())
        bar.set_ticks(ticks, labels=[f"{t:g}" for t in ticks])
        bar.set_ticks([], minor=True)
    return figure


@styled()
def draw_sequences(
    chosen: Float[np.ndarray, "k s 6"], random: Float[np.ndarray, "l s 6"]
) -> Figure:
    """Error after each push: median and middle half of the objects; lines dashed: as stated.

    Args:
      chosen: after each of k pushes that were chosen, of s objects: error of mass (%), I_zz (%) and
        CoM (mm), then the deviations stated.
      random: the same after each of l pushes at random.
    """
    figure, axes = grid_of_axes(1, 3, 3.0)
    for i, (panel, title) in enumerate(zip(axes[0], _TITLES, strict=True)):
        parts = (("chosen", chosen, BLUE), ("random", random, ORANGE))
        for name, part, colour in parts:
            x = np.arange(1, len(part) + 1)
            low, middle, high = np.quantile(part[..., i], (0.25, 0.5, 0.75), axis=1)
            panel.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0)
            panel.plot(x, middle, "o-", color=colour, markersize=4, label=name)
            stated = np.median(part[..., 3 + i], 1)
            panel.plot(x, stated, "--", color=colour, label=f"{name}, deviation stated")
        panel.set_yscale("log")
        panel.grid(True, axis="y")
        panel.set_title(title)
        panel.set_xlabel("pushes")
    axes[0, 0].set_ylabel("error, median of objects")
    axes[0, 2].legend()
    return figure
