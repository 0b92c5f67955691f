"""Two faults of recorders, mended: late time stamps and small steps of a tracked pose.

In: stamps of one stream, increasing; poses at the times of a steady clock. Out: the time of each
sample, and whether its clock is steady; the poses without steps.

Recorders sample at a steady rate and stamp what arrives, up to 10 ms late. At 100 mm/s 1 ms is
0.1 mm, more than the tracker's own noise, so the stamps of a steady stream are replaced by a
straight line in the sample number. An unsteady stream keeps its stamps, bursts of late ones spread
over the gap before them.

A tracker that loses a marker or finds it again shifts the whole pose by 0.1 to 0.3 mm or 2 mrad
between two samples. That is little beside a push of 50 mm, but it is an acceleration of 10 m/s².
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

_FEWEST = 40  # stamps that tell a clock
_OUTLIER = 4.5  # median deviations: a stamp further from the line than this is a late one
_STEP = 0.6  # of a period: a lasting step of the stamps beyond it is a lost sample
_NEIGHBOURS = 15  # stamps whose median stands for one side of a step
_DRIFT = 0.4  # of a period: a median of neighbours further off the line shows another clock
_MOST_LOST = 0.05  # of the samples; a line with more breaks would fit anything
SMALLEST = (6e-5, 6e-5, 1.2e-3)  # m, m, rad: several times the tracker's noise between two samples
LARGEST = (3e-3, 3e-3, 3e-2)  # m, m, rad: beyond, the tracked pose is in doubt and stays as it is
_BESIDE = 3  # differences on each side that tell the motion
_MOST = 20  # steps of one push


class Clock(NamedTuple):
    """Times of the samples, s, and whether they are those of a steady clock."""

    time: Float[ndarray, " n"]
    steady: bool


def sampling_times(stamps: Float[ndarray, " n"]) -> Clock:
    """Times at which samples were taken, strictly increasing.

    A line that is common to all stamps holds the mean delay too, which streams of one recorder
    share.

    Args:
      stamps: of arrival, s, strictly increasing.
    """
    start = stamps[0]
    earlier = _undelayed(stamps - start)
    steady = _steady(earlier) if len(stamps) >= _FEWEST else None
    return Clock(start + (earlier if steady is None else steady), steady is not None)


def _steady(stamps: Float[ndarray, " n"]) -> Float[ndarray, " n"] | None:
    """The straight line in the sample number, lost samples counted; None if there is none."""
    number = np.arange(len(stamps))
    line = _line(number, stamps)
    most = int(_MOST_LOST * len(stamps)) + 1
    for _ in range(most):
        period = line[0]
        if not period > 0.0:
            return None
        step = _lasting_steps(stamps - np.polyval(line, number))
        last = int(step.argmax())
        if step[last] < _STEP * period:
            break
        number[last + 1 :] += round(step[last] / period)
        line = _line(number, stamps)
    time = np.polyval(line, number)
    beside = stamps - time
    width = min(2 * _NEIGHBOURS + 1, len(beside))
    running = np.median(np.lib.stride_tricks.sliding_window_view(beside, width), axis=-1)
    if np.abs(running).max() > _DRIFT * line[0] or number[-1] > (1.0 + _MOST_LOST) * len(stamps):
        return None
    return time


def _line(number: Int[ndarray, " n"], stamps: Float[ndarray, " n"]) -> Float[ndarray, "2"]:
    """Slope and offset of the line through all stamps but the late ones."""
    line = np.polyfit(number, stamps, 1)
    for _ in range(4):
        line = np.polyfit(number[kept := _on_time(number, stamps, line)], stamps[kept], 1)
    return line


def _on_time(
    number: Int[ndarray, " n"], stamps: Float[ndarray, " n"], line: Float[ndarray, "2"]
) -> Bool[ndarray, " n"]:
    off = stamps - np.polyval(line, number)
    off = np.abs(off - np.median(off))
    return off <= _OUTLIER * np.median(off) + 1e-5


def _lasting_steps(off: Float[ndarray, " n"]) -> Float[ndarray, " m"]:
    """By how much the stamps after each sample lie higher than those before; 0 near the ends."""
    half = _NEIGHBOURS
    steps = np.zeros(len(off))
    if len(off) > 2 * half:
        median = np.median(np.lib.stride_tricks.sliding_window_view(off, half), axis=-1)
        steps[half - 1 : len(off) - half] = median[half:] - median[:-half]
    return steps


def _undelayed(time: Float[ndarray, " n"]) -> Float[ndarray, " n"]:
    """Moves back the stamps of samples that were held up and then came in a burst.

    Samples are taken at a steady rate and stamped when they arrive, so none was taken later than
    the stamp of a later one minus the samples between. Stamps within two spacings of that bound
    are left alone: their jitter is not told from the motion.
    """
    gaps = np.diff(time)
    spacing = float(min(np.median(gaps), gaps.mean()))  # of a rattling clock the mean is less
    # Slightly short, so that the bound fades out over some forty samples if the rate drifts.
    bound = _no_later(time, 0.95 * spacing)
    return _no_later(np.where(time - bound > 2.0 * spacing, bound, time), 0.01 * spacing)


def _no_later(time: Float[ndarray, " n"], step: float) -> Float[ndarray, " n"]:
    """The latest times, none after its stamp, that keep at least `step` between successive ones."""
    place = step * np.arange(len(time))
    return np.minimum.accumulate((time - place)[::-1])[::-1] + place


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
            kept[max(place - _BESIDE, 0) : place + _BESIDE + 1] = True
            continue
        value[place + 1 :] -= step[place]
    return value


def _neighbours(rate: Float[ndarray, "m 3"]) -> tuple[Float[ndarray, "m 3"], Float[ndarray, "m 3"]]:
    """Mean rates over the differences before and after each; at an end those of the other side."""
    total = np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(rate, axis=0)])
    here = np.arange(len(rate))
    first, last = np.maximum(here - _BESIDE, 0), np.minimum(here + _BESIDE, len(rate) - 1)
    before = (total[here] - total[first]) / np.maximum(here - first, 1)[:, None]
    after = (total[last + 1] - total[here + 1]) / np.maximum(last - here, 1)[:, None]
    before[0], after[-1] = after[0], before[-1]
    return before, after
