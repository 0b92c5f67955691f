"""Recordings of a laboratory: all formats give the same push, every mistake is named."""

import h5py
import numpy as np
import pytest
from recordings import DESCRIPTION, FORCE_YAW, box, streams, write_csv

import mjx_inertia as mi
from mjx_inertia.dataset.pushed_object import pushed_object
from mjx_inertia.dataset.recording import RecordingDescription, read_description
from mjx_inertia.dataset.recording_file import RecordingError
from mjx_inertia.pushing import PushStatus


@pytest.fixture(scope="module")
def signals():
    return streams(box(), (-0.075, 0.02))


@pytest.fixture
def recording(tmp_path, signals):
    write_csv(tmp_path / "push.csv", *signals)
    (tmp_path / "push.yaml").write_text(DESCRIPTION)
    return tmp_path / "push.csv"


def columns(signals):
    """SI columns in world axes, each stream with its own stamps."""
    (t_force, f), (t_pose, p), (t_tip, q) = signals
    return {
        "force_time": t_force, "force_x": f[:, 0], "force_y": f[:, 1],
        "object_time": t_pose, "object_x": p[:, 0], "object_y": p[:, 1], "object_yaw": p[:, 2],
        "tip_time": t_tip, "tip_x": q[:, 0], "tip_y": q[:, 1],
    }  # fmt: skip


def write(folder, table):
    np.savez(folder / "push.npz", **table)
    return folder / "push.npz"


BOX = "box:0.15x0.10"


# --- formats


def test_units_frame_sign_and_unsynchronised_rows_come_back(recording, signals):
    push = mi.read_push(recording)
    p = signals[1][1]
    record = push.record
    assert int(record.status) == PushStatus.OK
    assert push.probe_mass == 0.25
    moved = np.asarray(record.pose)[-1] - np.asarray(record.pose)[0]
    assert moved == pytest.approx(p[-1] - p[0], abs=5e-3)  # it ends before the tip rests
    # the force stays near the box's x axis, which turns in the world
    yaw = float(np.asarray(record.pose)[-20:, 2].mean())
    force = np.asarray(record.force)[-20:].mean(0)
    assert np.degrees(np.arctan2(force[1], force[0])) == pytest.approx(np.degrees(yaw), abs=8.0)
    assert np.hypot(*force) == pytest.approx(0.3 * 1.8 * 9.81, rel=0.1)


def test_npz_hdf5_and_parquet_give_the_same_push(tmp_path, signals):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet  # noqa: PLC0415

    table = columns(signals)
    first = mi.read_push(write(tmp_path, table), BOX)
    with h5py.File(tmp_path / "push.h5", "w") as file:
        for name, values in table.items():
            group, _, leaf = name.partition("_")
            file[f"{group}/{leaf}"] = values
        file["object/x"].attrs["units"] = "mm"
        file["object/x"][...] = 1e3 * table["object_x"]
    longest = max(map(len, table.values()))
    padded = {k: np.pad(v, (0, longest - len(v)), constant_values=np.nan) for k, v in table.items()}
    parquet.write_table(pyarrow.table(padded), tmp_path / "push.parquet")
    for other in ("push.h5", "push.parquet"):
        second = mi.read_push(tmp_path / other, BOX)
        np.testing.assert_allclose(second.record.force, first.record.force, atol=1e-6)
        np.testing.assert_allclose(second.record.pose, first.record.pose, atol=1e-6)


def test_own_names_and_units_from_the_description(tmp_path, signals):
    table = columns(signals)
    table["Fx"] = 1e3 * table.pop("force_x")
    file = write(tmp_path, table)
    push = mi.read_push(file, BOX, columns={"force_x": "Fx"}, units={"force_x": "mN"})
    again = mi.read_push(write(tmp_path, columns(signals)), BOX)
    np.testing.assert_allclose(push.record.force, again.record.force, atol=1e-9)


