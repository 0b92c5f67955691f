"""One self-contained HTML page: verdict, tables, figures, and how the numbers came about.

In: evaluations, words about the splits, the config and versions. Out: text of report.html.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure
from tqdm import tqdm

from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.appearance import to_data_uri
from mjx_inertia.evaluation.errors import HeldOutEstimates, count_failures
from mjx_inertia.evaluation.report_figures import Section, plan_split_figures
from mjx_inertia.evaluation.summary import (
    TARGET_NAMES,
    TargetSummary,
    best_estimators,
    caveats,
    estimator_rows,
    format_number,
    split_groups,
    summarize_all,
    verdict,
)
from mjx_inertia.files import write_whole


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


@dataclass(frozen=True)
class SplitText:
    """A split in words."""

    name: str  # the split
    phrase: str  # ends a sentence, such as "on cubes never seen in training"
    definition: str  # how it is made, one or two sentences


@dataclass(frozen=True)
class ReportContent:
    """All that a report shows."""

    title: str  # heading of the page
    # every estimator on every split, in the order of the tables
    evaluations: Sequence[HeldOutEstimates]
    splits: Sequence[SplitText] = ()  # what the splits mean; the verdict is about the last of them
    config_yaml: str = ""  # the configuration of the run
    # version by name of package, machine and the like
    versions: Mapping[str, str] = field(default_factory=dict)
    baseline: str = "mean"  # name of the predict-the-mean estimator
    published: Sequence[Published] = ()  # figures of others to stand beside ours
    sections: Sequence[Section] = ()  # added after the standard figures
    seed: int = 0  # of the bootstrap


def write_report(path: Path, content: ReportContent) -> None:
    """Writes the page whole or not at all."""
    write_whole(path, render_report(content))


def render_report(content: ReportContent) -> str:
    """The page as text; it refers to nothing outside itself.

    Raises:
      ValueError: there is no evaluation.
    """
    if not content.evaluations:
        raise ValueError("content.evaluations is empty; give at least one Evaluation")
    summaries = summarize_all(content.evaluations, seed=content.seed)
    headline = _headline_split(content, summaries)
    summaries = sorted(summaries, key=lambda row: (row.dataset, row.split) != headline)
    groups = split_groups(summaries)
    environment = Environment(
        loader=PackageLoader("mjx_inertia.evaluation", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["symbols"] = _symbols
    return environment.get_template("report.html.j2").render(
        title=content.title,
        verdict=verdict(groups[headline], _phrase(content, headline[1]), content.baseline),
        other_verdicts=[
            verdict(rows, _phrase(content, key[1]), content.baseline, with_baseline=False)
            for key, rows in groups.items()
            if key != headline
        ],
        caveats=caveats(groups[headline], content.baseline),
        target_names=[TARGET_NAMES[t] for t in TARGETS],
        headline_groups=headline_groups(
            summaries, content.baseline, {text.name: text.phrase for text in content.splits}
        ),
        signed_groups=signed_groups(summaries, content.baseline, content.published),
        calibration_groups=calibration_groups(summaries, content.baseline),
        detail_columns=DETAIL_COLUMNS,
        text_columns=TEXT_COLUMNS,
        detail_rows=detail_rows(summaries),
        left_out=_left_out(summaries),
        failures=_failures(content.evaluations, list(groups)),
        splits=content.splits,
        sections=[
            _drawn(section)
            for section in (*_standard_sections(content, groups, headline), *content.sections)
        ],
        config_yaml=content.config_yaml,
        versions=content.versions,
    )


def _headline_split(content: ReportContent, summaries: Sequence[TargetSummary]) -> tuple[str, str]:
    keys = list(split_groups(summaries))
    for text in reversed(content.splits):
        for key in keys:
            if key[1] == text.name:
                return key
    return keys[-1]


def _phrase(content: ReportContent, split: str) -> str:
    return next((s.phrase for s in content.splits if s.name == split), f"on the split {split!r}")


def _standard_sections(
    content: ReportContent,
    groups: Mapping[tuple[str, str], tuple[TargetSummary, ...]],
    headline: tuple[str, str],
) -> list[Section]:
    planned = []
    for key, summaries in groups.items():
        evaluations = [e for e in content.evaluations if (e.dataset, e.split) == key]
        planned += plan_split_figures(
            evaluations, summaries, content.baseline, in_detail=key == headline
        )
    bar = tqdm(planned, desc="report figures", unit="figure", leave=False)
    return [Section(p.title, Markup(_image(p.draw(), p.title)), p.caption) for p in bar]


def _drawn(section: Section) -> Mapping[str, Any]:
    body = section.body
    if isinstance(body, Figure):
        body = _image(body, section.title)
    elif not isinstance(body, Markup):
        body = Markup("<pre>{}</pre>").format(body)
    return {"title": section.title, "body": body, "caption": section.caption}


def _image(figure: Figure, alternative: str) -> Markup:
    return Markup('<img alt="{}" src="{}">').format(alternative, to_data_uri(figure))


def _symbols(text: str) -> Markup:
    """Escapes `text`, sets the subscript of I_zz and keeps units beside their numbers."""
    whole = text.replace(" %", "\u00a0%").replace(" mm", "\u00a0mm")
    return escape(whole).replace("I_zz", Markup("I<sub>zz</sub>"))


def _left_out(summaries: Sequence[TargetSummary]) -> list[str]:
    """How many pushes have no percentage, by split and target."""
    texts = []
    for (_, split), rows in split_groups(summaries).items():
        for target in TARGETS:
            most = max((r for r in rows if r.target == target), key=lambda r: r.left_out)
            if most.left_out:
                texts.append(
                    f"{TARGET_NAMES[target]}, {split}: {most.left_out:,} of {most.pushes:,}"
                )
    return texts


def _failures(
    evaluations: Sequence[HeldOutEstimates], splits: Sequence[tuple[str, str]]
) -> list[tuple[str, str, str]]:
    """(split, estimators, reasons); estimators that failed alike share a row."""
    alike: dict[tuple[str, str, str], list[str]] = {}
    for evaluation in sorted(evaluations, key=lambda e: splits.index((e.dataset, e.split))):
        counts = count_failures(evaluation)
        if counts:
            text = ", ".join(f"{name} {number:,}" for name, number in counts.items())
            key = (evaluation.dataset, evaluation.split, text)
            alike.setdefault(key, []).append(evaluation.estimator)
    return [(key[1], ", ".join(names), key[2]) for key, names in alike.items()]
