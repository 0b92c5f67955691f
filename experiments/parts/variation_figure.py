"""Errors of cubes that differ from a nominal one in a single property (thesis Fig. 3.7)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from mjx_inertia.evaluation.appearance import (
    BLUE,
    ORANGE,
    RED,
    TARGET_AXES,
    grid_of_axes,
    styled,
)


@dataclass(frozen=True)
class VariationGroup:
    """Relative errors (Eq. 3.5) of the cubes in which one property was varied."""

    name: str  # what was varied, such as "size ±30 %"
    mass_error_percent: Float[np.ndarray, " n"]  # one value a cube
    inertia_error_percent: Float[np.ndarray, " n"]  # one value a cube


@styled()
def variation_boxes(groups: Sequence[VariationGroup]) -> Figure:
    """Box plots of mass and I_zz errors of cubes varied around a nominal one. Thesis Fig. 3.7."""
    figure, grid = grid_of_axes(1, 2, 3.0)
    names = [group.name for group in groups]
    for axes, target in zip(grid[0], ("mass", "inertia"), strict=True):
        for place, group in enumerate(groups, start=1):
            values = getattr(group, f"{target}_error_percent")
            values = values[np.isfinite(values)]
            axes.boxplot(
                [values],
                positions=[place],
                widths=0.5,
                showfliers=False,
                patch_artist=True,
                boxprops={"facecolor": "#D6E6F2", "edgecolor": BLUE},
                medianprops={"color": RED, "linewidth": 2},
                whiskerprops={"color": BLUE},
                capprops={"color": BLUE},
            )
            spread = place + np.linspace(-0.12, 0.12, values.size)
            axes.plot(spread, values, "o", color=ORANGE, markersize=4, alpha=0.9)
        axes.set_xticks(np.arange(1, len(names) + 1), names)
        axes.grid(True, axis="y")
        axes.set_ylim(bottom=0)
        axes.set_title(TARGET_AXES[target].symbol)
        axes.set_xlabel("varied, others nominal")
    grid[0, 0].set_ylabel("|error|, % of the truth")
    return figure
