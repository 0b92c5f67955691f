"""Times of samples from late stamps: against the clock that made them."""

import numpy as np
import pytest

from mjx_inertia.dataset.mcube_cleaning import sampling_times, without_steps

PERIOD = 0.004


def late(true, seed, mean=4e-4, largest=0.01):
    """Stamps of arrival: mostly prompt, some late, sorted as a file is."""
    delay = np.random.default_rng(seed).exponential(mean, len(true))
    return np.unique(true + np.minimum(delay, largest))


def off(found, true):
    """Largest error in s; a constant delay is common to all streams of a recorder."""
    error = found - true
    return np.abs(error - np.median(error)).max()


@pytest.mark.parametrize("seed", range(5))
def test_jitter_of_a_steady_clock_is_removed(seed):
    true = 1.45e9 + 0.004032 * np.arange(300)
    stamps = late(true, seed)
    clock = sampling_times(stamps)
    assert clock.steady
    assert off(clock.time, true) < 1e-4 < 0.1 * off(stamps, true)


@pytest.mark.parametrize("lost", [[150], [40, 200], [90, 91, 92, 230]])
def test_lost_samples_leave_a_gap(lost):
    true = np.delete(PERIOD * np.arange(300), lost)
    clock = sampling_times(late(true, 1, mean=2e-4))
    assert clock.steady
    error = np.abs(clock.time - true - np.median(clock.time - true))
    # A loss between late stamps may be put one or two samples aside; the count is right.
    assert np.sum(error > 3e-4) <= 3
    assert error[[0, -1]].max() < 3e-4


def test_a_burst_of_held_up_samples():
    true = PERIOD * np.arange(300)
    stamps = late(true, 2, mean=1e-4)
    stamps[150:162] = stamps[162] - 1e-4 * np.arange(12, 0, -1)
    clock = sampling_times(stamps)
    assert clock.steady
    assert off(clock.time, true) < 1e-4


@pytest.mark.parametrize(
    "stamps",
    [
        np.cumsum(np.random.default_rng(0).uniform(0.002, 0.006, 500)),  # no clock at all
        np.cumsum(np.linspace(0.0039, 0.0041, 500)),  # a rate that drifts
        late(0.004 * np.arange(12), 0),  # too few to tell
    ],
)
def test_a_stream_without_steady_clock_keeps_its_stamps(stamps):
    clock = sampling_times(stamps)
    assert not clock.steady
    assert np.all(np.diff(clock.time) > 0)
    assert np.quantile(np.abs(clock.time - stamps), 0.9) < 1e-3


def motion(time):
    """Rest, then a start within 30 ms, to 100 mm/s and 1 rad/s."""
    since = np.clip(time - 0.3, 0.0, None)
    path = np.where(since < 0.03, since**2 / 0.06, since - 0.015)
    return np.stack([0.1 * path, -0.03 * path, path], axis=-1)


def test_steps_of_tracking_are_taken_out_and_motion_stays():
    time = PERIOD * np.arange(250)
    rng = np.random.default_rng(3)
    true = motion(time) + rng.standard_normal((250, 3)) * [5e-6, 5e-6, 1e-4]
    np.testing.assert_allclose(without_steps(time, true), true, atol=1e-12)
    pose = true.copy()
    pose[120:] += [2e-4, 0.0, -2e-3]
    pose[180:] += [0.0, -3e-4, 4e-3]
    assert np.abs(without_steps(time, pose) - true).max(axis=0) == pytest.approx(
        [0.0, 0.0, 0.0], abs=4e-4
    )
    assert np.abs(without_steps(time, pose) - true).max() < 0.2 * np.abs(pose - true).max()


def test_a_lost_sample_is_no_step_and_a_failure_of_tracking_stays():
    time = np.delete(PERIOD * np.arange(250), [150, 200])
    true = motion(time)
    np.testing.assert_allclose(without_steps(time, true), true, atol=1e-12)
    failed = true.copy()
    failed[180:] += [0.05, 0.0, np.pi / 2]
    np.testing.assert_allclose(without_steps(time, failed), failed, atol=1e-12)
