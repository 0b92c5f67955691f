"""How far an estimate is from the truth: percentages of the thesis, and mm for the CoM.

In: truths and estimates. Out: errors, row by row, with what must be left out named and not guessed.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mjx_inertia.estimators import TARGETS, EstimateStatus
from mjx_inertia.evaluation.evaluation import HeldOutEstimates

COM_TARGETS = ("com_x", "com_y")
COM_FLOOR_M = 1e-3
"""Below this the percentage of a CoM component says nothing: errata 7."""


def percent_difference(
    truth: Float[np.ndarray, "*n"], estimate: Float[np.ndarray, "*n"]
) -> Float[np.ndarray, "*n"]:
    """Signed average percent difference, in [-200, 200]; positive where the estimate is too small.

    Two zeros differ by 0; NaN stays NaN. Source: thesis Eq. 3.12.
    """
    scale = np.abs(truth) + np.abs(estimate)
    with np.errstate(invalid="ignore", divide="ignore"):
        percent = 200.0 * (truth - estimate) / scale
    return np.where(scale == 0, 0.0, percent)


def absolute_percent_difference(
    truth: Float[np.ndarray, "*n"], estimate: Float[np.ndarray, "*n"]
) -> Float[np.ndarray, "*n"]:
    """Size of the average percent difference, in [0, 200]: what a user of one push meets."""
    return np.abs(percent_difference(truth, estimate))


def relative_error_percent(
    truth: Float[np.ndarray, "*n"], estimate: Float[np.ndarray, "*n"]
) -> Float[np.ndarray, "*n"]:
    """|estimate - truth| as a percentage of the truth.

    Infinite where only the truth is 0, and 0 where both are; NaN stays NaN. Source: thesis Eq. 3.5.
    """
    distance = np.abs(estimate - truth)
    with np.errstate(invalid="ignore", divide="ignore"):
        percent = 100.0 * distance / np.abs(truth)
    return np.where((distance == 0) & (truth == 0), 0.0, percent)


def com_error_mm(
    truth: Float[np.ndarray, "*n"], estimate: Float[np.ndarray, "*n"]
) -> Float[np.ndarray, "*n"]:
    """Signed error of a CoM component given in m; in mm, truth less estimate as in Eq. 3.12."""
    return 1e3 * (truth - estimate)


@dataclass(frozen=True)
class TargetErrors:
    """Errors of one target, one row a test push."""

    target: str  # one of `TARGETS`
    truth: Float[np.ndarray, " n"]  # SI units
    estimate: Float[np.ndarray, " n"]  # SI units; what the estimator wrote, also where it failed
    sigma: Float[np.ndarray, " n"]  # standard deviation that the estimator claims, SI units
    failed: Bool[np.ndarray, " n"]  # the estimate says that it failed, or is not finite
    # not failed, but without a meaningful percentage: the truth is unknown or, for a CoM component,
    # smaller than 1 mm
    left_out: Bool[np.ndarray, " n"]
    signed_percent: Float[np.ndarray, " n"]  # Eq. 3.12; NaN where failed or left out
    relative_percent: Float[np.ndarray, " n"]  # Eq. 3.5; NaN where failed or left out
    # error of a CoM component in mm, NaN where failed; None for mass and inertia
    signed_mm: Float[np.ndarray, " n"] | None

    @property
    def used(self) -> Bool[np.ndarray, " n"]:
        """Rows that have a percentage."""
        return ~(self.failed | self.left_out)


def target_errors(evaluation: HeldOutEstimates, target: str) -> TargetErrors:
    """Errors of all rows of `evaluation` for one of `TARGETS`."""
    if target not in TARGETS:
        raise ValueError(f"target is {target!r}; choose one of {TARGETS}")
    column = TARGETS.index(target)
    truth = true_values(evaluation, target)
    estimate = np.asarray(evaluation.estimate.mean, float)[:, column]
    variance = np.asarray(evaluation.estimate.covariance, float)[:, column, column]
    status = np.asarray(evaluation.estimate.status)

    failed = (status != EstimateStatus.OK) | ~np.isfinite(estimate)
    meaningless = ~np.isfinite(truth)
    if target in COM_TARGETS:
        meaningless |= np.abs(truth) < COM_FLOOR_M
    left_out = meaningless & ~failed
    used = ~(failed | left_out)
    return TargetErrors(
        target=target,
        truth=truth,
        estimate=estimate,
        sigma=np.sqrt(np.where(variance >= 0, variance, np.nan)),
        failed=failed,
        left_out=left_out,
        signed_percent=np.where(used, percent_difference(truth, estimate), np.nan),
        relative_percent=np.where(used, relative_error_percent(truth, estimate), np.nan),
        signed_mm=np.where(failed, np.nan, com_error_mm(truth, estimate))
        if target in COM_TARGETS
        else None,
    )


def true_values(evaluation: HeldOutEstimates, target: str) -> Float[np.ndarray, " n"]:
    """True values of one of `TARGETS`, SI units, float64."""
    if target in COM_TARGETS:
        return np.asarray(evaluation.truth.com, float)[:, COM_TARGETS.index(target)]
    return np.asarray(getattr(evaluation.truth, target), float)
