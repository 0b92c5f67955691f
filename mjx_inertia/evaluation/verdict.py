"""The sentences at the top of the report, made from the numbers and from nothing else.

In: summaries of one split. Out: text.
"""

from collections.abc import Sequence

import numpy as np

from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation.summary import TargetSummary, leading_estimator
from mjx_inertia.evaluation.tables import TARGET_NAMES, estimator_rows, format_number


def describe_errors(rows: dict[str, TargetSummary]) -> str:
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

    Args:
      summaries: of one split.
      phrase: where this holds, such as "on cubes never seen in training".
      baseline: name of the predict-the-mean estimator.
      with_baseline: says what the baseline achieves.
    """
    rows = estimator_rows(summaries, baseline)
    leader = leading_estimator(summaries, baseline)
    text = f"{leader}: {describe_errors(rows[leader])} {phrase}"
    if with_baseline and baseline in rows and leader != baseline:
        text += f"; predicting the training mean: {describe_errors(rows[baseline])}"
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
