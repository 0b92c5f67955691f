"""Slow pushes from files that the tests write, and what is said about files that are none."""

import numpy as np
import pytest
from dataset.mcube_files import OBJECTS

from mjx_inertia.dataset.mcube_file import McubeFileError
from parts.quasistatic_files import load_block, load_quasistatic

RNG = np.random.default_rng(0)
OUTLINE = np.array([[0.0, 0.0], [0.15, 0.0], [0.0, 0.15]])


def test_scales_are_taken_back(tmp_path):
    rho = np.hypot(0.05, 0.04)  # of a tile of 100 mm by 80 mm
    rows = RNG.normal(size=(30, 6)).astype(np.float32)
    frozen = rows.copy()
    frozen[:, :2] = rows[0, :2]
    path = tmp_path / "slow.npz"
    np.savez(path, **{"wrench_twist/felt/tile/20": rows, "wrench_twist/felt/tile/50": frozen})
    slow, fast = load_quasistatic(path, OBJECTS)
    assert (slow.surface, slow.shape, slow.speed) == ("felt", "tile", 0.02)
    np.testing.assert_allclose(slow.load, rows[:, :3] * [1, 1, rho], rtol=1e-6)
    np.testing.assert_allclose(slow.twist, rows[:, 3:] / [1, 1, rho], rtol=1e-6)
    assert slow.live
    assert not fast.live


def block(pushes=2, samples=60):
    """The tip at (0, 60) mm of the block's side x = 0 presses along x with 4 N."""
    along = np.array([np.cos(0.15), 0.0, 0.0, np.sin(0.15)])  # yaw 0.3
    pose = np.concatenate([[100.0, 200.0, 0.0], along])
    after = pose + np.array([10.0 * np.cos(0.3), 10.0 * np.sin(0.3), 0, 0, 0, 0, 0])
    time = np.linspace(0.0, 1.0, samples)
    cos, sin = np.cos(0.3), np.sin(0.3)
    middle = pose[:2] + 5.0 * np.array([cos, sin])
    tip = middle + np.array([[cos, -sin], [sin, cos]]) @ [-4.75, 60.0]
    tool = np.array([[1, 1], [1, -1]]) / np.sqrt(2)
    reading = -tool.T @ (4.0 * np.array([cos, sin]))  # of a robot at yaw 0
    force = np.outer(time > 0.2, reading) + np.array([0.3, -0.2])  # an offset of the sensor
    robot = np.column_stack([time, np.tile([*tip, 0.0, 1.0, 0.0, 0.0, 0.0], (samples, 1))])
    return {
        "pre_pose": np.tile(pose, (pushes, 1)),
        "post_pose": np.tile(after, (pushes, 1)),
        "ft": np.tile(np.column_stack([time, force]), (pushes, 1)),
        "robot": np.tile(robot, (pushes, 1)),
        "ft_split": samples * np.arange(1, pushes + 1),
        "robot_split": samples * np.arange(1, pushes + 1),
    }


def test_block_gives_load_and_displacement_in_its_axes(tmp_path):
    path = tmp_path / "points.npz"
    np.savez(path, **block())
    pushes = load_block(path, OUTLINE)
    assert pushes.surface == "points"
    np.testing.assert_allclose(pushes.load, np.tile([4.0, 0.0, -0.24], (2, 1)), atol=1e-9)
    np.testing.assert_allclose(pushes.twist, np.tile([0.01, 0.0, 0.0], (2, 1)), atol=1e-9)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda t: t.pop("ft"), "ft: expected finite numbers"),
        (lambda t: t.update(ft=t["ft"][:, :2]), r"ft: .*\(N, 3\), found float64 of shape"),
        (lambda t: t["pre_pose"].__setitem__((0, 0), np.nan), "pre_pose: .*NaN"),
        (lambda t: t.update(ft_split=t["ft_split"][::-1]), "ft_split: expected counts that grow"),
        (lambda t: t.pop("robot_split"), "robot_split: expected counts"),
        (lambda t: t.update(post_pose=t["post_pose"][:1]), "tables: expected as many poses"),
    ],
)
def test_broken_block(tmp_path, spoil, message):
    tables = block()
    spoil(tables)
    path = tmp_path / "points.npz"
    np.savez(path, **tables)
    with pytest.raises(McubeFileError, match=message) as error:
        load_block(path, OUTLINE)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("key", "rows", "message"),
    [
        ("wrench_twist/felt/moon/20", np.zeros((5, 6)), "an object of"),
        ("wrench_twist/felt/tile/20", np.zeros((5, 5)), r"\(N, 6\)"),
        ("wrench_twist/felt/tile/slow", np.zeros((5, 6)), "v in mm/s"),
        ("pushes/felt/tile/20", np.zeros((5, 10)), "keys: expected wrench_twist"),
    ],
)
def test_broken_quasistatic_file(tmp_path, key, rows, message):
    path = tmp_path / "slow.npz"
    np.savez(path, **{key: rows})
    with pytest.raises(McubeFileError, match=message):
        load_quasistatic(path, OBJECTS)


def test_files_that_are_none(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_quasistatic(tmp_path / "none.npz", OBJECTS)
    path = tmp_path / "text.npz"
    path.write_text("no archive")
    with pytest.raises(McubeFileError, match="readable"):
        load_quasistatic(path, OBJECTS)
