"""Choosing pushes: limits are kept, and the choice is the best one by its criterion."""

import math

import numpy as np
import pytest

from mjx_inertia.estimators.sysid import SysidSettings
from mjx_inertia.estimators.sysid.next_push import (
    Paths,
    PusherLimits,
    candidates,
    choose,
    straight_pushes,
    target_slopes,
    uncertainty,
)

HALF = np.array([0.08, 0.05, 0.04])
LIMITS = PusherLimits(
    speed=(0.02, 0.1), acceleration=0.5, angle=0.3, contact=0.6, length=0.05, faces=(0, 1, 3)
)


def random_information(rng, n, p=7, rank=4):
    """Information of pushes that each tell `rank` directions only."""
    j = rng.standard_normal((n, rank, p)) * np.exp(rng.uniform(0, 2, (n, 1, 1)))
    return np.einsum("nri,nrj->nij", j, j)


def path_length(motion):
    t = np.linspace(0, 1, 20001)[:, None] * motion.duration
    speed = motion.speed * np.minimum(t / motion.ramp, 1.0)
    return np.trapezoid(speed, t, axis=0)


def test_candidates_keep_the_limits():
    pushes = candidates(LIMITS, HALF, 0.04, offsets=5, angles=3, speeds=3)
    motion = pushes.setup.motion
    assert len(pushes) == 3 * 5 * 3 * 3
    assert set(pushes.face) == {0, 1, 3}
    assert np.abs(pushes.offset).max() <= 0.6 + 1e-12
    assert motion.speed.min() >= 0.02 - 1e-12 and motion.speed.max() <= 0.1 + 1e-12
    np.testing.assert_allclose(motion.speed / motion.ramp, 0.5)
    along = np.einsum("ni,ni->n", motion.direction, pushes.contact_normal)
    assert along.min() >= math.cos(0.3) - 1e-12
    np.testing.assert_allclose(np.linalg.norm(motion.direction, axis=1), 1.0)
    np.testing.assert_allclose(path_length(motion), 0.05, rtol=1e-4)


def test_candidates_start_outside_and_touch_the_outline():
    pushes = candidates(LIMITS, HALF, 0.04, tip_radius=0.005)
    point, normal, start = pushes.contact_point, pushes.contact_normal, pushes.setup.motion.start
    assert np.abs(np.abs(point) / HALF[:2]).max(1) == pytest.approx(1.0)
    assert (np.einsum("ni,ni->n", point, normal) < 0).all()  # normals point inward
    np.testing.assert_allclose(np.linalg.norm(start - point, axis=1), 0.005, atol=2e-5)


def test_a_ramp_longer_than_the_path_keeps_its_length():
    pushes = straight_pushes(
        HALF, 0.04, Paths(0, 0.2, 0.1, 0.3, np.array([0.1, np.inf])), length=0.05
    )
    motion = pushes.setup.motion
    assert motion.ramp[1] == 0.0 and motion.duration[1] == pytest.approx(0.05 / 0.3)
    assert path_length(motion.replace(ramp=np.maximum(motion.ramp, 1e-9))) == pytest.approx(
        0.05, rel=1e-3
    )


@pytest.mark.parametrize(
    "wrong",
    [
        {"speed": (0.1, 0.05)},
        {"acceleration": 0.0},
        {"contact": 1.0},
        {"angle": 2.0},
        {"faces": (4,)},
        {"faces": ()},
        {"length": -1.0},
    ],
)
def test_limits_without_a_push_are_refused(wrong):
    with pytest.raises(ValueError):
        PusherLimits(**wrong)


def test_slopes_are_those_of_mass_and_inertia():
    settings = SysidSettings()
    slope = target_slopes(settings)
    at = {n: i for i, n in enumerate(settings.estimated)}
    b = settings.beliefs
    assert slope[0, at["mass"]] == b.mass.spread and slope[1, at["mass"]] == b.mass.spread
    assert slope[1, at["inertia"]] == b.inertia.spread and slope[0, at["inertia"]] == 0
    assert slope[2, at["com_x"]] == b.com_x.spread
    assert (slope[:, at["friction"]] == 0).all()


@pytest.mark.parametrize("criterion", ["A", "D"])
def test_the_choice_is_the_least_of_all_candidates(criterion):
    rng = np.random.default_rng(0)
    information, targets = random_information(rng, 20), target_slopes(SysidSettings())
    best, scores = choose(np.eye(7), information, targets, criterion)
    covariance = [targets @ np.linalg.inv(np.eye(7) + f) @ targets.T for f in information]
    size = [np.trace(c) if criterion == "A" else np.log(np.linalg.det(c)) for c in covariance]
    np.testing.assert_allclose(scores, size, rtol=1e-9)
    assert best == int(np.argmin(size))


def test_the_d_optimal_choice_does_not_depend_on_units():
    rng = np.random.default_rng(1)
    information, targets = random_information(rng, 30), target_slopes(SysidSettings())
    scaled = targets * np.array([[1.0], [50.0], [0.1], [7.0]])
    assert (
        choose(np.eye(7), information, targets, "D")[0]
        == choose(np.eye(7), information, scaled, "D")[0]
    )


def test_a_second_push_tells_what_the_first_did_not():
    weak, strong = np.diag([100.0, 0.0]), np.diag([0.0, 1.0])
    targets = np.eye(2)
    first, _ = choose(np.eye(2), np.stack([weak, strong]), targets)
    assert first == 0
    second, _ = choose(np.eye(2) + weak, np.stack([weak, strong]), targets)
    assert second == 1


def test_chosen_sequences_beat_random_ones_in_the_mean():
    rng = np.random.default_rng(2)
    targets, known, random = target_slopes(SysidSettings()), [], []
    for _ in range(20):
        information = random_information(rng, 30, rank=2)
        chosen, other = np.eye(7), np.eye(7)
        for _ in range(3):
            chosen = chosen + information[choose(chosen, information, targets)[0]]
            other = other + information[rng.integers(30)]
        known.append(uncertainty(chosen, targets))
        random.append(uncertainty(other, targets))
    assert np.mean(known) < 0.5 * np.mean(random)


def test_draws_of_the_belief_are_averaged():
    rng = np.random.default_rng(3)
    targets = target_slopes(SysidSettings())
    draws = np.stack([random_information(rng, 6) for _ in range(4)])
    _, scores = choose(np.eye(7), draws, targets)
    each = [choose(np.eye(7), d, targets)[1] for d in draws]
    np.testing.assert_allclose(scores, np.mean(each, 0))
