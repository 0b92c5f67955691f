"""The figures that every report has, each with a sentence on what to see.

In: `HeldOutEstimates`, or the nodes of a tree, root first. Out: `Section`s, and the figures alone:
estimates against the truth, claimed against actual uncertainty, a tree (thesis Fig. 3.13).
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjx_inertia.estimators import TARGETS, TreeNode
from mjx_inertia.evaluation.appearance import (
    BLUE,
    DARK,
    GREY,
    PAGE_WIDTH_IN,
    RED,
    TARGET_AXES,
    grid_of_axes,
    note,
    styled,
)
from mjx_inertia.evaluation.condition_figures import (
    condition_levels,
    condition_values,
    error_averages,
    error_images,
    errors_by_condition,
)
from mjx_inertia.evaluation.errors import COM_TARGETS, HeldOutEstimates, TargetErrors, target_errors
from mjx_inertia.evaluation.summary import (
    Z_95,
    TargetSummary,
    calibrate,
    format_number,
    leading_estimator,
    z_scores,
)

_Z_LIMIT = 5.0
_LEVEL_HEIGHT_IN = 1.05
_THESIS_CONDITIONS = ("friction", "mass")  # Fig. 3.14
_ALL_CONDITIONS = ("friction", "mass", "size", "speed")


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


@styled()
def draw_tree(
    nodes: Sequence[TreeNode], value_labels: Sequence[str] = (), *, max_depth: int = 3
) -> Figure:
    """The first levels of a tree; a branch that is cut ends in an ellipsis.

    `value_labels` has one text a target, such as "m {:.2f} kg", in which `str.format` puts the
    number; `max_depth` levels below the root are drawn.
    """
    _check(nodes)
    place = _arrange(nodes, max_depth)
    depth = -min(y for _, y in place.values())
    columns = max(x for x, _ in place.values()) + 1
    figure = Figure(figsize=(PAGE_WIDTH_IN, (depth + 1) * _LEVEL_HEIGHT_IN), layout="constrained")
    axes = figure.subplots()
    axes.set_axis_off()
    axes.set(xlim=(-0.6, columns - 0.4), ylim=(-depth - 0.5, 0.45))
    size = 8.5 if columns <= 8 else 7.0
    for index, (x, y) in place.items():
        node = nodes[index]
        inner = node.feature is not None and -y < max_depth
        if inner:
            for child, word in zip(_children(node), ("yes", "no"), strict=True):
                _branch(axes, (x, y), place[child], word, size)
        if inner:
            text = f"{node.feature}\n< {node.threshold:.3g}"
        else:
            text = "…" if node.value is None else _value(node.value, value_labels)
        face, edge = ("#E3EEF6", BLUE) if inner else ("#F4F4F5", GREY)
        box = {"boxstyle": "round,pad=0.35", "facecolor": face, "edgecolor": edge, "linewidth": 0.9}
        axes.text(x, y, text, ha="center", va="center", fontsize=size, color=DARK, bbox=box)
    return figure


def _children(node: TreeNode) -> tuple[int, int]:
    assert node.left is not None and node.right is not None  # as at every split
    return node.left, node.right


def _arrange(nodes: Sequence[TreeNode], max_depth: int) -> dict[int, tuple[float, float]]:
    """Place (column, minus level) by node: leaves side by side, parents above their middle."""
    place: dict[int, tuple[float, float]] = {}
    leaves = itertools.count()

    def put(index: int, level: int) -> float:
        node = nodes[index]
        if node.feature is None or level == max_depth:
            x = float(next(leaves))
        else:
            left, right = _children(node)
            x = (put(left, level + 1) + put(right, level + 1)) / 2
        place[index] = (x, -float(level))
        return x

    put(0, 0)
    return place


def _branch(
    axes: Axes, parent: tuple[float, float], child: tuple[float, float], word: str, size: float
) -> None:
    axes.plot([parent[0], child[0]], [parent[1], child[1]], color=GREY, linewidth=0.9, zorder=0)
    middle = (0.45 * parent[0] + 0.55 * child[0], 0.45 * parent[1] + 0.55 * child[1])
    axes.text(
        *middle,
        word,
        fontsize=size - 1,
        ha="center",
        va="center",
        color="#59616B",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
    )


def _value(value: Sequence[float], labels: Sequence[str]) -> str:
    if not labels:
        return "\n".join(f"{v:.3g}" for v in value)
    return "\n".join(label.format(v) for label, v in zip(labels, value, strict=True))


def _check(nodes: Sequence[TreeNode]) -> None:
    if not nodes:
        raise ValueError("nodes is empty; give at least a root")
    for index, node in enumerate(nodes):
        if node.feature is None:
            continue
        for child in _children(node):
            if not index < child < len(nodes):
                raise ValueError(
                    f"nodes[{index}] has child {child}; children must come after their parent "
                    f"and before {len(nodes)}"
                )


@dataclass(frozen=True)
class Section:
    """One part of a report."""

    title: str  # heading
    # a figure, HTML that is known to be safe (`markupsafe.Markup`), or plain text, which is escaped
    # and keeps its line breaks
    body: Figure | Markup | str
    caption: str = ""  # what to see; plain text


@dataclass(frozen=True)
class _Planned:
    title: str
    draw: Callable[[], Figure]
    caption: str


def plan_split_figures(
    evaluations: Sequence[HeldOutEstimates],
    summaries: Sequence[TargetSummary],
    baseline: str,
    *,
    in_detail: bool,
) -> Iterator[_Planned]:
    """Figures of one split, to be drawn one by one; all but the first show its leader.

    Without `in_detail` they stop after those that the thesis shows of its large dataset.
    """
    by_name = {evaluation.estimator: evaluation for evaluation in evaluations}
    leader = by_name[leading_estimator(summaries, baseline)]
    constant = by_name.get(baseline) if leader.estimator != baseline else None
    shown = [e for e in evaluations if e.estimator != baseline] or list(evaluations)
    shown.sort(key=lambda e: e is not leader)
    split = leader.split
    yield _Planned(
        f"Estimate against truth, split {split}",
        partial(predicted_against_true, shown),
        "Each dot is one push; on the line the estimate is right. A cloud flatter than the line "
        "means that the estimator retreats to the mean. The axes span the truths; × marks "
        "estimates beyond them.",
    )
    caption = (
        "Bars and lines are the thesis metric, signed mean ± standard deviation (positive: the "
        "estimate is too small). Dots are the mean absolute error, in which errors of opposite "
        "sign cannot cancel; compare them with the baseline's in the corner."
    )
    for condition in _ALL_CONDITIONS if in_detail else _THESIS_CONDITIONS:
        if len(condition_levels(condition_values(leader, condition))) > 1:
            yield _Planned(
                f"{leader.estimator} by {condition}, split {split}",
                partial(errors_by_condition, leader, condition, constant),
                caption,
            )
            caption = ""  # the same for all
    if not in_detail:
        return
    if len(condition_levels(condition_values(leader, "contact_offset"))) > 1:
        yield _Planned(
            f"{leader.estimator} by object and contact point, split {split}",
            partial(error_images, leader),
            "Relative error of single objects (rows) pushed at single points (columns); bright is "
            "worse, grey was not tested. Pushes through the middle hardly turn the object, so "
            "I_zz should be worst in the middle columns.",
        )
        yield _Planned(
            f"{leader.estimator}: averages of rows and columns, split {split}",
            partial(error_averages, leader),
            "Left: which objects are hard. Right: where to push; the lowest point of each curve "
            "is the best contact point for that parameter.",
        )
    if np.isfinite(np.asarray(leader.estimate.covariance)).any():
        yield _Planned(
            f"Does {leader.estimator} know how wrong it is? Split {split}",
            partial(calibration_histograms, leader),
            "Errors divided by the standard deviation that the estimator itself claims. Honest "
            "uncertainty follows the curve; a histogram wider than it means overconfidence.",
        )
