"""One line per target: what an estimator achieves over a whole test split, and how sure that is.

In: `HeldOutEstimates`. Out: `TargetSummary` for each of `TARGETS`, in that order, with bootstrap
intervals of the mean errors and the calibration of claimed standard deviations.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.errors import HeldOutEstimates, target_errors

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
    would be too narrow. With a single group there is nothing to draw from, and rows are drawn.

    Args:
      values: finite numbers.
      groups: rows with the same number are drawn together.
      seed: equal seeds and groups draw the same groups, which pairs estimators.
      resamples: number of draws.
      level: probability of the interval.
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
