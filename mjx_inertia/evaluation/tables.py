"""Summaries as words: results.csv for a program, a table for a terminal, sentences for the report.

In: summaries. Out: text, made from the numbers and from nothing else.
"""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mjx_inertia.command import aligned
from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.summary import TargetSummary, leading_estimator
from mjx_inertia.files import write_whole

RESULT_COLUMNS = (
    "dataset",
    "split",
    "estimator",
    "target",
    "n",
    "failed",
    "signed_mean_percent",
    "signed_std_percent",
    "abs_mean_percent",
    "abs_median_percent",
)
TARGET_NAMES = {"mass": "mass", "inertia": "I_zz", "com_x": "CoM x", "com_y": "CoM y"}


def _results(summaries: Sequence[TargetSummary]) -> str:
    """The rows of results.csv; `n` counts the pushes that the percentages are taken over."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(RESULT_COLUMNS)
    for row in summaries:
        values = [getattr(row, column) for column in RESULT_COLUMNS]
        writer.writerow([f"{v:.6g}" if isinstance(v, float) else v for v in values])
    return stream.getvalue()


def write_results(path: Path, summaries: Sequence[TargetSummary]) -> None:
    """Writes results.csv whole or not at all."""
    write_whole(path, _results(summaries))


def format_number(value: float) -> str:
    """An error for people: 0.42, 4.8, 49.7, 150; a dash where there is none."""
    if not np.isfinite(value):
        return "–"
    decimals = 2 if abs(value) < 1 else 1 if abs(value) < 100 else 0
    return f"{value:.{decimals}f}"


def split_groups(
    summaries: Sequence[TargetSummary],
) -> dict[tuple[str, str], tuple[TargetSummary, ...]]:
    """Summaries by (dataset, split), in the order of their first appearance."""
    keys = dict.fromkeys((row.dataset, row.split) for row in summaries)
    return {key: tuple(row for row in summaries if (row.dataset, row.split) == key) for key in keys}


def estimator_rows(
    summaries: Sequence[TargetSummary], baseline: str
) -> dict[str, dict[str, TargetSummary]]:
    """Summaries of one split by estimator and target, the baseline first."""
    names = sorted(dict.fromkeys(row.estimator for row in summaries), key=lambda n: n != baseline)
    return {name: {row.target: row for row in summaries if row.estimator == name} for name in names}


def best_estimators(summaries: Sequence[TargetSummary]) -> dict[str, str]:
    """Estimator with the smallest headline error for each target of one split."""
    best = {}
    for target in TARGETS:
        rows = [r for r in summaries if r.target == target and np.isfinite(r.headline.mean)]
        if rows:
            best[target] = min(rows, key=lambda row: row.headline.mean).estimator
    return best


def format_table(summaries: Sequence[TargetSummary], *, baseline: str = "mean") -> str:
    """Mean absolute errors with 95 % intervals, estimators under their baseline; * marks the best.

    Mass and I_zz are in percent (average percent difference), the CoM is in mm.
    """
    lines = []
    for (dataset, split), group in split_groups(summaries).items():
        first = group[0]
        lines.append(f"{dataset}, split {split}: {first.pushes} pushes of {first.objects} objects")
        table = [["", *(f"{TARGET_NAMES[t]} {_unit(group, t)}" for t in TARGETS), "failed"]]
        best = best_estimators(group)
        for name, rows in estimator_rows(group, baseline).items():
            title = f"{name} (baseline)" if name == baseline else name
            cells = [_text_cell(rows[t], best.get(t) == name) for t in TARGETS]
            table.append([title, *cells, str(max(row.failed for row in rows.values()))])
        lines += [f"  {line}" for line in aligned(table)]
        lines.append("")
    lines.append("mean |error| [95 % interval]; * best; % of the mean of truth and estimate")
    return "\n".join(lines)


def _unit(group: Sequence[TargetSummary], target: str) -> str:
    return next(row.headline_unit for row in group if row.target == target)


def _text_cell(row: TargetSummary, best: bool) -> str:
    mean, low, high = (
        format_number(v) for v in (row.headline.mean, row.headline.low, row.headline.high)
    )
    return f"{mean}{'*' if best else ' '} [{low}, {high}]"


def _mean_errors(rows: dict[str, TargetSummary]) -> str:
    """Mean absolute errors of one estimator: "mass 4.8 %, I_zz 8.5 %, CoM 1.6 / 0.9 mm"."""
    number = {target: format_number(rows[target].headline.mean) for target in TARGETS}
    return (
        f"mass {number['mass']} %, I_zz {number['inertia']} %, "
        f"CoM {number['com_x']} / {number['com_y']} mm"
    )


def verdict(
    summaries: Sequence[TargetSummary], phrase: str, baseline: str, *, with_baseline: bool = True
) -> str:
    """One sentence on one split: the leading estimator beside the baseline.

    Args:
      summaries: of one split.
      phrase: where this holds, such as "on cubes never seen in training".
      baseline: name of the predict-the-mean estimator.
      with_baseline: says what the baseline achieves.
    """
    rows = estimator_rows(summaries, baseline)
    leader = leading_estimator(summaries, baseline)
    text = f"{leader}: {_mean_errors(rows[leader])} {phrase}"
    if with_baseline and baseline in rows and leader != baseline:
        text += f"; predicting the training mean: {_mean_errors(rows[baseline])}"
    return text + "."


def caveats(summaries: Sequence[TargetSummary], baseline: str) -> tuple[str, ...]:
    """What a reader of the verdict must know: targets not better than the baseline, bad sigmas."""
    rows = estimator_rows(summaries, baseline)
    leader = leading_estimator(summaries, baseline)
    notes = []
    if baseline not in rows:
        notes.append(f"There is no baseline {baseline!r} to compare with.")
    elif leader == baseline:
        notes.append("There is only the baseline.")
    else:
        no_better = [
            TARGET_NAMES[t]
            for t in TARGETS
            if not rows[leader][t].headline.high < rows[baseline][t].headline.low
        ]
        if no_better:
            notes.append(
                f"{leader} is not clearly better than the baseline on {', '.join(no_better)}: "
                "the 95 % intervals overlap."
            )
    z = [row.calibration.z_rms for row in rows[leader].values()]
    if np.isfinite(z).any():
        largest, smallest = float(np.nanmax(z)), float(np.nanmin(z))
        if largest > 1.25:
            notes.append(
                f"{leader} is overconfident: RMS z-score up to {largest:.2f} instead of 1."
            )
        elif smallest < 0.8:
            notes.append(
                f"{leader} claims more uncertainty than it has: RMS z-score down to "
                f"{smallest:.2f} instead of 1."
            )
        else:
            notes.append(
                f"{leader}'s own error bars hold: RMS z-scores {smallest:.2f} to {largest:.2f}."
            )
    return tuple(notes)
