"""A push with known motion, read back from files; every defect told by its status."""

import io
import math
import zipfile

import h5py
import jax
import numpy as np
import pytest
from dataset.mcube_files import (
    NAME,
    OBJECTS,
    TIP_RADIUS,
    Push,
    h5_bytes,
    turned,
    write_h5,
    write_json,
)

from mjx_inertia.dataset.mcube import LEAD_IN, load_mcube
from mjx_inertia.dataset.mcube_file import McubeFileError, parse_name
from mjx_inertia.dataset.mcube_folder import mcube_conditions, mcube_truth
from mjx_inertia.objects import cuboid
from mjx_inertia.pushing import PushStatus


@pytest.fixture
def record(tmp_path):
    return load_mcube(write_h5(tmp_path, Push().tables()), OBJECTS, 100.0, TIP_RADIUS)


def test_motion_is_the_true_one(record):
    push = Push()
    time, pose = np.asarray(record.time, float), np.asarray(record.pose, float)
    assert record.time.dtype == np.float32
    np.testing.assert_allclose(np.diff(time), 0.01, atol=1e-6)
    begins = np.argmax(np.abs(pose[:, 2] - push.start[2]) > 1e-4) * 0.01
    assert LEAD_IN - 0.02 < begins < LEAD_IN + 0.02
    assert abs(int(record.length) * 0.01 - LEAD_IN - push.moving) < 0.03
    moving = slice(15, -5)
    rate = np.diff(pose[moving], axis=0) / 0.01
    np.testing.assert_allclose(rate, np.tile(push.twist, (len(rate), 1)), atol=3e-4)
    np.testing.assert_allclose(
        record.twist[moving], np.tile(push.twist, (len(rate) + 1, 1)), atol=1e-5
    )
    assert pose[-1, 2] > math.pi  # unwrapped
    arm = np.asarray(record.tip_position, float) - pose[:, :2]
    np.testing.assert_allclose(
        arm, turned(pose[:, 2], np.array([-0.05 - TIP_RADIUS, 0.01])), atol=2e-6
    )
    spin = push.twist[2] * np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
    np.testing.assert_allclose(
        record.tip_velocity[moving], (push.twist[:2] + spin)[moving], atol=2e-5
    )


def test_force_is_minus_the_reaction_averaged_over_the_interval(record):
    push = Push()
    pose, force = np.asarray(record.pose, float), np.asarray(record.force, float)
    moving = slice(15, -5)
    # The pose tells the absolute time; the mean lies half an interval before its end.
    t = push.rest + (pose[moving, 2] - push.start[2]) / push.twist[2]
    expected = -(push.reaction + np.stack([t - 0.005, 0.0 * t], axis=-1))
    np.testing.assert_allclose(force[moving], expected, atol=2e-5)
    arm = turned(pose[:, 2], np.array([-0.05, 0.01]))  # the contact, not the tip's centre
    moment = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    np.testing.assert_allclose(record.moment, moment, atol=1e-5)


def test_contact_and_truth(record):
    push = Push()
    yaw = push.start[2]
    np.testing.assert_allclose(
        record.contact_point, push.start[:2] + turned(yaw, np.array([-0.05, 0.01])), atol=1e-6
    )
    np.testing.assert_allclose(record.contact_normal, turned(yaw, np.array([1.0, 0.0])), atol=1e-6)
    truth = mcube_truth(record, OBJECTS["tile"])
    # Looking along the inward normal (+x of the tile), the CoM lies 10 mm to the right.
    np.testing.assert_allclose(truth.com, [0.05, -0.01], atol=1e-6)
    assert float(truth.mass) == pytest.approx(0.9)
    assert float(truth.inertia) == pytest.approx(0.9 * (0.1**2 + 0.08**2) / 12)
    conditions = mcube_conditions(record, OBJECTS["tile"], parse_name(NAME), 3)
    assert float(conditions.contact_offset) == pytest.approx(0.25, abs=1e-4)  # left of the middle
    assert float(conditions.speed) == pytest.approx(0.05)
    assert int(conditions.object_id) == 3
    assert math.isnan(float(conditions.friction))
    assert int(record.status) == PushStatus.OK


