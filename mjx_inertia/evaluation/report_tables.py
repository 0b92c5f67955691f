"""The tables of the report, as the template wants them: texts, and what to mark.

In: summaries. Out: rows of cells.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.summary import TargetSummary
from mjx_inertia.evaluation.tables import (
    TARGET_NAMES,
    best_estimators,
    estimator_rows,
    format_number,
    split_groups,
)


@dataclass(frozen=True)
class Published:
    """Figures that others printed, put below ours where dataset and split are the same."""

    name: str  # source, such as "thesis, Table 3.3"
    # mean and standard deviation of Eq. 3.12 by target.
    signed_mean_std_percent: Mapping[str, tuple[float, float]]
    dataset: str | None = None  # dataset that they stand for; None for any
    split: str | None = None  # split that they stand for; None for any


@dataclass(frozen=True)
class Cell:
    """A number with a smaller text below it."""

    text: str  # the number
    detail: str = ""  # below it
    # length of the bar under both, in [0, 1] of the baseline's error; None: no bar
    bar: float | None = None
    best: bool = False  # the smallest of its column


@dataclass(frozen=True)
class Row:
    """One estimator; `kind` is "", "baseline" or "published"."""

    name: str
    cells: tuple[Cell, ...]
    kind: str = ""


@dataclass(frozen=True)
class Group:
    """Rows of one split with its heading."""

    heading: str
    detail: str
    rows: tuple[Row, ...]


def headline_groups(
    summaries: Sequence[TargetSummary], baseline: str, phrases: Mapping[str, str]
) -> list[Group]:
    """Mean absolute errors with intervals; the CoM in mm; failures in the last column.

    `phrases` says what a split is, by its name.
    """
    groups = []
    for (dataset, split), rows in split_groups(summaries).items():
        best = best_estimators(rows)
        table = []
        by_estimator = estimator_rows(rows, baseline)
        for name, targets in by_estimator.items():
            cells = []
            for target in TARGETS:
                row = targets[target]
                low, high = format_number(row.headline.low), format_number(row.headline.high)
                reference = by_estimator.get(baseline, targets)[target].headline.mean
                share = row.headline.mean / reference if reference > 0 else np.nan
                cells.append(
                    Cell(
                        text=f"{format_number(row.headline.mean)} {row.headline_unit}",
                        detail=f"{low} to {high}",
                        bar=float(min(share, 1.0)) if np.isfinite(share) else None,
                        best=best.get(target) == name and name != baseline,
                    )
                )
            failed = max(row.failed for row in targets.values())
            cells.append(Cell(str(failed)))
            table.append(Row(name, tuple(cells), "baseline" if name == baseline else ""))
        words = [phrases[split]] if split in phrases else []
        detail = " · ".join([*words, _size(dataset, rows[0])])
        groups.append(Group(split, detail, tuple(table)))
    return groups


def signed_groups(
    summaries: Sequence[TargetSummary], baseline: str, published: Sequence[Published]
) -> list[Group]:
    """Signed mean ± standard deviation (the metric of the thesis), and what others printed."""
    groups = []
    for (dataset, split), rows in split_groups(summaries).items():
        table = [
            Row(
                name,
                tuple(
                    Cell(_plus_minus(targets[t].signed_mean_percent, targets[t].signed_std_percent))
                    for t in TARGETS
                ),
                "baseline" if name == baseline else "",
            )
            for name, targets in estimator_rows(rows, baseline).items()
        ]
        for source in published:
            if source.dataset in (None, dataset) and source.split in (None, split):
                figures = source.signed_mean_std_percent
                cells = tuple(
                    Cell(_plus_minus(*figures[t]) if t in figures else "–") for t in TARGETS
                )
                table.append(Row(source.name, cells, "published"))
        groups.append(Group(split, _size(dataset, rows[0]), tuple(table)))
    return groups


def calibration_groups(summaries: Sequence[TargetSummary], baseline: str) -> list[Group]:
    """RMS z-scores and the coverage of 68 % and 95 % intervals."""
    groups = []
    for (dataset, split), rows in split_groups(summaries).items():
        table = []
        for name, targets in estimator_rows(rows, baseline).items():
            cells = []
            for target in TARGETS:
                found = targets[target].calibration
                if found.n:
                    coverage = f"{100 * found.coverage_68:.0f} % / {100 * found.coverage_95:.0f} %"
                    cells.append(Cell(f"{found.z_rms:.2f}", coverage))
                else:
                    cells.append(Cell("–", "no σ given"))
            table.append(Row(name, tuple(cells), "baseline" if name == baseline else ""))
        groups.append(Group(split, _size(dataset, rows[0]), tuple(table)))
    return groups


def detail_rows(summaries: Sequence[TargetSummary]) -> list[tuple[str, ...]]:
    """Every number of every summary as text, in the order of `DETAIL_COLUMNS`."""
    return [
        (
            row.dataset,
            row.split,
            row.estimator,
            TARGET_NAMES[row.target],
            str(row.pushes),
            str(row.n),
            str(row.failed),
            str(row.left_out),
            _signed(row.signed_mean_percent),
            format_number(row.signed_std_percent),
            format_number(row.abs_mean_percent),
            f"{format_number(row.abs_percent.low)} to {format_number(row.abs_percent.high)}",
            format_number(row.abs_median_percent),
            "" if row.abs_mm is None else format_number(row.abs_mm.mean),
        )
        for row in summaries
    ]


DETAIL_COLUMNS = (
    "dataset",
    "split",
    "estimator",
    "target",
    "pushes",
    "n",
    "failed",
    "left out",
    "signed mean, %",
    "signed std, %",
    "abs mean, %",
    "95 % interval",
    "abs median, %",
    "abs mean, mm",
)
TEXT_COLUMNS = 4  # the first of them hold words, the others numbers


def _size(dataset: str, row: TargetSummary) -> str:
    return f"{dataset} dataset · {row.pushes:,} test pushes of {row.objects:,} objects"


def _signed(value: float) -> str:
    return format_number(value).replace("-", "−") if value < 0 else format_number(value)


def _plus_minus(mean: float, std: float) -> str:
    return f"{_signed(mean)} ± {format_number(std)} %"
