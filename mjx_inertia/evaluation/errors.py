"""How far estimates are from the truth: percentages of the thesis, and mm for the CoM.

In: `HeldOutEstimates`, the estimates of one estimator for the test pushes of one split. Out:
errors, row by row; rows without a meaningful error are marked and counted, not filled in.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.dataset import PushConditions, PushTruth
from mjx_inertia.estimators import TARGETS, Estimate, EstimateStatus
from mjx_inertia.pushing import PushStatus

COM_TARGETS = ("com_x", "com_y")
_COM_FLOOR_M = 1e-3  # below this the percentage of a CoM component says nothing: errata 7


@dataclass(frozen=True)
class HeldOutEstimates:
    """Estimates of one estimator beside the truth, one row a test push."""

    dataset: str  # name of the dataset
    split: str  # name of the split whose test side this is
    estimator: str  # name of the estimator
    estimate: Estimate  # what it predicted
    truth: PushTruth  # the true parameters
    conditions: PushConditions  # how the pushes were made
    # the `PushStatus` of each push; tells why an estimate failed
    push_status: Int[Array, " n"] | Int[np.ndarray, " n"] | None = None
    object_labels: Mapping[int, str] | None = None  # names of objects, by `object_id`

    def __post_init__(self) -> None:
        lengths = {
            "estimate.mean": len(self.estimate.mean),
            "estimate.covariance": len(self.estimate.covariance),
            "estimate.status": len(self.estimate.status),
            "truth.mass": len(self.truth.mass),
            "truth.inertia": len(self.truth.inertia),
            "truth.com": len(self.truth.com),
            "conditions.object_id": len(self.conditions.object_id),
        }
        if self.push_status is not None:
            lengths["push_status"] = len(self.push_status)
        if len(set(lengths.values())) != 1 or not len(self.truth.mass):
            raise ValueError(
                f"Evaluation of {self.estimator!r} needs the same number of rows, at least one, "
                f"in every field, but got {lengths}: pass rows of the same test pushes"
            )

    @property
    def pushes(self) -> int:
        """Number of test pushes, failed ones among them."""
        return len(self.truth.mass)

    @property
    def objects(self) -> int:
        """Number of different objects that were pushed."""
        return len(np.unique(np.asarray(self.conditions.object_id)))


def count_failures(evaluation: HeldOutEstimates) -> dict[str, int]:
    """Failed estimates by reason, the most frequent first.

    The reason is the status of the push where it is known and not OK, else that of the estimate.
    """
    estimate_status = np.asarray(evaluation.estimate.status)
    push_status = (
        np.zeros_like(estimate_status)
        if evaluation.push_status is None
        else np.asarray(evaluation.push_status)
    )
    failed = estimate_status != EstimateStatus.OK
    reasons = Counter(
        _status_name(PushStatus, push) if push else _status_name(EstimateStatus, estimate)
        for push, estimate in zip(
            push_status[failed].tolist(), estimate_status[failed].tolist(), strict=True
        )
    )
    broken_promises = ~failed & ~np.isfinite(np.asarray(evaluation.estimate.mean)).all(axis=1)
    if broken_promises.any():
        reasons["NOT_FINITE"] = int(broken_promises.sum())
    return dict(reasons.most_common())


def _status_name(kind: type[PushStatus] | type[EstimateStatus], value: int) -> str:
    try:
        return kind(value).name
    except ValueError:
        return f"{kind.__name__} {value}"


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
        meaningless |= np.abs(truth) < _COM_FLOOR_M
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
