"""Paths of a grasped object: quintic, at rest between moves, turned about the CoM."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_inertia.grasping import TASKS, Move, Task, object_path
from mjx_inertia.grasping.motion import hand_path
from mjx_inertia.grasping.task_path import object_pose_at, quintic
from mjx_inertia.spatial import Pose

pytestmark = pytest.mark.float64

START = Rotation.from_euler("xyz", (0.3, -0.2, 0.5))
COM = np.array([0.02, -0.03, 0.05])
TWISTED = Task(
    "twisted",
    (
        Move(translation=(0.1, -0.2, 0.05), rotation_deg=(30.0, 10.0, -50.0), duration=2.0),
        Move(translation=(0.0, 0.0, -0.1), duration=1.0),
        Move(rotation_deg=(0.0, 0.0, 170.0), duration=1.5),
    ),
)


def start_pose():
    return Pose(START.as_matrix(), np.array([0.6, 0.1, 0.2]))


def sampled(path):
    return jax.vmap(lambda m, s: object_pose_at(path, m, s))(path.move, path.s)


def test_the_quintic_is_at_rest_at_both_ends():
    u = jnp.linspace(0.0, 1.0, 11)
    s, slope, bend = quintic(u)
    np.testing.assert_allclose(s[jnp.array([0, 5, -1])], [0.0, 0.5, 1.0], atol=1e-15)
    np.testing.assert_allclose(slope[jnp.array([0, -1])], 0.0, atol=1e-14)
    np.testing.assert_allclose(bend[jnp.array([0, -1])], 0.0, atol=1e-13)
    ours = jax.vmap(jax.grad(lambda x: quintic(x)[0]))(u)
    np.testing.assert_allclose(slope, ours, atol=1e-13)
    np.testing.assert_allclose(bend, jax.vmap(jax.grad(lambda x: quintic(x)[1]))(u), atol=1e-12)


@pytest.mark.parametrize("orientation", ["shortest", "euler"])
def test_moves_end_where_they_say(orientation):
    task = Task("t", TWISTED.moves, orientation)
    path = object_path(task, start_pose(), COM, waypoints=60)
    poses = sampled(path)
    coms = np.asarray(jax.vmap(lambda p: p.apply(COM))(poses))
    first = start_pose().apply(COM)
    np.testing.assert_allclose(coms[0], first, atol=1e-12)
    np.testing.assert_allclose(coms[-1], first + np.array([0.1, -0.2, -0.05]), atol=1e-12)
    turn = Rotation.from_rotvec(np.radians([30.0, 10.0, -50.0]))
    turn = Rotation.from_rotvec(np.radians([0.0, 0.0, 170.0])) * turn
    np.testing.assert_allclose(poses.rotation[-1], (turn * START).as_matrix(), atol=1e-12)
    identity = np.einsum("kij,kil->kjl", poses.rotation, poses.rotation)
    np.testing.assert_allclose(identity, np.tile(np.eye(3), (60, 1, 1)), atol=1e-12)


def test_a_pure_turn_leaves_the_com_where_it_is():
    path = object_path(TASKS["rotate_y"], start_pose(), COM)
    coms = jax.vmap(lambda p: p.apply(COM))(sampled(path))
    np.testing.assert_allclose(coms, np.tile(start_pose().apply(COM), (50, 1)), atol=1e-13)


@pytest.mark.parametrize("orientation", ["shortest", "euler"])
def test_twists_are_the_derivatives_of_the_poses(orientation):
    """Also at rest, where time stands still but the path has a direction."""
    path = object_path(Task("t", TWISTED.moves, orientation), start_pose(), COM)
    T_obj_hand = Pose(
        Rotation.from_euler("xyz", (0.1, 0.7, -0.4)).as_matrix(),
        np.array([0.05, 0.02, -0.1]),
    )
    h = 1e-6
    for move in range(3):
        for s in (0.0, 0.3, 1.0):
            _, xi, bend = hand_path(path, T_obj_hand, jnp.int32(move), jnp.asarray(s))
            ahead, xi_ahead, _ = hand_path(path, T_obj_hand, jnp.int32(move), jnp.asarray(s + h))
            back, xi_back, _ = hand_path(path, T_obj_hand, jnp.int32(move), jnp.asarray(s - h))
            linear = (ahead.translation - back.translation) / (2 * h)
            turn = Rotation.from_matrix(ahead.rotation @ back.rotation.T).as_rotvec() / (2 * h)
            np.testing.assert_allclose(xi, np.concatenate([linear, turn]), atol=1e-6)
            np.testing.assert_allclose(bend, (xi_ahead - xi_back) / (2 * h), atol=1e-6)
            assert float(jnp.linalg.norm(xi)) > 0.01


def test_time_and_rate():
    path = object_path(TWISTED, start_pose(), COM, waypoints=90)
    assert float(path.time[-1]) == pytest.approx(4.5)
    assert np.bincount(np.asarray(path.move)).tolist() == [40, 20, 30]
    for edge in (0, 39, 40, 59, 60, -1):
        assert float(path.rate[edge]) == pytest.approx(0.0, abs=1e-12)
    inside = np.asarray(path.move) == 0
    slope = np.gradient(np.asarray(path.s)[inside], np.asarray(path.time)[inside])
    np.testing.assert_allclose(slope[1:-1], np.asarray(path.rate)[inside][1:-1], atol=5e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Move, "neither translates nor rotates"),
        (lambda: Move(translation=(0.1, 0.0, 0.0), duration=0.0), "duration=0.0 s"),
        (lambda: Move(translation=(np.nan, 0.0, 0.0)), "not finite"),
        (lambda: Task("none", ()), "'none' has no moves"),
        (lambda: Task("t", TWISTED.moves, "quaternion"), "choose 'shortest' or 'euler'"),
        (lambda: object_path(TWISTED, start_pose(), COM, waypoints=4), "waypoints=4"),
    ],
)
def test_misuse(make, message):
    with pytest.raises(ValueError, match=message):
        make()
