"""Figures of a whole split: estimates against the truth, and claimed against actual uncertainty.

In: `HeldOutEstimates`. Out: `matplotlib.figure.Figure`.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.appearance import (
    BLUE,
    GREY,
    RED,
    TARGET_AXES,
    grid_of_axes,
    note,
    styled,
)
from mjx_inertia.evaluation.errors import COM_TARGETS, TargetErrors, target_errors
from mjx_inertia.evaluation.evaluation import HeldOutEstimates
from mjx_inertia.evaluation.intervals import Z_95, calibrate, z_scores
from mjx_inertia.evaluation.tables import format_number

_Z_LIMIT = 5.0


@styled()
def predicted_against_true(evaluations: Sequence[HeldOutEstimates]) -> Figure:
    """Estimate over truth by target (columns) and estimator (rows), with the identity line."""
    figure, grid = grid_of_axes(len(evaluations), len(TARGETS), 2.65)
    for row, evaluation in zip(grid, evaluations, strict=True):
        for axes, target in zip(row, TARGETS, strict=True):
            _scatter(axes, target_errors(evaluation, target))
        row[0].set_ylabel(f"{evaluation.estimator}\nestimate")
    for axes, target in zip(grid[-1], TARGETS, strict=True):
        axes.set_xlabel(f"true {TARGET_AXES[target].label}")
    for axes, target in zip(grid[0], TARGETS, strict=True):
        axes.set_title(f"{TARGET_AXES[target].symbol} ({TARGET_AXES[target].unit})")
    return figure


@styled()
def calibration_histograms(evaluation: HeldOutEstimates) -> Figure:
    """Histogram of (truth - estimate)/sigma for each target over the standard normal density."""
    figure, grid = grid_of_axes(1, len(TARGETS), 2.6, share="y")
    line = np.linspace(-_Z_LIMIT, _Z_LIMIT, 201)
    density = np.exp(-(line**2) / 2) / np.sqrt(2 * np.pi)
    for axes, target in zip(grid[0], TARGETS, strict=True):
        errors = target_errors(evaluation, target)
        answered = ~errors.failed
        z = z_scores(errors.truth[answered], errors.estimate[answered], errors.sigma[answered])
        axes.set_title(TARGET_AXES[target].symbol)
        axes.set_xlabel("z = (truth − estimate)/σ")
        axes.plot(line, density, color=RED, linewidth=1.6, zorder=3)
        axes.set_xlim(-_Z_LIMIT, _Z_LIMIT)
        if not z.size:
            note(axes, "no σ given")
            continue
        bins = np.linspace(-_Z_LIMIT, _Z_LIMIT, 41)
        shown = np.clip(z, -_Z_LIMIT, _Z_LIMIT)  # outliers pile up in the outermost bins
        weights = np.full(z.size, 1 / (z.size * (bins[1] - bins[0])))
        axes.hist(shown, bins=bins, weights=weights, color=BLUE, alpha=0.55)
        found = calibrate(z)
        note(
            axes,
            f"RMS z {found.z_rms:.2f}\n±1σ: {100 * found.coverage_68:.0f} % of 68 %\n"
            f"±{Z_95:.2f}σ: {100 * found.coverage_95:.0f} % of 95 %",
        )
    grid[0, 0].set_ylabel("density")
    low, high = grid[0, 0].get_ylim()
    grid[0, 0].set_ylim(low, 1.45 * high)  # room for the notes
    return figure


def _scatter(axes: Axes, errors: TargetErrors) -> None:
    scale = TARGET_AXES[errors.target].scale
    shown = ~errors.failed & np.isfinite(errors.truth)
    truth, estimate = scale * errors.truth[shown], scale * errors.estimate[shown]
    axes.grid(True)
    if not truth.size:
        note(axes, "no estimates")
        return
    # The axes span the truth; the few estimates far outside are drawn at the border.
    low, high = float(truth.min()), float(truth.max())
    margin = 0.22 * (high - low) or 0.22 * abs(high) or 1.0
    low, high = low - margin, high + margin
    outside = (estimate < low) | (estimate > high)
    alpha = float(np.clip(60 / np.sqrt(truth.size) / 12, 0.06, 0.5))
    axes.plot([low, high], [low, high], color=GREY, linewidth=1, zorder=1)
    axes.scatter(
        truth[~outside],
        estimate[~outside],
        s=9,
        color=BLUE,
        alpha=alpha,
        linewidths=0,
        rasterized=True,
        zorder=2,
    )
    if outside.any():
        border = np.clip(estimate[outside], low, high)
        options = {"s": 14, "marker": "x", "color": RED, "linewidths": 0.9, "clip_on": False}
        axes.scatter(truth[outside], border, zorder=3, **options)
    axes.set(xlim=(low, high), ylim=(low, high))
    axes.set_box_aspect(1)
    axes.locator_params(nbins=5)
    if errors.target in COM_TARGETS and errors.signed_mm is not None:
        mm = np.abs(errors.signed_mm[shown])
        text = f"mean |error| {format_number(float(mm.mean()))} mm"
    else:
        absolute = np.abs(errors.signed_percent[errors.used])
        text = f"mean |error| {format_number(float(absolute.mean()))} %"
    if outside.any():
        text += f"\n{outside.sum()} beyond (×)"
    note(axes, text)
