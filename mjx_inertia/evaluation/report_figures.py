"""The figures that every report has, each with a sentence on what to see.

In: evaluations. Out: `Section`s.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from mjx_inertia.evaluation.accuracy_figures import calibration_histograms, predicted_against_true
from mjx_inertia.evaluation.condition_figures import (
    error_averages,
    error_images,
    errors_by_condition,
)
from mjx_inertia.evaluation.error_breakdown import condition_levels, condition_values
from mjx_inertia.evaluation.evaluation import HeldOutEstimates
from mjx_inertia.evaluation.summary import TargetSummary, leading_estimator

_THESIS_CONDITIONS = ("friction", "mass")  # Fig. 3.14
_ALL_CONDITIONS = ("friction", "mass", "size", "speed")


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
