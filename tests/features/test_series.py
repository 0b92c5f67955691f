"""The series of a push: its bins, and what it is free of."""

import numpy as np
from features.records import random_records
from features.test_feature_sets import CONTACT, features, numpy_signals

from mjx_inertia.features import FeatureSettings
from mjx_inertia.features.example_table import feature_names
from mjx_inertia.features.feature_sets import (
    BINS,
    PARTS,
    SCALES,
    SERIES_EDGES,
    mirror_signs,
    series_grid,
)

COLUMNS = feature_names("series", FeatureSettings())


def test_early_bins_are_samples_and_parts_are_means_of_samples():
    records = random_records(0, 8, 60)
    got = features(records, "series", CONTACT)
    assert series_grid(COLUMNS) == (9, BINS)
    table = got[:, : 9 * BINS].reshape(8, 9, BINS)
    for row in range(8):
        values, placed = numpy_signals(records, row, "contact")
        force = np.linalg.norm(values[:, :2], axis=1).mean()
        speed = np.linalg.norm(values[:, 6:8], axis=1).mean()
        tip = values[:, 6:8].mean(axis=0) / speed
        np.testing.assert_allclose(got[row, -len(SCALES) :], [force, speed, *tip], rtol=1e-3)
        scaled = np.concatenate([values[:, :3] / force, values[:, 3:6] / speed, placed], axis=1)
        early = min(24, len(scaled))
        np.testing.assert_allclose(table[row, :, :early].T, scaled[:early], rtol=2e-3, atol=2e-4)
        after = np.array(
            [*(begin > len(scaled) / 100 for begin in SERIES_EDGES[:-1]), *[False] * PARTS]
        )
        assert not table[row][:, after].any()
        parts = table[row, :, -PARTS:].mean(axis=1)
        np.testing.assert_allclose(parts, scaled.mean(axis=0), rtol=2e-3, atol=2e-4)


def test_forces_leave_their_scale_in_one_column():
    records = random_records(1, 8, 60)
    heavier = records.replace(force=3 * records.force, moment=3 * records.moment)
    one, three = features(records, "series"), features(heavier, "series")
    place = COLUMNS.index("series/mean_force")
    np.testing.assert_allclose(three[:, place], 3 * one[:, place], rtol=1e-4)
    rest = np.arange(len(COLUMNS)) != place
    np.testing.assert_allclose(three[:, rest], one[:, rest], rtol=1e-3, atol=1e-5)


def test_mirror_signs_are_those_of_the_mirrored_push():
    records = random_records(2, 8, 60)
    normal = np.tile([1.0, 0.0], (8, 1))
    records = records.replace(contact_normal=normal)
    across = np.array([1.0, -1.0])
    mirrored = records.replace(
        force=records.force * across,
        moment=-records.moment,
        pose=records.pose * [1.0, -1.0, -1.0],
        twist=records.twist * [1.0, -1.0, -1.0],
        tip_position=records.tip_position * across,
        tip_velocity=records.tip_velocity * across,
        contact_point=records.contact_point * across,
    )
    signs = mirror_signs(COLUMNS)
    assert signs is not None
    want = features(records, "series") * signs
    np.testing.assert_allclose(features(mirrored, "series"), want, rtol=1e-3, atol=1e-4)
    assert mirror_signs(("windows/f_x/1/mean",)) is None
