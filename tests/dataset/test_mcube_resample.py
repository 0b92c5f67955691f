"""Resampling of irregular stamps against closed forms, and the repair of late stamps."""

import numpy as np
import pytest
from dataset.mcube_files import OBJECTS, TIP_RADIUS, Push, write_h5

from mjx_inertia.dataset.mcube import interpolated, interval_means, load_mcube, velocities
from mjx_inertia.dataset.mcube_file import Signal

RNG = np.random.default_rng(5)
STAMPS = np.cumsum(RNG.uniform(0.002, 0.006, 500))
TIMES = np.linspace(0.1, 1.8, 341)


def test_straight_lines_are_exact():
    signal = Signal(STAMPS, np.stack([3.0 * STAMPS - 1.0, -STAMPS], axis=-1))
    np.testing.assert_allclose(interpolated(signal, TIMES)[:, 0], 3.0 * TIMES - 1.0)
    means = interval_means(signal, TIMES, 0.01)
    np.testing.assert_allclose(means[:, 0], 3.0 * (TIMES - 0.005) - 1.0)
    np.testing.assert_allclose(velocities(signal, TIMES), np.tile([3.0, -1.0], (341, 1)))


def test_interval_means_add_up():
    """Impulse is kept: means of neighbouring intervals make the mean of their union."""
    signal = Signal(STAMPS, RNG.standard_normal((500, 1)))
    fine = interval_means(signal, np.arange(0.11, 0.2005, 0.01), 0.01)
    coarse = interval_means(signal, np.array([0.2]), 0.1)
    np.testing.assert_allclose(fine.mean(axis=0), coarse[0])


def test_velocity_of_constant_jerk_is_exact_and_of_a_sine_close():
    cubic = Signal(STAMPS, (2.0 * STAMPS**3)[:, None])
    np.testing.assert_allclose(velocities(cubic, TIMES)[:, 0], 6.0 * TIMES**2, rtol=1e-8)
    for frequency, kept in ((11.0, 0.98), (20.0, 0.82)):
        turn = 2.0 * np.pi * frequency
        true = turn * np.cos(turn * TIMES)
        found = velocities(Signal(STAMPS, np.sin(turn * STAMPS)[:, None]), TIMES)[:, 0]
        assert (found @ true) / (true @ true) == pytest.approx(kept, abs=0.015)


def test_velocity_across_a_gap_and_beyond_the_ends():
    keep = (STAMPS < 0.8) | (STAMPS > 0.9)
    signal = Signal(STAMPS[keep], (2.0 * STAMPS[keep] ** 2)[:, None])
    times = np.array([STAMPS[0], 0.79, 0.82, 0.85, 0.89, STAMPS[-1]])
    np.testing.assert_allclose(velocities(signal, times)[:, 0], 4.0 * times, rtol=1e-6)
    cluster = Signal(1.0 + 1e-7 * np.arange(12), RNG.standard_normal((12, 1)))
    assert np.all(np.isfinite(velocities(cluster, np.array([0.9, 1.0]))))


def test_a_burst_of_late_samples_is_put_back(tmp_path):
    """Twelve poses held up for 50 ms and then stamped at once cost little accuracy."""
    tables = Push().tables()
    plain = load_mcube(write_h5(tmp_path, tables), OBJECTS, 100.0, TIP_RADIUS)
    late = slice(150, 162)
    arrival = tables["object_pose"][162, 0]
    tables["object_pose"][late, 0] = arrival - 1e-4 * np.arange(12, 0, -1)
    burst = load_mcube(write_h5(tmp_path, tables), OBJECTS, 100.0, TIP_RADIUS)
    assert np.all(np.abs(burst.twist - plain.twist) < np.array([0.01, 0.01, 0.08]))
    assert np.all(np.abs(burst.pose - plain.pose) < np.array([3e-4, 3e-4, 2e-3]))
    assert int(burst.status) == int(plain.status)
