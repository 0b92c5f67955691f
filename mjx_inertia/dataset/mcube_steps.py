"""Small steps of a tracked pose, taken out.

In: poses at the times of a steady clock. Out: the same without steps.

A tracker that loses a marker or finds it again shifts the whole pose by 0.1 to 0.3 mm or 2 mrad
between two samples. That is little beside a push of 50 mm, but it is an acceleration of 10 m/s².
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray

SMALLEST = (6e-5, 6e-5, 1.2e-3)  # m, m, rad: several times the tracker's noise between two samples
LARGEST = (3e-3, 3e-3, 3e-2)  # m, m, rad: beyond, the tracked pose is in doubt and stays as it is
_NEIGHBOURS = 3  # differences on each side that tell the motion
_MOST = 20  # steps of one push


def without_steps(time: Float[ndarray, " n"], pose: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
    """Takes out each difference of two samples that is unlike those before and after it.

    What follows a step is shifted back. A difference counts as a step where it departs from the
    mean of its neighbours' rates by more than `SMALLEST` and more than these differ between
    themselves, so that the start of motion stays. Beyond `LARGEST` it is left to the status.

    Args:
      time: of the samples, s.
      pose: x, y (m) and yaw (rad, unwrapped).
    """
    spacing = np.diff(time)[:, None]
    value = pose.copy()
    kept = np.zeros(len(spacing), dtype=bool)
    for _ in range(_MOST):
        rate = np.diff(value, axis=0) / spacing
        before, after = _neighbours(rate)
        step = (rate - 0.5 * (before + after)) * spacing
        between = np.abs(before - after) * spacing
        score = (np.abs(step) / (np.array(SMALLEST) + between)).max(axis=1)
        score[kept] = 0.0
        place = int(score.argmax())
        if score[place] < 1.0:
            break
        if np.any(np.abs(step[place]) > np.array(LARGEST)):
            kept[max(place - _NEIGHBOURS, 0) : place + _NEIGHBOURS + 1] = True
            continue
        value[place + 1 :] -= step[place]
    return value


def _neighbours(rate: Float[ndarray, "m 3"]) -> tuple[Float[ndarray, "m 3"], Float[ndarray, "m 3"]]:
    """Mean rates over the differences before and after each; at an end those of the other side."""
    total = np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(rate, axis=0)])
    here = np.arange(len(rate))
    first, last = np.maximum(here - _NEIGHBOURS, 0), np.minimum(here + _NEIGHBOURS, len(rate) - 1)
    before = (total[here] - total[first]) / np.maximum(here - first, 1)[:, None]
    after = (total[last + 1] - total[here + 1]) / np.maximum(last - here, 1)[:, None]
    before[0], after[-1] = after[0], before[-1]
    return before, after
