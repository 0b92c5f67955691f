"""Grasps at the command line: a ranked table, a picture, and one line for what is wrong."""

import jax
import jax.numpy as jnp
import matplotlib.image
import numpy as np
import pytest
import trimesh
from matplotlib.cm import ScalarMappable
from wrench_hull import wrench_hull

from mjx_inertia.grasping import (
    BAXTER_GRIPPER,
    CRITERIA,
    EPSILON,
    TASKS,
    GraspStatus,
    SamplerSettings,
    SoftFinger,
    evaluate_grasps,
    greatest_gripping_force,
    hands_of,
    object_path,
    rank_grasps,
    sample_grasps,
)
from mjx_inertia.grasping.__main__ import main
from mjx_inertia.grasping.holding import ObjectMotion, gripping_force, object_motion
from mjx_inertia.grasping.picture import hand_boxes, painted
from mjx_inertia.grasping.ranking import ranking_table
from mjx_inertia.objects import load_catalogue
from mjx_inertia.robots import baxter
from mjx_inertia.spatial import Pose

pytestmark = pytest.mark.long

PLACE = np.array([0.6, 0.3, -0.1])


@pytest.fixture(scope="module", autouse=True)
def stay_at_one_precision():
    """`main` sets double precision for its process."""
    with jax.enable_x64(True):
        yield
    jax.config.update("jax_enable_x64", False)


@pytest.fixture(scope="module")
def mug():
    return load_catalogue(["mug"])["mug"]


@pytest.fixture(scope="module")
def grasps(mug):
    """As many as the command and the notebook take, so that one compiled program serves all."""
    above = SamplerSettings(above_table=True)
    return sample_grasps(mug, BAXTER_GRIPPER, 200, seed=0, friction=0.8, settings=above).grasps


def path_of(obj, task="translate_x"):
    return object_path(TASKS[task], Pose(np.eye(3), PLACE), obj.inertial.com)


def body_of(obj):
    return jax.tree.map(lambda x: jnp.asarray(x, float), obj.inertial)


@pytest.fixture(scope="module")
def ranking(mug, grasps):
    return rank_grasps(
        baxter("left"), mug.inertial, grasps, BAXTER_GRIPPER, path_of(mug), friction=0.8
    )


def test_the_order_is_by_cost_and_leaves_out_what_fails(ranking, mug, grasps):
    efforts = ranking.by("effort")[ranking.order]
    assert len(ranking.order) > 10 and np.all(np.diff(efforts) >= 0.0)
    status = np.asarray(ranking.found.status)
    assert np.all(status[ranking.order] == GraspStatus.OK)
    assert np.all(ranking.force[ranking.order] <= BAXTER_GRIPPER.force_limit)
    assert sum(ranking.failures.values()) + len(ranking.order) == len(ranking.force) == 200
    assert set(ranking.front) <= set(ranking.order)
    hands = hands_of(grasps, BAXTER_GRIPPER)
    again = evaluate_grasps(baxter("left"), mug.inertial, hands, path_of(mug))
    np.testing.assert_allclose(ranking.by("effort")[status == 0], again.usable()[status == 0, 0])
    lines = ranking_table(ranking, rows=5).splitlines()
    assert len(lines) == 6 and f"{efforts[0]:.4g}" in lines[1]


def test_the_order_by_epsilon_begins_with_the_greatest(ranking, mug, grasps):
    """What can be used, and what the metrics say, stays as it is; ε is that of Qhull's hulls."""
    arguments = baxter("left"), mug.inertial, grasps, BAXTER_GRIPPER, path_of(mug)
    by_epsilon = rank_grasps(*arguments, metric=EPSILON, friction=0.8)
    np.testing.assert_array_equal(by_epsilon.costs[:, :-1], ranking.costs)
    assert sorted(by_epsilon.order) == sorted(ranking.order)
    quality = by_epsilon.by(EPSILON)
    assert np.all(np.diff(quality[by_epsilon.order]) <= 0.0) and quality[by_epsilon.order[-1]] > 0.0
    gyration = float(np.sqrt(0.5 * np.trace(mug.inertial.inertia) / mug.inertial.mass))
    for row in by_epsilon.order[[0, -1]]:
        pair = jax.tree.map(lambda x, row=row: x[row], grasps.contacts)
        pad = SoftFinger(0.8, 0.006 * 0.8)
        hull = wrench_hull(pair, pad, np.asarray(mug.inertial.com), gyration, edges=20)
        assert 0.95 * quality[row] < hull.epsilon <= quality[row] * (1.0 + 1e-6)
    assert "epsilon [N/N]" in ranking_table(by_epsilon)
    with pytest.raises(ValueError, match="'epsilon' is not among effort"):
        ranking.by(EPSILON)


def test_the_arms_hand_is_at_the_finger_tips(grasps):
    """The pads' middle is `pad_to_tip` behind it, against the approach."""
    hands = hands_of(grasps, BAXTER_GRIPPER)
    behind = hands.apply(jnp.tile(jnp.array([0.0, 0.0, -BAXTER_GRIPPER.pad_to_tip]), (200, 1)))
    np.testing.assert_allclose(behind, grasps.contacts.points.mean(axis=1), atol=1e-6)


