"""The main job: `python -m mjx_inertia.sweep [overrides]`.

Simulates (or reads) pushes, takes features, fits every estimator on every split, judges it on
pushes that it has not seen, and writes `results.csv`, a self-contained `report.html` and the fitted
estimators.
"""

import dataclasses
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig
from tqdm import tqdm

from mjx_inertia import runtime
from mjx_inertia.dataset import (
    SimulatedSettings,
    Source,
    Split,
    measured_source,
    provenance,
    simulated_source,
)
from mjx_inertia.estimators import ESTIMATORS, STORED_TYPES, Estimate, forest_tree, save_fitted
from mjx_inertia.evaluation import (
    HeldOutEstimates,
    Published,
    ReportContent,
    Section,
    SplitText,
    draw_tree,
    format_table,
    sample_signals,
    summarize_all,
    write_report,
    write_results,
)
from mjx_inertia.features import Examples, concatenate, examples, families_of, take_examples
from mjx_inertia.program import run_program
from mjx_inertia.pushing import PushRecord, PushStatus
from mjx_inertia.settings import SweepSettings, from_config, register_defaults

THESIS_TABLE_3_3 = Published(
    "thesis, Table 3.3",
    {
        "mass": (7.59, 11.04),
        "inertia": (13.49, 10.20),
        "com_x": (12.59, 8.62),
        "com_y": (20.61, 8.12),
    },
    dataset="full",
    split="thesis",
)
THESIS_TABLE_3_4 = Published(
    "thesis, Table 3.4 (all objects, other split)",
    {
        "mass": (10.05, 7.09),
        "inertia": (12.44, 7.38),
        "com_x": (12.90, 15.05),
        "com_y": (13.32, 15.31),
    },
    dataset="mdataset",
)


@dataclass(frozen=True)
class SweepResult:
    """What a run found."""

    source: Source  # the pushes
    tables: Mapping[str, Examples]  # examples by feature set, rows in the order of the source
    evaluations: tuple[HeldOutEstimates, ...]  # of every estimator on every split
    # the fitted estimators of each split's last fold, by (split, estimator)
    fitted: Mapping[tuple[str, str], Any]
    shown: PushRecord  # a few records for a figure


def _some_of(records: PushRecord, count: int = 4) -> PushRecord:
    usable = np.flatnonzero(np.asarray(records.status) == PushStatus.OK)
    chosen = usable[np.linspace(0, len(usable) - 1, min(count, len(usable))).astype(int)]
    return jax.tree.map(lambda x: np.asarray(x)[chosen], records)


def _feature_set(choice: Any) -> str:
    return getattr(choice, "features", None) or "onset"


def _widest(name: str, sets: Iterable[str]) -> str:
    """One of `sets` that holds all features of the set `name`."""
    return next((wide for wide in sorted(sets) if name in families_of(wide)), name)


def tabulate(source: Source, settings: SweepSettings) -> tuple[dict[str, Examples], PushRecord]:
    """Features of all pushes in one pass, one table for each feature set in use; a few records."""
    # the tables to make: a set that is part of another in use needs none
    sets = {_feature_set(s) for s in settings.estimators.values()}
    wider = {name: _widest(name, sets) for name in sets}
    sets = set(wider.values())
    parts: dict[str, list[Examples]] = {name: [] for name in sorted(sets)}
    keep = any(ESTIMATORS[name].signals for name in settings.estimators)
    # one pass over the pushes, block by block
    shown: PushRecord | None = None
    total = len(source.truth.mass)
    with tqdm(total=total, unit="push", desc="features", disable=not settings.progress) as bar:
        for batch in source.batches():
            if shown is None:
                shown = _some_of(batch.records)
            for name, rows in parts.items():
                part = examples(
                    batch, name, settings.features, keep_records=keep, shapes=source.shapes
                )
                rows.append(part)
            bar.update(len(batch.truth.mass))
    assert shown is not None
    tables = {name: concatenate(rows) for name, rows in parts.items()}
    return {name: tables[wide] for name, wide in wider.items()}, shown


def evaluate(
    source: Source, tables: Mapping[str, Examples], settings: SweepSettings
) -> tuple[tuple[HeldOutEstimates, ...], dict[tuple[str, str], Any]]:
    """Fits and judges every estimator on every split; the tests of a split's folds are pooled."""
    evaluations, fitted = [], {}
    for split in source.splits:
        for name, choice in settings.estimators.items():
            estimator = ESTIMATORS[name].factory(choice)
            table = tables[_feature_set(choice)]
            estimates = []
            for fold, (train, test) in enumerate(split.folds):
                key = jax.random.fold_in(jax.random.key(settings.seed), fold)
                model = estimator.fit(take_examples(table, train), key=key)
                estimates.append(estimator.predict(model, take_examples(table, test)))
                fitted[split.name, name] = model
            evaluations.append(_evaluation(source, split, name, estimates, table))
    return tuple(evaluations), fitted


