"""Where errors come from: friction, mass, object, contact point, size; as rows and as figures.

In: `HeldOutEstimates`. Out: one `BreakdownRow` per level of a condition; figures. Thesis
Figs 3.5, 3.6 and 3.14.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

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
from mjx_inertia.evaluation.errors import HeldOutEstimates, target_errors
from mjx_inertia.evaluation.summary import format_number

CONDITIONS = ("friction", "mass", "size", "speed", "contact_offset", "angle")
CONDITION_LABELS = {
    "friction": "friction coefficient",
    "mass": "mass, kg",
    "size": "edge or diameter, m",
    "speed": "tip speed, m/s",
    "contact_offset": "contact offset, fraction of half the edge",
    "angle": "push angle, rad",
}
_MAX_LEVELS = 8
_SIGNIFICANT_DIGITS = 4  # what tells two levels apart; float32 noise is far below
_COLOR_LIMIT_QUANTILE = 0.95  # a few huge errors must not bleach the rest


@dataclass(frozen=True)
class Level:
    """Rows at one level of a condition."""

    value: float  # the level, or the middle of its bin, in the unit of the condition
    label: str  # the same for people
    rows: Bool[np.ndarray, " n"]  # which pushes are at this level


@dataclass(frozen=True)
class BreakdownRow:
    """Errors of one target at one level of a condition; NaN where no push has a percentage."""

    condition: str  # one of `CONDITIONS`
    level: float  # value at, or middle of, the level
    label: str  # the level for people
    target: str  # one of `TARGETS`
    n: int  # pushes that the percentages are taken over
    failed: int  # pushes without an estimate
    left_out: int  # pushes without a meaningful percentage
    signed_mean_percent: float  # mean of Eq. 3.12.
    signed_std_percent: float  # its standard deviation
    abs_mean_percent: float  # mean of its absolute value
    abs_mean_mm: float  # mean absolute error of a CoM component, mm; NaN for mass and inertia


def breakdown(
    evaluation: HeldOutEstimates, condition: str, target: str
) -> tuple[BreakdownRow, ...]:
    """Errors of `target` at each level of `condition`, levels rising.

    A condition with up to eight values has a level for each, others are cut into eight bins of
    equal width. Pushes whose condition is unknown are in no row.
    """
    errors = target_errors(evaluation, target)
    rows = []
    for level in condition_levels(condition_values(evaluation, condition)):
        signed = errors.signed_percent[level.rows & errors.used]
        mm = np.empty(0) if errors.signed_mm is None else errors.signed_mm[level.rows]
        mm = mm[np.isfinite(mm)]
        rows.append(
            BreakdownRow(
                condition=condition,
                level=level.value,
                label=level.label,
                target=target,
                n=signed.size,
                failed=int((errors.failed & level.rows).sum()),
                left_out=int((errors.left_out & level.rows).sum()),
                signed_mean_percent=float(signed.mean()) if signed.size else np.nan,
                signed_std_percent=float(signed.std()) if signed.size else np.nan,
                abs_mean_percent=float(np.abs(signed).mean()) if signed.size else np.nan,
                abs_mean_mm=float(np.abs(mm).mean()) if mm.size else np.nan,
            )
        )
    return tuple(rows)


def condition_values(evaluation: HeldOutEstimates, condition: str) -> Float[np.ndarray, " n"]:
    """Values of one of `CONDITIONS`; the mass is the true one."""
    if condition not in CONDITIONS:
        raise ValueError(f"condition is {condition!r}; choose one of {CONDITIONS}")
    if condition == "mass":
        return np.asarray(evaluation.truth.mass, float)
    return np.asarray(getattr(evaluation.conditions, condition), float)


def condition_levels(values: Float[np.ndarray, " n"]) -> tuple[Level, ...]:
    """Levels of `values`, rising: each distinct value, or eight bins where there are more."""
    rounded = np.array([float(f"{value:.{_SIGNIFICANT_DIGITS}g}") for value in values])
    known = np.isfinite(rounded)
    distinct = np.unique(rounded[known] + 0.0)  # + 0.0 turns -0 into 0
    if distinct.size <= _MAX_LEVELS:
        return tuple(Level(float(v), f"{v:.3g}", rounded == v) for v in distinct)
    edges = np.linspace(distinct[0], distinct[-1], _MAX_LEVELS + 1)
    bins = np.clip(np.searchsorted(edges, rounded, side="right") - 1, 0, _MAX_LEVELS - 1)
    return tuple(
        Level(
            float((edges[i] + edges[i + 1]) / 2),
            f"{edges[i]:.2g} to {edges[i + 1]:.2g}",
            known & (bins == i),
        )
        for i in range(_MAX_LEVELS)
        if (known & (bins == i)).any()
    )


@styled()
def errors_by_condition(
    evaluation: HeldOutEstimates, condition: str, baseline: HeldOutEstimates | None = None
) -> Figure:
    """Signed mean (bars), its standard deviation (lines) and mean absolute error (dots) by level.

    Thesis Fig. 3.14, with the absolute error beside the signed mean, in which errors cancel.
    """
    figure, grid = grid_of_axes(1, len(TARGETS), 2.75)
    for axes, target in zip(grid[0], TARGETS, strict=True):
        rows = breakdown(evaluation, condition, target)
        place = np.arange(len(rows))
        mean = np.array([row.signed_mean_percent for row in rows])
        std = np.array([row.signed_std_percent for row in rows])
        axes.axhline(0, color=GREY, linewidth=0.8)
        axes.grid(True, axis="y")
        axes.bar(place, mean, 0.62, color=BLUE, alpha=0.55)
        axes.errorbar(place, mean, std, fmt="none", ecolor=BLUE, elinewidth=1.2, capsize=2.5)
        axes.plot(place, [row.abs_mean_percent for row in rows], "o", color=RED, markersize=5)
        _set_levels(axes, [row.label for row in rows])
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.18 * (high - low))  # room for the note
        axes.set_title(f"{TARGET_AXES[target].symbol}, %")
        axes.set_xlabel(CONDITION_LABELS[condition])
        if baseline is not None:
            constant = np.abs(target_errors(baseline, target).signed_percent)
            note(axes, f"baseline {format_number(_mean(constant))} %")
    grid[0, 0].set_ylabel("percent difference (Eq. 3.12)")
    _legend(figure)
    return figure


@styled()
def error_images(evaluation: HeldOutEstimates, *, max_objects: int = 16) -> Figure:
    """Relative error of mass and I_zz by object (rows, by rising mass) and contact point (columns).

    Thesis Fig. 3.5. Where there are more objects than fit, evenly spread ones of them are shown.
    """
    objects, levels = _objects_by_mass(evaluation), _contact_levels(evaluation)
    shown = objects[np.unique(np.linspace(0, len(objects) - 1, max_objects).round().astype(int))]
    rows_of = np.asarray(evaluation.conditions.object_id)
    height = 1.15 + 0.22 * len(shown)
    figure, grid = grid_of_axes(1, 2, height)
    for axes, target in zip(grid[0], ("mass", "inertia"), strict=True):
        percent = target_errors(evaluation, target).relative_percent
        image = np.array(
            [[_mean(percent[(rows_of == o) & level.rows]) for level in levels] for o in shown]
        )
        known = image[np.isfinite(image)]
        top = float(np.quantile(known, _COLOR_LIMIT_QUANTILE)) if known.size else 1.0
        axes.set_facecolor("#F1F2F4")
        drawn = axes.imshow(image, cmap="cividis", vmin=0, vmax=top or 1.0, aspect="auto")
        bar = figure.colorbar(drawn, ax=axes, extend="max", pad=0.02)
        bar.set_label("|error|, % of the truth")
        bar.outline.set_visible(False)
        axes.spines[:].set_visible(False)
        axes.tick_params(length=0)
        _set_levels(axes, [level.label for level in levels])
        axes.set_yticks(np.arange(len(shown)), [_object_label(evaluation, int(o)) for o in shown])
        axes.set_xlabel(CONDITION_LABELS["contact_offset"])
        axes.set_title(f"{TARGET_AXES[target].symbol}: {len(shown)} of {len(objects)} objects")
    grid[0, 0].set_ylabel("object (true mass)")
    return figure


@styled()
def error_averages(evaluation: HeldOutEstimates) -> Figure:
    """Mean relative error of mass and I_zz for each object and for each contact point.

    Thesis Fig. 3.6: the averages of the rows and columns of the error images, over all objects.
    """
    objects, levels = _objects_by_mass(evaluation), _contact_levels(evaluation)
    rows_of = np.asarray(evaluation.conditions.object_id)
    figure, grid = grid_of_axes(1, 2, 2.9)
    by_object, by_contact = grid[0]
    few = len(objects) <= 40
    for target, color in (("mass", BLUE), ("inertia", RED)):
        percent = target_errors(evaluation, target).relative_percent
        object_means = [_mean(percent[rows_of == o]) for o in objects]
        contact_means = [_mean(percent[level.rows]) for level in levels]
        place = np.arange(1, len(objects) + 1)
        style = "o-" if few else "."
        symbol = TARGET_AXES[target].symbol
        options = {"color": color, "markersize": 4}
        by_object.plot(place, object_means, style, alpha=0.8, label=symbol, **options)
        by_contact.plot([v.value for v in levels], contact_means, "o-", **options)
        if contact_means and np.isfinite(contact_means[-1]):
            last = (levels[-1].value, contact_means[-1])
            by_contact.annotate(
                symbol, last, (6, 0), textcoords="offset points", color=color, va="center"
            )
    by_object.set_xlabel("object, by rising true mass")
    by_object.set_ylabel("mean |error|, % of the truth")
    by_object.set_title("Each object, over all its pushes")
    by_object.legend(loc="upper right", ncols=2, handletextpad=0.3)
    by_contact.set_xlabel(CONDITION_LABELS["contact_offset"])
    by_contact.set_title("Each contact point, over all objects")
    by_contact.margins(x=0.12)
    for axes in grid[0]:
        axes.grid(True, axis="y")
        axes.set_ylim(bottom=0)
    low, high = by_object.get_ylim()
    by_object.set_ylim(low, 1.12 * high)
    return figure


def _legend(figure: Figure) -> None:
    handles = [
        Patch(color=BLUE, alpha=0.55, label="signed mean"),
        Line2D([], [], color=BLUE, linewidth=1.2, label="± standard deviation"),
        Line2D([], [], color=RED, marker="o", markersize=5, linewidth=0, label="mean |error|"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=3, handletextpad=0.5)


def _set_levels(axes: Axes, labels: Sequence[str]) -> None:
    short = [label.replace(" to ", "–") for label in labels]
    crowded = sum(len(label) for label in short) > 26
    turn, anchor = (40, "right") if crowded else (0, "center")
    axes.set_xticks(np.arange(len(short)), short, rotation=turn, ha=anchor)


def _objects_by_mass(evaluation: HeldOutEstimates) -> np.ndarray:
    ids, first = np.unique(np.asarray(evaluation.conditions.object_id), return_index=True)
    return ids[np.argsort(np.asarray(evaluation.truth.mass)[first], kind="stable")]


def _contact_levels(evaluation: HeldOutEstimates) -> tuple[Level, ...]:
    return condition_levels(condition_values(evaluation, "contact_offset"))


def _object_label(evaluation: HeldOutEstimates, object_id: int) -> str:
    row = int(np.argmax(np.asarray(evaluation.conditions.object_id) == object_id))
    name = (evaluation.object_labels or {}).get(object_id, f"no. {object_id}")
    return f"{name} ({float(np.asarray(evaluation.truth.mass)[row]):.3g} kg)"


def _mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else np.nan
