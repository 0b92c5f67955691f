"""Features against plain NumPy, and their invariances."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from features.records import in_another_world, random_records, with_tracker_at

from mjx_inertia.dataset import PushBatch, PushConditions, PushTruth
from mjx_inertia.features import (
    FeatureSettings,
    concatenate,
    examples,
    select_columns,
    take_examples,
)
from mjx_inertia.features.example_table import _rows_of_length, feature_names
from mjx_inertia.features.feature_sets import FEATURE_SETS, HORIZONS, ONSET_EDGES
from mjx_inertia.pushing import PushStatus

TRACKED, CONTACT = FeatureSettings("tracked"), FeatureSettings("contact")
ROWS, SAMPLES = 8, 60  # one shape for most tests, so that they compile once


def on_device(records):
    return jax.tree.map(
        lambda x: jnp.asarray(x, jnp.float32 if np.issubdtype(x.dtype, np.floating) else None),
        records,
    )


def features(records, name, settings=CONTACT):
    return np.asarray(examples(on_device(records), name, settings).features)


def numpy_signals(records, row, reference):
    """Signals and displacement from the start of contact on, in float64 and by loops."""
    n = int(records.length[row])
    nx, ny = records.contact_normal[row]
    to_contact = np.array([[nx, ny], [-ny, nx]])
    force = np.hypot(*records.force[row, :n].T)
    speed = np.hypot(*records.tip_velocity[row, :n].T)
    rank = int(0.95 * (n - 1))
    enough = (force > 0.05 * np.sort(force)[rank]) & (speed > 0.05 * np.sort(speed)[rank])
    start = int(np.flatnonzero(enough)[0])
    yaw0 = records.pose[row, 0, 2]
    point = records.contact_point[row] - records.pose[row, 0, :2]
    values, placed = [], []
    for k in range(start, n):
        position, u, w = (
            records.pose[row, k, :2],
            records.twist[row, k, :2],
            records.twist[row, k, 2],
        )
        m, f = records.moment[row, k], records.force[row, k]
        if reference == "contact":
            turn = records.pose[row, k, 2] - yaw0
            arm = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ point
            position, u = position + arm, u + w * np.array([-arm[1], arm[0]])
            m = m - (arm[0] * f[1] - arm[1] * f[0])
        tip = to_contact @ records.tip_velocity[row, k]
        values.append([*(to_contact @ f), m, *(to_contact @ u), w, *tip])
        placed.append([*(to_contact @ position), records.pose[row, k, 2]])
    placed = np.array(placed)
    return np.array(values), placed - placed[0]


@pytest.mark.parametrize("settings", [TRACKED, CONTACT])
def test_windows_are_those_of_plain_numpy(settings):
    records = random_records(0, ROWS, SAMPLES)
    got = features(records, "windows", settings).reshape(ROWS, 8, 3, 3)
    for row in range(ROWS):
        values, _ = numpy_signals(records, row, settings.reference)
        window = np.arange(len(values)) * 3 // len(values)
        for w in range(3):
            part = values[window == w]
            want = np.stack([part.mean(0), part.std(0), np.sqrt((part**2).mean(0))], axis=-1)
            np.testing.assert_allclose(got[row, :, w], want, rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("settings", [TRACKED, CONTACT])
def test_moments_are_those_of_plain_numpy(settings):
    records = random_records(1, ROWS, SAMPLES)
    got = features(records, "moments", settings).reshape(ROWS, 6, 2)
    for row in range(ROWS):
        values, moved = numpy_signals(records, row, settings.reference)
        all_six = np.concatenate([values[:, :3], moved], axis=1)
        want = np.stack([all_six.mean(0), all_six.var(0)], axis=-1)
        np.testing.assert_allclose(got[row], want, rtol=2e-4, atol=2e-5)


def test_onset_bins_at_100_hz_are_samples_then_means_of_samples():
    records = random_records(2, ROWS, SAMPLES)
    columns = feature_names("onset", TRACKED)
    got = features(records, "onset", TRACKED)
    assert columns[:72] == feature_names("windows", TRACKED)
    np.testing.assert_array_equal(got[:, :72], features(records, "windows", TRACKED))
    for row in range(ROWS):
        values, _ = numpy_signals(records, row, "tracked")
        for begin, end in itertools.pairwise(ONSET_EDGES):
            samples = values[round(begin * 100) : round(end * 100)]
            want = samples.mean(axis=0) if len(samples) else np.zeros(8)
            names = [f"onset/{s}/{begin * 1e3:.0f}ms" for s in ("f_x", "m", "u_y", "u_py")]
            have = [got[row, columns.index(name)] for name in names]
            np.testing.assert_allclose(have, want[[0, 2, 4, 7]], rtol=1e-3, atol=1e-4)


def test_effective_mass_is_the_mass_of_a_free_body():
    """Constant force f on a mass M from rest: impulse over speed is M at every horizon."""
    records = random_records(3, 1, 50)
    time = records.time
    M, f = 2.0, np.array([3.0, 0.0])
    twist = np.stack([f[0] / M * time, 0 * time, 0 * time], axis=-1)
    records = records.replace(
        force=np.broadcast_to(f, (1, 50, 2)),
        twist=twist,
        tip_velocity=np.full((1, 50, 2), 0.1),
        contact_normal=np.array([[1.0, 0.0]]),
        length=np.array([50]),
    )
    columns = feature_names("onset", TRACKED)
    got = features(records, "onset", TRACKED)[0]
    for horizon in HORIZONS[:4]:  # of single samples: the last is the state at the horizon
        place = columns.index(f"onset/effective_mass/{horizon * 1e3:.0f}ms")
        np.testing.assert_allclose(got[place], M, rtol=1e-4)


@pytest.mark.parametrize("name", sorted(FEATURE_SETS))
@pytest.mark.parametrize("settings", [TRACKED, CONTACT])
def test_world_axes_leave_no_trace(name, settings):
    records = random_records(4, ROWS, SAMPLES)
    moved = in_another_world(records, 2.0, np.array([0.3, -0.7]))
    np.testing.assert_allclose(
        features(moved, name, settings), features(records, name, settings), rtol=2e-3, atol=2e-4
    )


@pytest.mark.parametrize("name", sorted(FEATURE_SETS))
def test_trackers_frame_leaves_no_trace_with_contact_reference(name):
    records = random_records(5, ROWS, SAMPLES)
    moved = with_tracker_at(records, np.array([0.04, -0.07]), 1.1)
    same = features(records, name, CONTACT)
    np.testing.assert_allclose(features(moved, name, CONTACT), same, rtol=2e-3, atol=2e-4)
    tracked = features(records, name, TRACKED)
    assert np.abs(features(moved, name, TRACKED) - tracked).max() > 1e-2


@pytest.mark.parametrize("name", sorted(FEATURE_SETS))
def test_padding_leaves_no_trace(name):
    records = random_records(6, ROWS, SAMPLES)
    padding = np.arange(SAMPLES) >= records.length[:, None]
    spoiled = jax.tree.map(
        lambda x: (
            np.where(padding.reshape(ROWS, SAMPLES, *[1] * (x.ndim - 2)), np.nan, x)
            if x.ndim > 1 and x.shape[1] == SAMPLES
            else x
        ),
        records,
    )
    longer = jax.tree.map(
        lambda x: (
            np.concatenate([x, x[:, -1:].repeat(15, 1)], axis=1)
            if x.ndim > 1 and x.shape[1] == SAMPLES
            else x
        ),
        records,
    )
    want = features(records, name)
    np.testing.assert_allclose(features(spoiled, name), want, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(features(longer, name), want, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("name", sorted(FEATURE_SETS))
def test_unusable_records_are_zero_and_say_so(name):
    records = random_records(7, ROWS, SAMPLES)
    length = np.array([0, 1, 2, *[SAMPLES] * 5], np.int32)
    status = np.array([0, 0, 0, PushStatus.DIVERGED, 0, 0, 0, 0], np.int32)
    force = records.force.copy()
    force[3] = np.nan
    force[4] = 0  # no contact at all: the whole record counts
    records = records.replace(length=length, status=status, force=force)
    rows = examples(on_device(records), name)
    assert np.isfinite(rows.features).all()
    assert not np.asarray(rows.features[:4]).any()
    lost = PushStatus.LOST_CONTACT
    assert rows.status.tolist() == [lost, lost, lost, PushStatus.DIVERGED, 0, 0, 0, 0]
    assert rows.truth is None


def test_bins_are_seconds_at_any_rate():
    """The same motion at 100 and 250 Hz: smooth signals give the same bins."""

    def recorded(interval_s):
        steps = 180  # beyond the bins at either rate
        time = (np.arange(steps) + 1) * interval_s
        middle = time - interval_s / 2
        records = random_records(8, 1, steps, interval_s)
        force = np.stack([4 + np.sin(5 * middle), np.cos(4 * middle)], axis=-1)
        twist = np.stack([0.03 + 0.01 * np.sin(6 * middle)] * 3, axis=-1)
        return records.replace(
            force=force[None],
            moment=0.1 * np.cos(3 * middle)[None],
            twist=twist[None],
            pose=np.cumsum(twist, axis=0)[None] * interval_s,
            tip_velocity=np.full((1, steps, 2), 0.04),
            contact_point=np.array([[0.02, 0.01]]),
            contact_normal=np.array([[1.0, 0.0]]),
            length=np.array([round(0.7 / interval_s)]),
        )

    slow, fast = (features(recorded(interval), "onset")[0] for interval in (0.01, 0.004))
    bins = slice(72, 72 + 8 * (len(ONSET_EDGES) - 1))
    np.testing.assert_allclose(slow[bins], fast[bins], atol=0.02)


def test_columns_are_named_once_and_as_many_as_features():
    records = on_device(random_records(9, ROWS, SAMPLES))
    for name in FEATURE_SETS:
        for settings in (TRACKED, CONTACT):
            columns = feature_names(name, settings)
            assert len(set(columns)) == len(columns)
            assert examples(records, name, settings).features.shape == (ROWS, len(columns))
        assert feature_names(name, TRACKED) != feature_names(name, CONTACT)
    assert [len(feature_names(name)) for name in ("windows", "moments")] == [72, 12]


def test_compiles_once_for_a_shape_and_a_set():
    _rows_of_length.clear_cache()
    for seed in range(3):
        examples(on_device(random_records(seed, 5, 20)), "moments")
    assert _rows_of_length._cache_size() == 1
    examples(on_device(random_records(0, 6, 20)), "moments")
    assert _rows_of_length._cache_size() == 2


def test_records_of_many_lengths_share_a_program_and_padding_changes_nothing():
    records = random_records(3, 5, 60)
    longer = jax.tree.map(
        lambda x: (
            np.concatenate([x, np.repeat(x[:, -1:], 25, 1)], 1) if x.shape[1:2] == (60,) else x
        ),
        records,
    )
    _rows_of_length.clear_cache()
    want, got = features(records, "onset"), features(longer, "onset")
    assert _rows_of_length._cache_size() == 1
    np.testing.assert_array_equal(got, want)


def test_no_record_gives_no_row():
    none = jax.tree.map(lambda leaf: leaf[:0], on_device(random_records(0, 5, 20)))
    assert examples(none, "moments").features.shape == (0, 12)


def test_examples_carry_truth_and_are_taken_joined_and_selected():
    records = on_device(random_records(10, 7, 20))
    number = jnp.arange(7.0)
    truth = PushTruth(mass=1 + number, inertia=number, com=jnp.stack([number, -number], axis=1))
    conditions = PushConditions(jnp.arange(7), *[number] * 5)
    rows = examples(PushBatch(records, truth, conditions), "moments")
    some = take_examples(rows, jnp.array([4, 1]))
    assert some.truth.mass.tolist() == [5, 2]
    masked = take_examples(rows, np.asarray(number) > 3)
    assert masked.truth.mass.tolist() == [5, 6, 7]
    both = concatenate([some, masked])
    np.testing.assert_array_equal(both.features[2:], masked.features)
    assert both.truth.com.shape == (5, 2)
    assert concatenate([some, masked.replace(truth=None)]).truth is None
    np.testing.assert_array_equal(
        select_columns(rows, rows.columns[3:1:-1]), np.asarray(rows.features)[:, [3, 2]]
    )


def test_misuse_is_refused():
    records = on_device(random_records(11, 2, 20))
    with pytest.raises(ValueError, match="'unknown' is not one of"):
        examples(records, "unknown")
    with pytest.raises(ValueError, match="reference='com'"):
        FeatureSettings("com")
    rows = examples(records, "moments")
    with pytest.raises(ValueError, match="other columns"):
        concatenate([rows, examples(records, "windows")])
    with pytest.raises(ValueError, match="is empty"):
        concatenate([])
    with pytest.raises(ValueError, match="lack 1 of 1 columns asked for: nothing"):
        select_columns(rows, ("nothing",))
