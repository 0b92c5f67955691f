"""How sure a mean error is, and how sure an estimator may be of itself.

In: errors and claimed standard deviations. Out: bootstrap intervals and calibration figures.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

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