def test_a_table_with_semicolons_and_decimal_commas(tmp_path, recording):
    text = recording.read_text().replace(",", ";").replace(".", ",")
    (tmp_path / "german.csv").write_text(text)
    (tmp_path / "german.yaml").write_text(DESCRIPTION)
    first, second = mi.read_push(recording), mi.read_push(tmp_path / "german.csv")
    np.testing.assert_array_equal(first.record.force, second.record.force)


def test_the_tracked_frame_may_differ_from_the_outlines(tmp_path, signals):
    table = columns(signals)
    first = mi.read_push(write(tmp_path, table), BOX)
    # a tracker whose frame is turned by 90 degrees and lies 20 mm behind the middle
    yaw = table["object_yaw"]
    table["object_x"] = table["object_x"] - 0.02 * np.cos(yaw)
    table["object_y"] = table["object_y"] - 0.02 * np.sin(yaw)
    table["object_yaw"] = yaw - np.pi / 2
    second = mi.read_push(write(tmp_path, table), BOX, object_offset=(0.0, 0.02), object_yaw=90.0)
    np.testing.assert_allclose(second.record.pose, first.record.pose, atol=1e-5)


# --- mistakes


def mistake(table, change):
    table = {name: values.copy() for name, values in table.items()}
    change(table)
    return table


def scaled(*names, by):
    def change(table):
        for name in names:
            table[name] *= by

    return change


def swapped(a, b):
    def change(table):
        table[a], table[b] = table[b], table[a]

    return change


def without(name):
    return lambda table: table.pop(name)


def turned_force(table):
    c, s = np.cos(np.pi / 2), np.sin(np.pi / 2)
    x, y = table["force_x"], table["force_y"]
    table["force_x"], table["force_y"] = c * x - s * y, s * x + c * y


def gap(table):
    keep = (table["object_time"] < 0.35) | (table["object_time"] > 0.55)
    for name in ("object_time", "object_x", "object_y", "object_yaw"):
        table[name] = table[name][keep]


def jump(table):
    table["force_time"][60:] += 1000.0


def late(table):
    table["force_time"] += 0.3


def repeated(table):
    table["tip_time"] = np.repeat(table["tip_time"][::2], 2)[: len(table["tip_time"])]


def other_clock(table):
    table["tip_time"] += 1.7e9


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (scaled("force_x", "force_y", by=-1.0), "force_on: tip"),
        (scaled("object_x", "object_y", "tip_x", "tip_y", by=1e3), "millimetres|[mm]"),
        (scaled("tip_x", "tip_y", by=1e3), "[mm]"),
        (lambda table: table.update(object_yaw=np.degrees(table["object_yaw"])), "[deg]"),
        (scaled("object_yaw", by=-1.0), "clockwise"),
        (swapped("tip_x", "tip_y"), "tip_x and tip_y are exchanged"),
        (swapped("object_x", "object_y"), "object_x and object_y are exchanged"),
        (turned_force, "force_yaw: -90"),
        (scaled("force_x", "force_y", by=1e3), "[mN]"),
        (scaled("force_x", "force_y", by=1e-3), "no push is in it, or its unit is not N"),
        (gap, "object has no sample for 0.2"),
        (jump, "force: the clock jumps by 1000 s"),
        (late, "before any force acts"),
        (repeated, "time stamps repeat"),
        (other_clock, "do not overlap"),
        (without("object_yaw"), "no column object_yaw"),
        (without("tip_time"), "no column tip_time"),
    ],
)
def test_each_mistake_has_a_sentence_with_the_remedy(tmp_path, signals, change, words):
    file = write(tmp_path, mistake(columns(signals), change))
    with pytest.raises(RecordingError) as caught:
        mi.read_push(file, BOX)
    assert str(file) in str(caught.value)
    assert any(word in str(caught.value) for word in words.split("|"))


def test_an_object_that_did_not_move_has_a_status(tmp_path, signals):
    table = columns(signals)
    for name in ("object_x", "object_y", "object_yaw", "tip_x", "tip_y"):
        table[name] = table[name][0] + 0.01 * (table[name] - table[name][0])
    push = mi.read_push(write(tmp_path, table), BOX)
    assert int(push.record.status) == PushStatus.NEVER_MOVED


