"""Mass from Newton's law: bodies moved on known paths by the forces that this takes."""

import dataclasses

import jax
import numpy as np
import pytest

from mjx_inertia.dataset import PushTruth, load_mcube_folder
from mjx_inertia.estimators import EstimateStatus
from mjx_inertia.estimators.force_balance_fit import BalanceSettings
from mjx_inertia.estimators.newton import fit_newton, predict_newton
from mjx_inertia.objects import friction_radius, load_mcube_objects
from mjx_inertia.pushing import PushRecord, PushStatus

PROBE, C = 0.2, 0.035  # kg, m
COM = np.array([0.004, -0.003])  # m, object frame
DT = 0.002


def cross(arm):
    return np.stack([-arm[:, 1], arm[:, 0]], axis=-1)


def turned(yaw, p):
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack([cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]], axis=-1)


def wave(t, rng, size):
    """A smooth signal of three sines below 5 Hz with its first two derivatives."""
    total = np.zeros((3, len(t)))
    for w in 2 * np.pi * rng.uniform(1.5, 5.0, 3):
        phase, a = rng.uniform(0, 6.28), size / w
        total += a * np.stack(
            [np.sin(w * t + phase), w * np.cos(w * t + phase), -(w**2) * np.sin(w * t + phase)]
        )
    return total


def push(mass, seed, *, noise=0.0, speed=0.1, angle=0.0, status=PushStatus.OK):
    """A body that slides at `speed` with swings; friction grows by a fifth along the path."""
    rng = np.random.default_rng(seed)
    t = DT * np.arange(1, 301)

    def at(time):
        r = np.random.default_rng(seed)
        x, y, yaw = (wave(time, r, k * speed) for k in (0.2, 0.2, 3.0))
        x[0] += speed * time
        x[1] += speed
        q, v, a = np.stack([x, y, yaw], axis=-1)
        tip = turned(q[:, 2], np.array([-0.05, 0.01]))
        com = turned(q[:, 2], COM)
        w, dw = v[:, 2:], a[:, 2:]
        a_com, a_tip = (a[:, :2] + dw * cross(p) - w**2 * p for p in (com, tip))
        v_com = v[:, :2] + w * cross(com)
        size = np.hypot(np.hypot(*v_com.T), C * v[:, 2])[:, None]
        path = np.cumsum(size)[:, None]
        f = 4.0 * (1.0 + 0.2 * path / path[-1])
        return q, v, tip + q[:, :2], mass * a_com + PROBE * a_tip + f * v_com / size

    q, v, tip, _ = at(t)
    force = at(t - 0.5 * DT)[3] + noise * rng.standard_normal((len(t), 2))
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    as32 = lambda x: np.asarray(x, np.float32)  # noqa: E731
    return PushRecord(
        time=as32(t),
        force=as32(force @ R.T),
        moment=as32(0.0 * t),
        pose=as32(np.column_stack([q[:, :2] @ R.T + 0.3, q[:, 2] + angle])),
        twist=as32(np.column_stack([v[:, :2] @ R.T, v[:, 2]])),
        tip_position=as32(tip @ R.T + 0.3),
        tip_velocity=as32(np.gradient(tip, DT, axis=0) @ R.T),
        contact_point=as32(tip[0] @ R.T + 0.3),
        contact_normal=as32(R[:, 0]),
        length=np.int32(len(t)),
        status=np.int32(status),
    )


def batch(records):
    n = len(records)
    return jax.tree.map(lambda *x: np.stack(x), *records), np.tile(COM, (n, 1)), np.full(n, C)


def truth_of(masses):
    m = np.asarray(masses, np.float32)
    return PushTruth(mass=m, inertia=1e-3 * m, com=np.tile(np.float32([0.05, 0.0]), (len(m), 1)))


MASSES = np.array([0.6, 0.9, 1.2, 1.5, 0.7, 1.0])


@pytest.fixture(scope="module")
def fitted():
    return fit_newton(*batch([push(m, k) for k, m in enumerate(MASSES)]), truth_of(MASSES))


def test_noiseless_pushes_give_probe_and_mass(fitted):
    assert float(fitted.probe_mass) == pytest.approx(PROBE, rel=0.01)
    others = np.array([0.5, 0.8, 1.1, 1.7, 2.0, 1.3])
    found = predict_newton(fitted, *batch([push(m, 50 + k) for k, m in enumerate(others)]))
    np.testing.assert_allclose(found.mean[:, 0], others, rtol=0.005)
    assert np.all(np.asarray(found.status) == EstimateStatus.OK)
    # Of I_zz and CoM it learns nothing and says so.
    np.testing.assert_allclose(found.mean[:, 1], 1e-3 * MASSES.mean(), rtol=1e-5)
    assert np.all(np.isinf(np.asarray(found.covariance)[:, [1, 2, 3], [1, 2, 3]]))