def test_accelerations_of_the_object_are_those_of_its_poses(mug):
    """Central differences of the position of the object's origin on a turning task."""
    path = path_of(mug, "rotate_x")
    motion = object_motion(path)
    fine = object_path(TASKS["rotate_x"], Pose(np.eye(3), PLACE), mug.inertial.com, 2001)
    rotation = np.asarray(object_motion(fine).R_world_obj)
    com = np.asarray(mug.inertial.com)
    origin = (PLACE + com) - rotation @ com
    h = float(fine.time[1])
    slopes = (origin[2:] - 2.0 * origin[1:-1] + origin[:-2]) / h**2
    accelerations = np.asarray(object_motion(fine).acceleration)[1:-1]
    np.testing.assert_allclose(accelerations, slopes, atol=1e-6)
    assert motion.acceleration.shape == (50, 3)


def test_the_gripping_force_is_that_of_the_hardest_moment(mug, grasps):
    path, pad = path_of(mug, "rotate_x"), SoftFinger(0.8, 0.005)
    contacts = jax.tree.map(lambda x: jnp.asarray(x, float)[:6], grasps.contacts)
    gravity = jnp.array([0.0, 0.0, -9.81])
    found = greatest_gripping_force(contacts, pad, body_of(mug), path, gravity)
    motion: ObjectMotion = object_motion(path)

    def force(contact, moment):
        return gripping_force(contact, pad, body_of(mug), moment, gravity)

    each = jax.jit(jax.vmap(jax.vmap(force, (None, 0)), (0, None)))(contacts, motion)
    np.testing.assert_allclose(found, np.asarray(each).max(axis=1), rtol=1e-9)


def test_paint_is_near_what_was_touched(mug, grasps):
    points = np.asarray(grasps.contacts.points)[:1]
    surface, paint = painted(mug.mesh, points, np.array([1.0]), ScalarMappable())
    colored = np.ptp(paint, axis=1) > 0.05
    distance = np.linalg.norm(surface.triangles_center[:, None] - points[0], axis=2).min(axis=1)
    assert colored.any()
    np.testing.assert_array_equal(colored, distance <= 0.08 * mug.mesh.scale)
    assert surface.volume == pytest.approx(mug.mesh.volume, rel=1e-9)


def test_the_drawn_fingers_touch_the_contacts(grasps):
    """The pads' inner faces: contacts lie on them."""
    for row in range(3):
        fingers = hand_boxes(grasps, BAXTER_GRIPPER, row)[:2]
        for finger, point in zip(fingers, np.asarray(grasps.contacts.points)[row], strict=True):
            distance = trimesh.proximity.signed_distance(finger, point[None])
            assert abs(float(distance[0])) < 1e-6


def test_the_command_prints_a_table_and_writes_a_picture(tmp_path, capsys):
    file = tmp_path / "grasps.png"
    arguments = ["--object", "mug", "--friction", "0.8", "--metric", "effective_mass"]
    assert main([*arguments, "--count", "200", "--out", str(file)]) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert lines[1].startswith("rank  effort") and lines[2].startswith("  1")
    column = lines[1].index("[kg]")
    masses = [float(line[: column + 4].split()[-1]) for line in lines[2:12]]
    assert masses == sorted(masses)
    assert "UNREACHED" in lines[12] and "Pareto front" in lines[12]
    picture = matplotlib.image.imread(file)
    assert picture.shape[1] > 1000 and np.ptp(picture[..., :3]) > 0.9
    assert len(CRITERIA) == 7


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--arm", "baxte"], "unknown arm 'baxte'; did you mean 'baxter'"),
        (["--object", "mugg"], "unknown object 'mugg'; did you mean 'mug'"),
        (["--task", "translate_q"], "unknown task 'translate_q'; did you mean"),
        (["--metric", "efort"], "unknown metric 'efort'; did you mean 'effort'"),
        (["--gripper", "hand"], "unknown gripper 'hand'"),
        (["--out", "{0}/none/grasps.png"], "cannot be written"),
        (["--out", "{0}/grasps.tif"], "ends in .png"),
        (["--object", "{0}/none.stl"], "no such file"),
        (["--arm", "{0}/none.urdf"], "needs --end-effector"),
        (["--arm", "{0}/none.urdf", "--end-effector", "tool"], "no such file"),
        (["--object", "cube"], "no grasp for Baxter's electric gripper"),
        (["--count", "0"], "must be positive"),
        (["--place", "3", "0", "0"], "none of 200 grasps of mug can be used: 200 UNREACHED"),
    ],
)
def test_what_is_wrong_takes_one_line(tmp_path, capsys, arguments, said):
    given = [argument.format(tmp_path) for argument in arguments]
    usual = {"--object": "mug", "--out": str(tmp_path / "a.png"), "--count": "200"}
    rest = [x for name, value in usual.items() if name not in given for x in (name, value)]
    assert main([*given, *rest]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_parser_says_in_one_line_what_it_misses(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["--arm", "baxter"])
    assert stopped.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