def test_json_and_zip_hold_the_same_push(record, tmp_path):
    write_json(tmp_path, Push().tables())
    with zipfile.ZipFile(tmp_path / "tile_h5.zip", "w") as archive:
        archive.write(tmp_path / f"{NAME}.h5", f"inner/{NAME}.h5")
    for path in (tmp_path / f"{NAME}.json", tmp_path / "tile_h5.zip" / "inner" / f"{NAME}.h5"):
        other = load_mcube(str(path), OBJECTS, 100.0, TIP_RADIUS)
        assert jax.tree.all(jax.tree.map(lambda a, b: bool((a == b).all()), record, other))


def test_rate_and_units(tmp_path):
    path = write_h5(tmp_path, Push().tables())
    fast, slow = (load_mcube(path, OBJECTS, rate, TIP_RADIUS) for rate in (200.0, 50.0))
    assert int(fast.length) == pytest.approx(4 * int(slow.length), abs=5)
    assert len(slow.time) == int(slow.length)
    with pytest.raises(ValueError, match="rate"):
        load_mcube(path, OBJECTS, 0.0)


def _frozen(tables):
    tables["ft_wrench"][:, 1:] = tables["ft_wrench"][0, 1:]
    tables["ft_wrench"][150, 1] = -20.0  # the spike of a restarting sensor


def _quarter_turn(tables):
    tables["object_pose"][180:, 3] += 0.5 * math.pi


def _half_turn(tables):
    tables["object_pose"][180:, 3] += math.pi


def _tracker_elsewhere(tables):
    tables["object_pose"][180:, 1] += 0.3


def _still(tables):
    tables["object_pose"][:, 1:] = tables["object_pose"][0, 1:]
    tables["tip_pose"][:, 1:] = tables["tip_pose"][0, 1:]


def _leaves(tables):
    """The object slides on, faster than the tip."""
    since = np.clip(tables["object_pose"][:, 0] - Push.zero - 0.7, 0.0, 0.5)
    tables["object_pose"][:, 1] -= 0.1 * since


def _unloaded(tables):
    late = tables["ft_wrench"][:, 0] > Push.zero + 0.8
    tables["ft_wrench"][late, 1:3] *= 1e-3


def _far(tables):
    tables["object_pose"][:, 1] += 1e4


def _last_stamp_off(tables):
    tables["ft_wrench"][-1, 0] += 1000.0


def _half_of_the_stamps_equal(tables):
    stamps = tables["ft_wrench"][:, 0]
    stamps[1::2] = stamps[:-1:2] if len(stamps) % 2 else stamps[::2]


def _pulls(tables):
    tables["ft_wrench"][:, 1:] *= -1.0


def _force_comes_late(tables):
    """The force is that of 0.5 s before; the sensor is at rest until then."""
    late = tables["ft_wrench"][:, 0] < Push.zero + 0.8
    tables["ft_wrench"][late, 1:3] *= 1e-2


def _force_starts_late(tables):
    tables["ft_wrench"] = tables["ft_wrench"][125:]


@pytest.mark.parametrize(
    ("spoil", "status"),
    [
        (_last_stamp_off, PushStatus.CLOCK_JUMP),
        (_half_of_the_stamps_equal, PushStatus.CLOCK_JUMP),
        (_pulls, PushStatus.FORCE_PULLS),
        (_force_comes_late, PushStatus.FORCE_LATE),
        (_force_starts_late, PushStatus.FORCE_LATE),
        (_frozen, PushStatus.FROZEN_FORCE),
        (_quarter_turn, PushStatus.TRACKING_JUMP),
        (_half_turn, PushStatus.TRACKING_JUMP),
        (_tracker_elsewhere, PushStatus.TRACKING_JUMP),
        (_still, PushStatus.NEVER_MOVED),
        (_leaves, PushStatus.LOST_CONTACT),
        (_unloaded, PushStatus.LOST_CONTACT),
        (_far, PushStatus.DIVERGED),
    ],
)
def test_defects_are_told_by_the_status(tmp_path, spoil, status):
    tables = Push().tables()
    spoil(tables)
    record = load_mcube(write_h5(tmp_path, tables), OBJECTS, 100.0, TIP_RADIUS)
    assert PushStatus(int(record.status)) == status
    assert all(bool(np.isfinite(leaf).all()) for leaf in jax.tree.leaves(record))