def test_the_frame_of_the_world_does_not_matter(fitted):
    kept, turned_ = (
        predict_newton(fitted, *batch([push(1.0, k, angle=a) for k in range(6)])).mean[:, 0]
        for a in (0.0, 2.0)
    )
    np.testing.assert_allclose(turned_, kept, rtol=2e-3)


def test_standard_deviations_are_those_of_the_errors():
    """White noise on the force is correlated once filtered; what that hides, calibration finds."""
    known = np.tile(MASSES, 8)
    fitted = fit_newton(
        *batch([push(m, k, noise=1.0) for k, m in enumerate(known)]), truth_of(known)
    )
    assert float(fitted.probe_mass) == pytest.approx(PROBE, abs=0.02)
    found = predict_newton(fitted, *batch([push(1.0, 100 + k, noise=1.0) for k in range(96)]))
    error = np.asarray(found.mean)[:, 0] - 1.0
    deviation = np.sqrt(np.asarray(found.covariance)[:, 0, 0])
    assert 0.75 < np.sqrt(np.mean((error / deviation) ** 2)) < 1.35
    assert abs(error.mean()) < 4 * error.std() / np.sqrt(96)


def test_calibration_learns_by_how_much_residuals_understate():
    records = [push(m, k, noise=0.3) for k, m in enumerate(np.tile(MASSES, 8))]
    wrong = np.tile(MASSES, 8) * (1 + 0.2 * np.random.default_rng(0).standard_normal(48))
    inputs = batch(records)
    assert float(fit_newton(*inputs, truth_of(np.tile(MASSES, 8))).spread) < 1.5
    assert float(fit_newton(*inputs, truth_of(wrong)).spread) > 2.0


def test_pushes_that_tell_nothing_say_so(fitted):
    still, good, lost = push(1.0, 0, speed=0.002), push(1.0, 1), push(1.0, 2)
    short = dataclasses.replace(good, length=np.int32(60))
    lost = dataclasses.replace(lost, status=np.int32(PushStatus.LOST_CONTACT))
    found = predict_newton(fitted, *batch([still, good, short, lost, good, good]))
    variance = np.asarray(found.covariance)[:, 0, 0]
    np.testing.assert_array_equal(np.isinf(variance), [True, False, True, True, False, False])
    assert float(found.mean[0, 0]) == pytest.approx(MASSES.mean(), rel=1e-5)
    assert int(found.status[3]) == EstimateStatus.BAD_INPUT
    assert np.all(np.isnan(np.asarray(found.mean)[3]))
    with pytest.raises(ValueError, match="slide long enough"):
        fit_newton(*batch([still] * 6), truth_of(MASSES))


def test_records_of_another_rate_are_refused(fitted):
    records, com, radius = batch([push(1.0, 0)])
    slow = records.replace(time=5.0 * records.time)
    with pytest.raises(ValueError, match="rate=500"):
        predict_newton(fitted, slow, com, radius)
    with pytest.raises(ValueError, match="kernel"):
        BalanceSettings(kernel=0.0)


@pytest.mark.long
def test_real_pushes_of_an_object_unseen_in_calibration(measurements):
    """The object with most usable pushes, from the others; a subset of the dataset."""
    if not (measurements / "mcube_raw").is_dir():
        pytest.skip("no mcube_raw among the measurements")
    objects = load_mcube_objects()
    folder = load_mcube_folder(measurements, objects, rate=500.0, progress=False)
    ids, records = np.asarray(folder.batch.conditions.object_id), folder.batch.records
    usable = np.asarray(records.status) == PushStatus.OK
    names = np.array(folder.objects)[ids]
    com = np.array([np.asarray(objects[n].inertial.com)[:2] for n in names])
    radius = np.array(
        [friction_radius(objects[n].outline, c) for n, c in zip(names, com, strict=True)]
    )
    test = ids == np.bincount(ids[usable]).argmax()

    def rows(which):
        kept = jax.tree.map(lambda x: np.asarray(x)[which], (records, folder.batch.truth))
        return kept[0], com[which], radius[which], kept[1]

    fitted = fit_newton(*rows(usable & ~test))
    assert 0.1 < float(fitted.probe_mass) < 0.3
    assert 1.0 <= float(fitted.spread) < 3.0
    *inputs, truth = rows(usable & test)
    found = predict_newton(fitted, *inputs)
    mass, deviation = np.asarray(found.mean)[:, 0], np.sqrt(np.asarray(found.covariance)[:, 0, 0])
    error = mass / truth.mass - 1.0
    informative = deviation < 0.15 * mass
    assert informative.sum() >= 4
    assert np.median(np.abs(error[informative])) < 0.1
    assert np.median(np.abs(error[informative])) < np.median(
        np.abs(fitted.mean[0] / truth.mass - 1)
    )
    assert np.sqrt(np.mean((error * mass / deviation)[informative] ** 2)) < 2.0
