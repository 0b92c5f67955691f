"""The analytical method against Newton's laws alone, and on the two-finger scene."""

import numpy as np
import pytest

from mjx_inertia.estimators import TwoFingerLeastSquares, estimate_two_finger
from mjx_inertia.objects import prism
from mjx_inertia.pushing.two_finger_scene import (
    TwoFingerMotion,
    TwoFingerPush,
    measured,
    simulate_two_finger,
)

SIZE, MASS, FRICTION, COM = (0.15, 0.2, 0.15), 2.5, 0.4, (0.004, -0.006)
ACCELERATIONS = (0.2, 0.4, 0.6, 0.8)


@pytest.fixture(scope="module")
def box():
    x, y = SIZE[0] / 2, SIZE[1] / 2
    outline = np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
    return prism(outline, SIZE[2], MASS, com=COM, name="box")


@pytest.fixture(scope="module")
def groups(box):
    x, y = SIZE[0] / 2, SIZE[1] / 2
    side = y - 0.06
    radius = side + (x**2 + y**2) / (3 * side)
    motions = {
        "straight": [TwoFingerMotion((-x, 0.008), (1.0, 0.0), a, 0.15) for a in ACCELERATIONS],
        "across": [TwoFingerMotion((-0.005, -y), (0.0, 1.0), a, 0.15) for a in ACCELERATIONS],
        "turning": [
            TwoFingerMotion((-x, -side), (1.0, 0.0), a, radius * np.radians(30), radius, x)
            for a in ACCELERATIONS
        ],
    }
    return {k: [simulate_two_finger(box, FRICTION, m) for m in v] for k, v in motions.items()}


def test_the_scene_obeys_newton(groups):
    """While it speeds up the table takes μ m g, not more, and both fingers push."""
    for push, acceleration in zip(groups["straight"], ACCELERATIONS, strict=True):
        force = push.force.sum(1)[3:, 0]
        np.testing.assert_allclose(force - MASS * acceleration, FRICTION * MASS * 9.81, rtol=0.005)
        np.testing.assert_allclose(push.twist[2:, 2], 0, atol=5e-3)
    for push in groups["turning"]:
        assert np.linalg.norm(push.force, axis=-1).min() > 0.1
        assert push.pose[-1, 2] == pytest.approx(np.radians(30), abs=np.radians(8))


def test_recovers_all_parameters_without_noise(groups, box):
    told = estimate_two_finger(**groups)
    inertia = float(box.inertial.inertia[2, 2])
    assert told.mass == pytest.approx(MASS, rel=0.005)
    assert told.friction == pytest.approx(FRICTION, rel=0.01)
    np.testing.assert_allclose(told.com, COM, atol=2e-4)
    assert told.inertia == pytest.approx(inertia, rel=0.05)


def test_noise_shrinks_mass_by_samples_and_not_by_pushes(groups):
    """Differences of noisy velocities are noisy regressors: Yu's fit at 20 Hz is biased."""
    rng = np.random.default_rng(0)
    mass = {"samples": [], "pushes": []}
    for _ in range(40):
        noisy = {k: [measured(p, 0.05, rng) for p in v] for k, v in groups.items()}
        for rows, found in mass.items():
            told = estimate_two_finger(**noisy, settings=TwoFingerLeastSquares(rows=rows))
            found.append(told.mass / MASS - 1)
            assert np.linalg.norm(told.com - COM) < 1e-3
    assert np.mean(mass["samples"]) < -0.1
    assert abs(np.mean(mass["pushes"])) < 0.03
    assert np.std(mass["pushes"]) < 0.08


def test_motion_starts_where_told_and_keeps_the_fingers_apart():
    motion = TwoFingerMotion((-0.1, -0.03), (1.0, 0.0), 0.4, 0.05, turning_radius=0.2, depth=0.1)
    fingers = np.array([[-0.1, 0.02], [-0.1, -0.08]])
    np.testing.assert_allclose(motion.place(0.0, fingers), fingers)
    moved = motion.place(motion.duration, fingers)
    assert np.linalg.norm(moved[0] - moved[1]) == pytest.approx(0.1)
    np.testing.assert_allclose(motion.place(0.01, fingers)[0, 0] > fingers[0, 0], True)
    turned = np.arctan2(*(moved[0] - moved[1])[::-1]) - np.pi / 2
    assert turned == pytest.approx(0.05 / 0.2)


def test_misuse_is_named(groups):
    with pytest.raises(ValueError, match="across: 1 pushes"):
        estimate_two_finger(groups["straight"], groups["across"][:1], groups["turning"])
    with pytest.raises(ValueError, match="rows='all'"):
        TwoFingerLeastSquares(rows="all")
    assert isinstance(groups["straight"][0], TwoFingerPush)
