"""Where the errors come from: means of one target at each level of a condition.

In: `HeldOutEstimates` and the name of a condition. Out: one `BreakdownRow` per level.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mjx_inertia.evaluation.errors import target_errors
from mjx_inertia.evaluation.evaluation import HeldOutEstimates

CONDITIONS = ("friction", "mass", "size", "speed", "contact_offset", "angle")
CONDITION_LABELS = {
    "friction": "friction coefficient",
    "mass": "mass, kg",
    "size": "edge or diameter, m",
    "speed": "tip speed, m/s",
    "contact_offset": "contact offset, fraction of half the edge",
    "angle": "push angle, rad",
}
_MAX_LEVELS = 8
_SIGNIFICANT_DIGITS = 4  # what tells two levels apart; float32 noise is far below


@dataclass(frozen=True)
class Level:
    """Rows at one level of a condition."""

    value: float  # the level, or the middle of its bin, in the unit of the condition
    label: str  # the same for people
    rows: Bool[np.ndarray, " n"]  # which pushes are at this level


@dataclass(frozen=True)
class BreakdownRow:
    """Errors of one target at one level of a condition; NaN where no push has a percentage."""

    condition: str  # one of `CONDITIONS`
    level: float  # value at, or middle of, the level
    label: str  # the level for people
    target: str  # one of `TARGETS`
    n: int  # pushes that the percentages are taken over
    failed: int  # pushes without an estimate
    left_out: int  # pushes without a meaningful percentage
    signed_mean_percent: float  # mean of Eq. 3.12.
    signed_std_percent: float  # its standard deviation
    abs_mean_percent: float  # mean of its absolute value
    abs_mean_mm: float  # mean absolute error of a CoM component, mm; NaN for mass and inertia


def breakdown(
    evaluation: HeldOutEstimates, condition: str, target: str
) -> tuple[BreakdownRow, ...]:
    """Errors of `target` at each level of `condition`, levels rising.

    A condition with up to eight values has a level for each, others are cut into eight bins of
    equal width. Pushes whose condition is unknown are in no row.
    """
    errors = target_errors(evaluation, target)
    rows = []
    for level in condition_levels(condition_values(evaluation, condition)):
        signed = errors.signed_percent[level.rows & errors.used]
        mm = np.empty(0) if errors.signed_mm is None else errors.signed_mm[level.rows]
        mm = mm[np.isfinite(mm)]
        rows.append(
            BreakdownRow(
                condition=condition,
                level=level.value,
                label=level.label,
                target=target,
                n=signed.size,
                failed=int((errors.failed & level.rows).sum()),
                left_out=int((errors.left_out & level.rows).sum()),
                signed_mean_percent=float(signed.mean()) if signed.size else np.nan,
                signed_std_percent=float(signed.std()) if signed.size else np.nan,
                abs_mean_percent=float(np.abs(signed).mean()) if signed.size else np.nan,
                abs_mean_mm=float(np.abs(mm).mean()) if mm.size else np.nan,
            )
        )
    return tuple(rows)


def condition_values(evaluation: HeldOutEstimates, condition: str) -> Float[np.ndarray, " n"]:
    """Values of one of `CONDITIONS`; the mass is the true one."""
    if condition not in CONDITIONS:
        raise ValueError(f"condition is {condition!r}; choose one of {CONDITIONS}")
    if condition == "mass":
        return np.asarray(evaluation.truth.mass, float)
    return np.asarray(getattr(evaluation.conditions, condition), float)


def condition_levels(values: Float[np.ndarray, " n"]) -> tuple[Level, ...]:
    """Levels of `values`, rising: each distinct value, or eight bins where there are more."""
    rounded = np.array([float(f"{value:.{_SIGNIFICANT_DIGITS}g}") for value in values])
    known = np.isfinite(rounded)
    distinct = np.unique(rounded[known] + 0.0)  # + 0.0 turns -0 into 0
    if distinct.size <= _MAX_LEVELS:
        return tuple(Level(float(v), f"{v:.3g}", rounded == v) for v in distinct)
    edges = np.linspace(distinct[0], distinct[-1], _MAX_LEVELS + 1)
    bins = np.clip(np.searchsorted(edges, rounded, side="right") - 1, 0, _MAX_LEVELS - 1)
    return tuple(
        Level(
            float((edges[i] + edges[i + 1]) / 2),
            f"{edges[i]:.2g} to {edges[i + 1]:.2g}",
            known & (bins == i),
        )
        for i in range(_MAX_LEVELS)
        if (known & (bins == i)).any()
    )
