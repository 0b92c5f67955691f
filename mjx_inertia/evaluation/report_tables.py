"""The tables of the report, as the template wants them: texts, and what to mark.

In: summaries. Out: rows of cells.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

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


def _groups(
    summaries: Sequence[TargetSummary],
    baseline: str,
    cells_of: Callable[[dict[str, TargetSummary]], Iterable[Cell]],
) -> Iterator[tuple[tuple[str, str], Group]]:
    """A group for each (dataset, split), with one row an estimator, the baseline first."""
    for (dataset, split), rows in split_groups(summaries).items():
        table = tuple(
            Row(name, tuple(cells_of(targets)), "baseline" if name == baseline else "")
            for name, targets in estimator_rows(rows, baseline).items()
        )
        size = f"{dataset} dataset · {rows[0].pushes:,} test pushes of {rows[0].objects:,} objects"
        yield (dataset, split), Group(split, size, table)


def headline_groups(
    summaries: Sequence[TargetSummary], baseline: str, phrases: Mapping[str, str]
) -> list[Group]:
    """Mean absolute errors with intervals; the CoM in mm; failures in the last column.

    `phrases` says what a split is, by its name.
    """
    by_split = split_groups(summaries)

    def cells_of(targets: dict[str, TargetSummary]) -> Iterator[Cell]:
        group = by_split[targets[TARGETS[0]].dataset, targets[TARGETS[0]].split]
        best, references = best_estimators(group), estimator_rows(group, baseline).get(baseline)
        for target in TARGETS:
            row = targets[target]
            low, high = format_number(row.headline.low), format_number(row.headline.high)
            reference = (references or targets)[target].headline.mean
            share = row.headline.mean / reference if reference > 0 else np.nan
            yield Cell(
                text=f"{format_number(row.headline.mean)} {row.headline_unit}",
                detail=f"{low} to {high}",
                bar=float(min(share, 1.0)) if np.isfinite(share) else None,
                best=best.get(target) == row.estimator != baseline,
            )
        yield Cell(str(max(row.failed for row in targets.values())))

    return [
        replace(group, detail=f"{phrases[split]} · {group.detail}") if split in phrases else group
        for (_, split), group in _groups(summaries, baseline, cells_of)
    ]


def signed_groups(
    summaries: Sequence[TargetSummary], baseline: str, published: Sequence[Published]
) -> list[Group]:
    """Signed mean ± standard deviation (the metric of the thesis), and what others printed."""

    def cells_of(targets: dict[str, TargetSummary]) -> Iterator[Cell]:
        for target in TARGETS:
            row = targets[target]
            yield Cell(_plus_minus(row.signed_mean_percent, row.signed_std_percent))

    groups = []
    for (dataset, split), group in _groups(summaries, baseline, cells_of):
        printed = []
        for source in published:
            if source.dataset in (None, dataset) and source.split in (None, split):
                figures = source.signed_mean_std_percent
                texts = (_plus_minus(*figures[t]) if t in figures else "–" for t in TARGETS)
                printed.append(Row(source.name, tuple(map(Cell, texts)), "published"))
        groups.append(replace(group, rows=(*group.rows, *printed)))
    return groups


def calibration_groups(summaries: Sequence[TargetSummary], baseline: str) -> list[Group]:
    """RMS z-scores and the coverage of 68 % and 95 % intervals."""

    def cells_of(targets: dict[str, TargetSummary]) -> Iterator[Cell]:
        for target in TARGETS:
            found = targets[target].calibration
            if found.n:
                coverage = f"{100 * found.coverage_68:.0f} % / {100 * found.coverage_95:.0f} %"
                yield Cell(f"{found.z_rms:.2f}", coverage)
            else:
                yield Cell("–", "no σ given")

    return [group for _, group in _groups(summaries, baseline, cells_of)]


def detail_rows(summaries: Sequence[TargetSummary]) -> list[tuple[str, ...]]:
    """Every number of every summary as text, in the order of `DETAIL_COLUMNS`."""
    return [tuple(text(row) for text in _DETAILS.values()) for row in summaries]


def _signed(value: float) -> str:
    return format_number(value).replace("-", "−") if value < 0 else format_number(value)


def _plus_minus(mean: float, std: float) -> str:
    return f"{_signed(mean)} ± {format_number(std)} %"


_DETAILS: dict[str, Callable[[TargetSummary], str]] = {
    "dataset": lambda row: row.dataset,
    "split": lambda row: row.split,
    "estimator": lambda row: row.estimator,
    "target": lambda row: TARGET_NAMES[row.target],
    "pushes": lambda row: str(row.pushes),
    "n": lambda row: str(row.n),
    "failed": lambda row: str(row.failed),
    "left out": lambda row: str(row.left_out),
    "signed mean, %": lambda row: _signed(row.signed_mean_percent),
    "signed std, %": lambda row: format_number(row.signed_std_percent),
    "abs mean, %": lambda row: format_number(row.abs_mean_percent),
    "95 % interval": lambda row: (
        f"{format_number(row.abs_percent.low)} to {format_number(row.abs_percent.high)}"
    ),
    "abs median, %": lambda row: format_number(row.abs_median_percent),
    "abs mean, mm": lambda row: "" if row.abs_mm is None else format_number(row.abs_mm.mean),
}
DETAIL_COLUMNS = tuple(_DETAILS)
TEXT_COLUMNS = 4  # the first of them hold words, the others numbers