def _evaluation(
    source: Source, split: Split, name: str, estimates: list[Estimate], table: Examples
) -> HeldOutEstimates:
    rows = np.concatenate([test for _, test in split.folds])
    pooled = jax.tree.map(lambda *x: np.concatenate([np.asarray(e) for e in x]), *estimates)
    return HeldOutEstimates(
        dataset=source.name,
        split=split.name,
        estimator=name,
        estimate=pooled,
        truth=jax.tree.map(lambda x: np.asarray(x)[rows], source.truth),
        conditions=jax.tree.map(lambda x: np.asarray(x)[rows], source.conditions),
        push_status=np.asarray(table.status)[rows],
        object_labels=source.object_labels or None,
    )


def run_sweep(settings: SweepSettings) -> SweepResult | None:
    """The whole job but the writing; None while other shards of the store are missing."""
    if isinstance(settings.dataset, SimulatedSettings):
        source = simulated_source(settings.dataset, progress=settings.progress)
    else:
        source = measured_source(settings.dataset, progress=settings.progress)
    if source is None:
        return None
    tables, shown = tabulate(source, settings)
    evaluations, fitted = evaluate(source, tables, settings)
    return SweepResult(source, tables, evaluations, fitted, shown)


def write_outputs(
    folder: Path, result: SweepResult, config_yaml: str, sections: tuple[Section, ...] = ()
) -> str:
    """Writes `results.csv`, `report.html` and `fitted/` to a folder; returns the table as text.

    `fitted/<split>.<estimator>.npz` holds the estimator of the split's last fold for `load_fitted`.
    """
    (folder / "fitted").mkdir(parents=True, exist_ok=True)
    for (split, name), fitted in result.fitted.items():
        if isinstance(fitted, tuple(STORED_TYPES.values())):  # what `sysid` fits is its start alone
            save_fitted(folder / "fitted" / f"{split}.{name}.npz", fitted)
    summaries = summarize_all(result.evaluations)
    write_results(folder / "results.csv", summaries)
    source = result.source
    content = ReportContent(
        title=f"Inertial parameters from one push: {source.name}",
        evaluations=result.evaluations,
        splits=[SplitText(s.name, s.phrase, s.description) for s in source.splits],
        config_yaml=config_yaml,
        versions=provenance(),
        published=[THESIS_TABLE_3_3, THESIS_TABLE_3_4],
        sections=(*sections, *_own_sections(result)),
    )
    write_report(folder / "report.html", content)
    return format_table(summaries)


def _own_sections(result: SweepResult) -> list[Section]:
    pushes = range(len(result.shown.status))
    sections = [
        Section(
            "What a robot measures",
            sample_signals(result.shown, pushes),
            "Some pushes as the estimators see them, sensor noise included (thesis Fig. 3.4).",
        )
    ]
    for (split, name), fitted in result.fitted.items():
        if name == "forest":
            tree = draw_tree(forest_tree(fitted, 0))
            caption = f"The first levels of one of its trees, {split} split (thesis Fig. 3.13)."
            sections.append(Section("A tree of the forest", tree, caption))
            break
    if result.source.notes:
        sections.append(Section("Notes on the data", "\n".join(result.source.notes)))
    return sections


def devices_of_job(config: DictConfig) -> int | None:
    """Cores for this job: those of the machine, shared among the jobs that a launcher starts."""
    if config.devices:
        return config.devices
    jobs = HydraConfig.get().launcher.get("n_jobs") or 1
    return max(1, runtime.cores() // jobs) if jobs > 0 else 1


def settings_of_job(config: DictConfig, others: Collection[str] = ()) -> SweepSettings:
    """`from_config`, with the cores that this job may use."""
    settings = from_config(config, others)
    return dataclasses.replace(settings, devices=devices_of_job(config))


def _run(settings: SweepSettings, folder: Path) -> None:
    runtime.configure(settings.devices)
    result = run_sweep(settings)
    if result is None:
        print("this shard is done; the store waits for the others")
        return
    try:
        print(write_outputs(folder, result, settings.config_yaml))
    except OSError as error:
        print(format_table(summarize_all(result.evaluations)))  # what took the time is not lost
        raise OSError(
            f"{folder}: cannot write the results ({error.strerror or error}); the table is above, "
            "the pushes stay in their store: mend the folder and run again"
        ) from error
    for note in result.source.notes:
        print(note)
    print(f"\nreport: {folder / 'report.html'}")


def main() -> None:
    """Runs the job that the command line asks for."""
    register_defaults()
    run_program("sweep", settings_of_job, _run)


if __name__ == "__main__":
    main()
