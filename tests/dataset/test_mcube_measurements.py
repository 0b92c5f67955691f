"""Real pushes: what physics and geometry must hold in them, whatever the object.

The measurements are a subset of the published ones; the limits here are wide on purpose.
"""

import json

import h5py
import numpy as np
import pytest

from mjx_inertia.dataset.mcube import (
    TIP_RADIUS,
    contact_in_world,
    load_mcube,
    record_from_bytes,
)
from mjx_inertia.dataset.mcube_folder import load_mcube_folder
from mjx_inertia.objects import load_mcube_objects
from mjx_inertia.pushing import PushStatus

OBJECTS = load_mcube_objects()


@pytest.fixture(scope="module")
def real(measurements):
    if not (measurements / "mcube_raw").is_dir():
        pytest.skip("no mcube_raw among the measurements")
    return load_mcube_folder(measurements, OBJECTS, progress=False)


@pytest.fixture(scope="module")
def good(real):
    return np.flatnonzero(np.asarray(real.batch.records.status) == PushStatus.OK)


def pushes(real, good):
    records = real.batch.records
    for i in good:
        n = int(records.length[i])
        model = OBJECTS[real.objects[int(real.batch.conditions.object_id[i])]]
        fields = ("pose", "tip_position", "tip_velocity", "force", "twist")
        yield model, *(np.asarray(getattr(records, field)[i, :n], float) for field in fields)


def test_all_files_load_and_frozen_sensors_are_found(real, good):
    assert not real.failures
    status = np.asarray(real.batch.records.status)
    square = np.asarray(real.batch.conditions.object_id) == real.objects.index("rect1")
    np.testing.assert_array_equal(status == PushStatus.FROZEN_FORCE, square)
    assert square.sum() == 13
    assert np.sum(status == PushStatus.TRACKING_JUMP) == 0
    assert len(good) >= 30


def test_the_tip_pushes_the_object_and_does_work(real, good):
    for _, _, _, tip_velocity, force, _ in pushes(real, good):
        assert np.mean(np.sum(force * tip_velocity, axis=-1)) > 0.0


def test_the_tip_touches_the_outline(real, good):
    gaps = []
    for model, pose, tip, *_ in pushes(real, good):
        gap = contact_in_world(model, pose, tip).distance - TIP_RADIUS
        assert -2e-3 < np.median(gap) < 2.5e-3
        gaps.append(np.median(np.abs(gap)))
    assert np.median(gaps) < 1e-3


def test_paths_and_speeds_are_those_of_the_file_names(real, good):
    records, conditions = real.batch.records, real.batch.conditions
    off = []
    for i, (_, _, tip, tip_velocity, _, _) in zip(good, pushes(real, good), strict=True):
        speed = np.median(np.hypot(*tip_velocity[len(tip) // 3 :].T))
        assert speed == pytest.approx(float(conditions.speed[i]), rel=0.1)
        way, normal = tip[-1] - tip[0], np.asarray(records.contact_normal[i], float)
        assert np.hypot(*way) == pytest.approx(0.05, abs=1e-3)
        angle = np.arctan2(normal[0] * way[1] - normal[1] * way[0], normal @ way)
        off.append(abs(angle - float(conditions.angle[i])))
    # Where a smooth outline is drawn with kinks, the kink's normal is not the one of the push.
    assert np.max(off) < 0.3
    assert np.median(off) < 0.02


def test_forces_are_of_the_size_of_friction(real, good):
    """Coulomb: the median force per weight on these tables lies well below 1."""
    for model, _, _, _, force, _ in pushes(real, good):
        effective = np.median(np.hypot(*force.T)) / (9.81 * float(model.inertial.mass))
        assert 0.03 < effective < 0.8


def test_velocities_integrate_to_the_motion(real, good):
    for _, pose, tip, tip_velocity, _, twist in pushes(real, good):
        for path, rate, limit in ((pose, twist, [5e-4, 5e-4, 5e-3]), (tip, tip_velocity, 5e-4)):
            way = 0.01 * np.sum(0.5 * (rate[1:] + rate[:-1]), axis=0)
            assert np.all(np.abs(way - (path[-1] - path[0])) < limit)


def test_clocks_and_signs_of_good_pushes_are_trusted_and_spoilt_ones_are_not(measurements, good):
    """Of what was OK before these checks, nothing is refused; each fault is found in all."""
    assert len(good) == 35
    found = {"stamp": set(), "sign": set()}
    for path in sorted((measurements / "mcube_raw").rglob("*.h5"))[:12]:
        with h5py.File(path) as file:
            tables = {key: np.array(file[key], float) for key in ("object_pose", "tip_pose")}
            wrench = np.array(file["ft_wrench"], float)
        before = int(load_mcube(path).status)
        for fault, change in (("stamp", (-1, 0)), ("sign", (slice(None), slice(1, None)))):
            spoilt = wrench.copy()
            spoilt[change] = spoilt[change] + 1e3 if fault == "stamp" else -spoilt[change]
            content = json.dumps(
                {k: v.tolist() for k, v in (tables | {"ft_wrench": spoilt}).items()}
            )
            record = record_from_bytes(
                content.encode(), f"{path.stem}.json", OBJECTS, 100.0, TIP_RADIUS
            )
            if before == PushStatus.OK:
                found[fault].add(int(record.status))
    assert found == {"stamp": {PushStatus.CLOCK_JUMP}, "sign": {PushStatus.FORCE_PULLS}}
