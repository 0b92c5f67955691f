"""How every figure looks, and how it becomes a part of a page.

One palette (Okabe and Ito 2008: told apart by colour-blind readers), one size of text, thin frames.
"""

import base64
import io
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, GREY, DARK = "#CC79A7", "#56B4E9", "#8A8F98", "#24292F"
SERIES = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY)
PAGE_WIDTH_IN = 10.6  # fills the report's column at 100 % zoom
SMALL_SVG_BYTES = 250_000  # below this sharp lines are worth more than a smaller PNG

STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.labelcolor": DARK,
    "axes.edgecolor": "#B4B9C0",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "mathtext.default": "regular",
    "xtick.color": "#59616B",
    "ytick.color": "#59616B",
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "grid.color": "#E6E8EB",
    "grid.linewidth": 0.7,
    "text.color": DARK,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "mjx_inertia",  # the same figure gives the same bytes
}


@dataclass(frozen=True)
class TargetAxis:
    """How a target is written on an axis."""

    symbol: str  # short name
    unit: str  # unit on the axis
    scale: float  # from SI to that unit

    @property
    def label(self) -> str:
        """Symbol and unit."""
        return f"{self.symbol}, {self.unit}"


TARGET_AXES = {
    "mass": TargetAxis("mass", "kg", 1.0),
    "inertia": TargetAxis("$I_{zz}$", "10⁻³ kg m²", 1e3),
    "com_x": TargetAxis("CoM x", "mm", 1e3),
    "com_y": TargetAxis("CoM y", "mm", 1e3),
}


def styled() -> Any:
    """Context, and decorator of figure functions, in which `STYLE` holds."""
    return mpl.rc_context(STYLE)


def grid_of_axes(
    rows: int, columns: int, row_height_in: float, *, share: str = ""
) -> tuple[Figure, np.ndarray]:
    """A figure as wide as the page with rows × columns axes; `share` "x" or "y": a common scale."""
    figure = Figure(figsize=(PAGE_WIDTH_IN, rows * row_height_in), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=share == "x", sharey=share == "y")
    return figure, axes


def note(axes: Axes, text: str, *, x: float = 0.04, y: float = 0.96) -> None:
    """Writes `text` inside the upper left corner of `axes`, or at x, y in fractions of them."""
    axes.text(
        x,
        y,
        text,
        transform=axes.transAxes,
        ha="left" if x < 0.5 else "right",
        va="top" if y > 0.5 else "bottom",
        fontsize=8.5,
        bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.5},
    )


def to_data_uri(figure: Figure, *, png_dpi: int = 160) -> str:
    """The figure as a `data:` address: SVG, or PNG where the SVG is big and the PNG smaller.

    Fixes the layout of the figure, which `savefig` would otherwise compute for each format anew.
    """
    with styled():
        engine = figure.get_layout_engine()
        if engine is not None:
            engine.execute(figure)
            figure.set_layout_engine("none")
        stream = io.BytesIO()
        figure.savefig(stream, format="svg", dpi=png_dpi, metadata={"Date": None})
        svg = stream.getvalue()
        if len(svg) > SMALL_SVG_BYTES:
            stream = io.BytesIO()
            figure.savefig(stream, format="png", dpi=png_dpi)
            if len(stream.getvalue()) < len(svg):
                return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
    return "data:image/svg+xml;base64," + base64.b64encode(svg).decode()
