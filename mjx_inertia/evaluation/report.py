"""One self-contained HTML page: verdict, tables, figures, and how the numbers came about.

In: evaluations, words about the splits, the config and versions. Out: text of report.html.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure
from tqdm import tqdm

from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.appearance import to_data_uri
from mjx_inertia.evaluation.errors import HeldOutEstimates, count_failures
from mjx_inertia.evaluation.report_figures import Section, plan_split_figures
from mjx_inertia.evaluation.report_tables import (
    DETAIL_COLUMNS,
    TEXT_COLUMNS,
    Published,
    calibration_groups,
    detail_rows,
    headline_groups,
    signed_groups,
)
from mjx_inertia.evaluation.summary import TargetSummary, summarize_all
from mjx_inertia.evaluation.tables import TARGET_NAMES, caveats, split_groups, verdict
from mjx_inertia.files import write_whole


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