def test_an_approach_before_contact_is_not_the_contact(tmp_path):
    class Late(Push):
        def tip(self, t):
            gap = 0.02 * np.clip(1.0 - t / self.rest, 0.0, 1.0)[:, None]  # closes before the push
            yaw = self.pose(t)[:, 2]
            return Push.tip(self, t) - gap * turned(yaw, np.array([1.0, 0.0]))

    record = load_mcube(write_h5(tmp_path, Late().tables()), OBJECTS, 100.0, TIP_RADIUS)
    np.testing.assert_allclose(
        record.contact_point,
        Push.start[:2] + turned(Push.start[2], np.array([-0.05, 0.01])),
        atol=1e-6,
    )


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda t: t.pop("tip_pose"), "tip_pose: expected a table of that name"),
        (
            lambda t: t.update(ft_wrench=t["ft_wrench"][:, :3]),
            r"ft_wrench: .*\(N, 4\).*found shape",
        ),
        (lambda t: t.update(ft_wrench=t["ft_wrench"][0]), r"ft_wrench: .*shape \(4,\)"),
        (lambda t: t.update(object_pose=t["object_pose"][:3]), "object_pose: expected 10 time"),
        (lambda t: t.update(object_pose=t["object_pose"][:0]), "object_pose: expected"),
        (lambda t: t["tip_pose"].__setitem__((7, 2), np.nan), "tip_pose: expected finite.*row 7"),
        (lambda t: t["tip_pose"].__setitem__((7, 0), np.inf), "tip_pose: expected finite.*row 7"),
        (lambda t: t["tip_pose"].__setitem__((slice(None), 0), 5.0), "tip_pose: expected 10 time"),
        (lambda t: t["tip_pose"].__iadd__([99.0, 0, 0, 0]), "time stamps: expected a push of 5"),
    ],
)
@pytest.mark.parametrize("write", [write_h5, write_json])
def test_broken_tables(tmp_path, spoil, message, write):
    tables = Push().tables()
    spoil(tables)
    path = write(tmp_path, tables)
    with pytest.raises(McubeFileError, match=message) as error:
        load_mcube(path, OBJECTS)
    assert str(path) in str(error.value)


def _h5(change):
    """Content of a good file with a change."""
    buffer = io.BytesIO(h5_bytes(Push().tables()))
    with h5py.File(buffer, "r+") as file:
        del file["tip_pose"]
        change(file)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda f: f.create_dataset("tip_pose", (300_000_000, 4), "f8"), r"shape \(300000000, 4\)"),
        (lambda f: f.create_dataset("tip_pose", data=["a"] * 20), "object of shape"),
        (lambda f: f.create_group("tip_pose"), "Group"),
        (lambda f: f.__setitem__("tip_pose", h5py.SoftLink("/object_pose")), "a link"),
        (lambda f: f.__setitem__("tip_pose", h5py.ExternalLink("o.h5", "/tip_pose")), "a link"),
        (
            lambda f: f.create_dataset("tip_pose", (20, 4), "f8", external=[("o.bin", 0, 640)]),
            "lies in another file",
        ),
    ],
)
def test_tables_that_are_not_in_the_file_or_too_large_are_not_read(tmp_path, change, found):
    path = tmp_path / f"{NAME}.h5"
    path.write_bytes(_h5(change))
    with pytest.raises(McubeFileError, match=f"tip_pose: expected a table of numbers.*{found}"):
        load_mcube(path, OBJECTS)