def test_the_wrong_outline_is_noticed(tmp_path, signals):
    with pytest.raises(RecordingError, match="away from the outline"):
        mi.read_push(write(tmp_path, columns(signals)), "box:0.25x0.10")


# --- files that are none


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.csv", b"", "a header and rows"),
        ("a.csv", b"time,force_x\n1,2\n1\n", "expected 2 cells"),
        ("a.csv", b"time,force_x\n1,abc\n", "is no number"),
        ("a.csv", b"time,force_x [lbf]\n1,2\n", "unit [lbf] is unknown"),
        ("a.npz", b"PK\x03\x04broken", "readable .npz"),
        ("a.h5", b"\x89HDF\r\n\x1a\nbroken", "readable HDF5"),
        ("a.parquet", b"PAR1broken", "readable Parquet"),
        ("a.mat", b"x", "expected one of .csv"),
    ],
)
def test_a_file_that_is_none_is_an_error(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        mi.read_push(tmp_path / name, BOX)
    assert words in str(caught.value)


def test_data_in_another_file_are_not_followed(tmp_path):
    (tmp_path / "secret.bin").write_bytes(np.arange(4.0).tobytes())
    with h5py.File(tmp_path / "a.h5", "w") as file:
        outside = [(str(tmp_path / "secret.bin"), 0, 32)]
        file.create_dataset("force_x", (4,), dtype="f8", external=outside)
    with pytest.raises(RecordingError, match="stored in another file"):
        mi.read_push(tmp_path / "a.h5", BOX)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("force_on: robot", "force_on: expected `object` or `tip`"),
        ("probe_mass: -1", "probe_mass"),
        ("tip_radius: 0", "tip_radius"),
        ("tip_radius: yes", "tip_radius"),
        ("colour: red", "unknown key 'colour'"),
        ("a: &a [1]\ncolumns: *a", "aliases"),
        ("[1, 2]", "a mapping"),
        ("com: [1, x]", "com"),
        ("a: [", "expected YAML"),
    ],
)
def test_a_wrong_description_is_an_error(tmp_path, text, words):
    (tmp_path / "recording.yaml").write_text(text)
    with pytest.raises(RecordingError, match=r"recording\.yaml") as caught:
        read_description(tmp_path / "recording.yaml")
    assert words in str(caught.value)


def test_a_description_of_its_own_stands_above_that_of_the_folder(recording):
    with pytest.raises(RecordingError, match="force_on"):
        mi.read_push(recording, BOX, description=RecordingDescription(force_yaw=FORCE_YAW))
    assert mi.read_push(recording, probe_mass=0.1).probe_mass == 0.1
    with pytest.raises(ValueError, match="colour: unknown option"):
        mi.read_push(recording, colour="red")


# --- objects


def test_objects_are_named_drawn_or_read(tmp_path):
    (tmp_path / "l.yaml").write_text(
        "outline: [[0, 0], [0.1, 0], [0.1, 0.04], [0.04, 0.04], [0.04, 0.1], [0, 0.1]]\n"
        "height: 0.03\ncom: [0.04, 0.04]\n"
    )
    obj, com = pushed_object(tmp_path / "l.yaml")
    assert obj.footprint.area == pytest.approx(0.0064)
    assert com == pytest.approx([0.04, 0.04])
    (tmp_path / "t.csv").write_text("x,y\n0,0\n0.1,0\n0,0.1\n")
    assert pushed_object(tmp_path / "t.csv")[0].footprint.area == pytest.approx(0.005)
    assert pushed_object("circle:0.1")[0].footprint.area == pytest.approx(np.pi * 0.0025, rel=1e-3)
    assert pushed_object("ellipse:0.2x0.1")[0].half_extents[0] == pytest.approx(0.1)
    assert pushed_object("hex")[0].name == "hex"


@pytest.mark.parametrize(
    "words", ["box:0.1", "box:-1x2", "circle:a", "no such thing", "box:1x2x3x4"]
)
def test_an_object_that_cannot_be_is_an_error(words):
    with pytest.raises(ValueError, match=r"object .*expected box:0.15x0.10"):
        pushed_object(words)
