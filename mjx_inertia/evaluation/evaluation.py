"""What is evaluated: the answers of one estimator to the test pushes of one split.

In: estimates, truths and conditions of the same pushes. Out: `HeldOutEstimates`.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Array, Int

from mjx_inertia.dataset import PushConditions, PushTruth
from mjx_inertia.estimators import Estimate, EstimateStatus
from mjx_inertia.pushing import PushStatus


@dataclass(frozen=True)
class HeldOutEstimates:
    """Estimates of one estimator beside the truth, one row a test push."""

    dataset: str  # name of the dataset
    split: str  # name of the split whose test side this is
    estimator: str  # name of the estimator
    estimate: Estimate  # its answers
    truth: PushTruth  # what it should have answered
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
