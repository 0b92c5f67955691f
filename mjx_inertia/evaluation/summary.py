"""One line per target: what an estimator achieves over a whole test split, and how sure that is.

In: `HeldOutEstimates`. Out: `TargetSummary` for each of `TARGETS`, in that order, with bootstrap
intervals of the mean errors and the calibration of claimed standard deviations; the same as words:
results.csv for a program, a table for a terminal, sentences for the report.
"""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from mjx_inertia.command import aligned
from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.errors import HeldOutEstimates, target_errors
from mjx_inertia.files import write_whole

RESULT_COLUMNS = (
    "dataset", "split", "estimator", "target", "n", "failed", "signed_mean_percent",
    "signed_std_percent", "abs_mean_percent", "abs_median_percent",
)  # fmt: skip
TARGET_NAMES = {"mass": "mass", "inertia": "I_zz", "com_x": "CoM x", "com_y": "CoM y"}
Z_68 = 1.0  # ±1 standard deviation: 68.27 % of a normal distribution
Z_95 = 1.959964


@dataclass(frozen=True)
class Interval:
    """A mean with its bootstrap interval; NaN where there is nothing to average."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True)
class Calibration:
    """How the truth lies relative to the claimed covariance."""

    n: int  # rows with a finite, positive standard deviation
    # root mean square of (truth - estimate)/sigma; 1 when honest, more if overconfident
    z_rms: float
    coverage_68: float  # fraction of truths within ±1 sigma; 0.683 when honest
    coverage_95: float  # fraction of truths within ±1.96 sigma; 0.95 when honest


def bootstrap_mean(
    values: Float[np.ndarray, " n"],
    groups: Int[np.ndarray, " n"],
    *,
    seed: int,
    resamples: int = 1000,
    level: float = 0.95,
) -> Interval:
    """Mean of `values` and the percentile interval that resampling of whole groups gives.

    Pushes of one object err alike, so objects are drawn and not pushes: an interval over pushes
    would be too narrow. With a single group there is nothing to draw from, and rows are drawn. Rows
    with the same number in `groups` are drawn together. Equal seeds and groups draw the same
    groups, which pairs estimators.
    """
    if not values.size:
        return Interval(np.nan, np.nan, np.nan)
    _, group = np.unique(groups, return_inverse=True)
    if group.max() == 0:
        group = np.arange(values.size)
    sums, counts = np.bincount(group, values), np.bincount(group).astype(float)
    drawn = np.random.default_rng(seed).integers(sums.size, size=(resamples, sums.size))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, [(1 - level) / 2, (1 + level) / 2])
    return Interval(float(values.mean()), float(low), float(high))


def z_scores(
    truth: Float[np.ndarray, " n"],
    estimate: Float[np.ndarray, " n"],
    sigma: Float[np.ndarray, " n"],
) -> Float[np.ndarray, " m"]:
    """(truth - estimate)/sigma of the rows whose three values are finite and sigma positive."""
    usable = np.isfinite(truth) & np.isfinite(estimate) & np.isfinite(sigma) & (sigma > 0)
    return (truth[usable] - estimate[usable]) / sigma[usable]


def calibrate(z: Float[np.ndarray, " m"]) -> Calibration:
    """Calibration figures of z-scores; NaN where there are none."""
    if not z.size:
        return Calibration(0, np.nan, np.nan, np.nan)
    return Calibration(
        n=z.size,
        z_rms=float(np.sqrt(np.mean(z**2))),
        coverage_68=float(np.mean(np.abs(z) <= Z_68)),
        coverage_95=float(np.mean(np.abs(z) <= Z_95)),
    )


@dataclass(frozen=True)
class TargetSummary:
    """Errors of one estimator for one target over one test split."""

    dataset: str  # name of the dataset
    split: str  # name of the split
    estimator: str  # name of the estimator
    target: str  # one of `TARGETS`
    pushes: int  # test pushes in all: n + left_out + failed
    objects: int  # different objects among them
    n: int  # pushes that the percentages are taken over
    failed: int  # pushes without an estimate
    left_out: int  # pushes with an estimate but no meaningful percentage (CoM component under 1 mm)
    signed_mean_percent: float  # mean of Eq. 3.12, the metric of the thesis.
    signed_std_percent: float  # its standard deviation (divided by n)
    abs_median_percent: float  # median of its absolute value
    abs_percent: Interval  # mean of its absolute value, with a 95 % interval
    # mean absolute error in mm of a CoM component over n + left_out pushes, else None
    abs_mm: Interval | None
    calibration: Calibration  # whether the claimed covariance holds

    @property
    def abs_mean_percent(self) -> float:
        """Mean absolute percent difference."""
        return self.abs_percent.mean

    @property
    def headline(self) -> Interval:
        """What is shown first: mm for the CoM, percent for mass and inertia."""
        return self.abs_percent if self.abs_mm is None else self.abs_mm

    @property
    def headline_unit(self) -> str:
        """Unit of `headline`."""
        return "%" if self.abs_mm is None else "mm"


def summarize(evaluation: HeldOutEstimates, *, seed: int = 0) -> tuple[TargetSummary, ...]:
    """Summary of each of `TARGETS`; `seed` draws the bootstrap."""
    groups = np.asarray(evaluation.conditions.object_id)
    return tuple(_summarize_target(evaluation, target, groups, seed) for target in TARGETS)


def summarize_all(
    evaluations: Iterable[HeldOutEstimates], *, seed: int = 0
) -> tuple[TargetSummary, ...]:
    """Summaries of several evaluations, one after the other."""
    return tuple(row for evaluation in evaluations for row in summarize(evaluation, seed=seed))


def leading_estimator(summaries: Sequence[TargetSummary], baseline: str) -> str:
    """Name of the estimator with the smallest errors over all targets of one split.

    Errors of different targets are compared by the geometric mean of their headline numbers.
    The baseline leads only where there is nothing else.
    """
    names = dict.fromkeys(row.estimator for row in summaries)
    candidates = [name for name in names if name != baseline] or list(names)

    def score(name: str) -> float:
        errors = [row.headline.mean for row in summaries if row.estimator == name]
        logs = np.log(np.maximum(errors, 1e-12))
        return float(np.mean(logs)) if np.isfinite(logs).all() else np.inf

    return min(candidates, key=score)


def _summarize_target(
    evaluation: HeldOutEstimates, target: str, groups: np.ndarray, seed: int
) -> TargetSummary:
    errors = target_errors(evaluation, target)
    signed = errors.signed_percent[errors.used]
    absolute = np.abs(signed)
    nothing = not signed.size
    abs_mm = None
    if errors.signed_mm is not None:
        known = np.isfinite(errors.signed_mm)
        abs_mm = bootstrap_mean(np.abs(errors.signed_mm[known]), groups[known], seed=seed)
    answered = ~errors.failed
    z = z_scores(errors.truth[answered], errors.estimate[answered], errors.sigma[answered])
    return TargetSummary(
        dataset=evaluation.dataset,
        split=evaluation.split,
        estimator=evaluation.estimator,
        target=target,
        pushes=evaluation.pushes,
        objects=evaluation.objects,
        n=int(errors.used.sum()),
        failed=int(errors.failed.sum()),
        left_out=int(errors.left_out.sum()),
        signed_mean_percent=np.nan if nothing else float(signed.mean()),
        signed_std_percent=np.nan if nothing else float(signed.std()),
        abs_median_percent=np.nan if nothing else float(np.median(absolute)),
        abs_percent=bootstrap_mean(absolute, groups[errors.used], seed=seed),
        abs_mm=abs_mm,
        calibration=calibrate(z),
    )


def write_results(path: Path, summaries: Sequence[TargetSummary]) -> None:
    """Writes results.csv whole or not at all; `n` counts the pushes that have a percentage."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(RESULT_COLUMNS)
    for row in summaries:
        values = [getattr(row, column) for column in RESULT_COLUMNS]
        writer.writerow([f"{v:.6g}" if isinstance(v, float) else v for v in values])
    write_whole(path, stream.getvalue())


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

    `phrase` says where it holds, such as "on cubes never seen in training".
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