@pytest.mark.parametrize(
    "content", [b'{"tip_pose": ' + b"[" * 100_000, b"[" * 100_000], ids=["deep", "deeper"]
)
def test_deep_nesting_is_no_push(tmp_path, content):
    path = tmp_path / f"{NAME}.json"
    path.write_bytes(content)
    with pytest.raises(McubeFileError, match="file: expected JSON"):
        load_mcube(path, OBJECTS)


def test_a_number_of_400_digits_is_no_number(tmp_path):
    path = write_json(tmp_path, Push().tables())
    text = path.read_text()
    path.write_text(text.replace("[[", "[[" + "9" * 400 + ", 0, 0, 0], [", 1))
    with pytest.raises(McubeFileError, match="something else than numbers"):
        load_mcube(path, OBJECTS)


def test_rates_that_fill_the_memory_are_refused(tmp_path):
    path = write_h5(tmp_path, Push().tables())
    with pytest.raises(
        ValueError, match=r"rate=1000000\.0: expected a positive number up to 10000"
    ):
        load_mcube(path, OBJECTS, 1e6)


@pytest.mark.parametrize("ending", ["h5", "json"])
@pytest.mark.parametrize(
    "content", [b"", b"no measurement", b"[1, 2]", b"\x89HDF\r\n\x1a\n" + b"\0" * 99]
)
def test_broken_files(tmp_path, ending, content):
    path = tmp_path / f"{NAME}.{ending}"
    path.write_bytes(content)
    with pytest.raises(McubeFileError, match=r"file: expected (readable )?(HDF5|JSON|a JSON obj)"):
        load_mcube(path, OBJECTS)


def test_truncated_file(tmp_path):
    path = write_h5(tmp_path, Push().tables())
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(McubeFileError, match="HDF5"):
        load_mcube(path, OBJECTS)


def test_unknown_object_names_the_remedy(tmp_path):
    path = write_h5(tmp_path, Push().tables())
    with pytest.raises(McubeFileError, match=r"'tile'; pass `objects` with its outline"):
        load_mcube(path)
    with pytest.raises(FileNotFoundError):
        load_mcube(tmp_path / "none.h5", OBJECTS)


def test_names():
    push = parse_name(
        "a/motion_surface=abs_shape=rect_1_a=2500_v=-1_i=2.000_s=0.7_t=-1.047_rep=0012.h5"
    )
    assert (push.surface, push.shape, push.side, push.repetition) == ("abs", "rect_1", 2, 12)
    assert push.acceleration == pytest.approx(2.5)
    assert math.isnan(push.speed)
    assert push.nominal_speed == pytest.approx(0.5)
    assert parse_name(NAME + ".json").nominal_speed == pytest.approx(0.05)
    for bad in ("notes.json", NAME.replace("v=50", "v=fast"), NAME.replace("v=50", "v=-1")):
        with pytest.raises(McubeFileError, match="name"):
            parse_name(bad + ".h5")


def test_mirrored_push_mirrors_the_record(tmp_path):
    """Reflection at the x axis flips y, yaw, their rates and the moment, and nothing else."""
    tables = Push().tables()
    record = load_mcube(write_h5(tmp_path, tables), OBJECTS, 100.0, TIP_RADIUS)
    tables["object_pose"][:, 2:] *= -1
    tables["tip_pose"][:, 2:] *= -1
    tables["ft_wrench"][:, 2] *= -1
    mirrored = load_mcube(write_h5(tmp_path / "m", tables), OBJECTS, 100.0, TIP_RADIUS)
    np.testing.assert_allclose(mirrored.moment, -np.asarray(record.moment), atol=1e-6)
    np.testing.assert_allclose(mirrored.force, record.force * np.array([1, -1]), atol=1e-6)
    np.testing.assert_allclose(
        mcube_truth(mirrored, OBJECTS["tile"]).com,
        mcube_truth(record, OBJECTS["tile"]).com * np.array([1, -1]),
        atol=1e-6,
    )
    # A second object of the same name and another size is another contact.
    larger = {"tile": cuboid((0.11, 0.08, 0.013), 0.9)}
    assert int(load_mcube(tmp_path / f"{NAME}.h5", larger).status) == PushStatus.TRACKING_JUMP
