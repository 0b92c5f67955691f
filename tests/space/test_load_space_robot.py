"""Space robots from MJCF files: what is read, and what is refused."""

import mujoco
import numpy as np
import pytest
from foreign_robot import FOREIGN, HANDS, foreign_robot

from mjx_inertia.robots import BASE, baxter, load_robot, robot_spec
from mjx_inertia.robots.mjcf import robot_mjcf
from mjx_inertia.space import planar_robot, servicer, with_arms
from mjx_inertia.space.mjcf import capture_spec
from mjx_inertia.space.planar_model import planar_capture
from mjx_inertia.spatial import InertialParameters, Pose


def same_tree(a, b, atol):
    """The figures that dynamics read."""
    for field in ("parents", "hands", "prismatic", "planar", "joint_names"):
        assert getattr(a, field) == getattr(b, field), field
    for field in ("base", "links"):
        for part in ("mass", "com", "inertia"):
            pair = (getattr(getattr(robot, field), part) for robot in (a, b))
            np.testing.assert_allclose(*pair, rtol=0, atol=atol, err_msg=f"{field}.{part}")
    for field in ("T_parent_joint", "T_link_hand"):
        for part in ("rotation", "translation"):
            pair = (getattr(getattr(robot, field), part) for robot in (a, b))
            np.testing.assert_allclose(*pair, rtol=0, atol=atol, err_msg=f"{field}.{part}")
    for field in ("axis", "armature", "lower", "upper"):
        np.testing.assert_allclose(getattr(a, field), getattr(b, field), rtol=0, atol=atol)


@pytest.mark.parametrize("make", [planar_robot, servicer])
def test_a_robot_written_and_read_is_the_same(make, tmp_path):
    robot = make()
    robot = robot.replace(armature=np.linspace(0.1, 0.5, robot.dof))
    path = tmp_path / "robot.xml"
    path.write_text(robot_mjcf(robot))
    read = load_robot(path, ("hand_right", "hand_left"))
    same_tree(robot, read, atol=2e-5)  # MuJoCo writes six digits


def test_the_foreign_robot_branches_at_its_torso(tmp_path):
    robot = foreign_robot(tmp_path)
    names = ["yaw", "swing", "lift", "elbow", "bend", "slew", "reach", "pan", "tilt", "spin"]
    assert robot.joint_names == tuple(names)
    assert robot.parents == (BASE, 0, 1, 2, 3, 0, 5, 6, 7, 8)
    assert robot.hands == (4, 9)
    assert robot.prismatic == tuple(name == "reach" for name in names)
    assert not robot.planar
    np.testing.assert_allclose(robot.base.mass, 64.0)  # the mast is fixed to the bus
    np.testing.assert_allclose(robot.links.mass[[1, 8, 9]], [0.0, 0.0, 0.8])  # and the claw to it
    np.testing.assert_allclose(robot.lower[6], -0.3)
    assert np.isinf(robot.upper[3])


def test_the_model_holds_the_object_with_both_hands():
    robot, capture = planar_robot(), planar_capture()
    model = capture_spec(robot, capture).compile()
    assert model.nv == 9
    mass = float(robot.base.mass) + robot.links.mass.sum() + float(capture.inertial.mass)
    np.testing.assert_allclose(model.body_subtreemass[0], mass, rtol=1e-12)
    assert model.neq == 1
    assert not model.opt.gravity.any()
    sensors = {model.sensor(k).name for k in range(model.nsensor)}
    assert sensors == {
        f"{kind}_{side}" for kind in ("force", "torque") for side in ("right", "left")
    }


PLANAR_ROOT = """
    <body name="raft"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1"/>
      <geom size="0.2" mass="5"/>
      <body name="a" pos="0.3 0 0"><joint name="ja" axis="0 0 -1"/><geom size="0.1" mass="1"/>
      </body>
      <body name="b" pos="-0.3 0 0"><joint name="jb" axis="{axis}"/><geom size="0.1" mass="1"/>
      </body>
    </body>"""


def load_text(tmp_path, text, hands=("a", "b"), planar=False):
    path = tmp_path / "robot.xml"
    path.write_text(
        text if "<mujoco" in text else f"<mujoco><worldbody>{text}</worldbody></mujoco>"
    )
    return load_robot(path, hands, planar=planar)


def test_slides_and_a_hinge_make_a_planar_base(tmp_path):
    robot = load_text(tmp_path, PLANAR_ROOT.format(axis="0 0 1"))
    assert robot.planar
    assert robot.joint_names == ("ja", "jb")
    np.testing.assert_allclose(robot.base.mass, 5.0)
    free = PLANAR_ROOT.format(axis="0 0 1").replace(
        '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>', "<freejoint/>"
    )
    free = free.replace('<joint type="hinge" axis="0 0 1"/>', "")
    assert not load_text(tmp_path, free).planar
    assert load_text(tmp_path, free, planar=True).planar


def test_a_planar_base_floats_with_one_hand_as_with_two(tmp_path):
    one = load_text(tmp_path, PLANAR_ROOT.format(axis="0 0 1"), "b")
    two = load_text(tmp_path, PLANAR_ROOT.format(axis="0 0 1"))
    assert one.planar and one.joint_names == two.joint_names
    np.testing.assert_array_equal(one.base.mass, two.base.mass)
    fixed = load_robot(tmp_path / "robot.xml", "b", base="world")
    assert fixed.base is None and fixed.dof == 4 and fixed.gravity[2] < -9.0


SPARE = '<body name="debris"><freejoint/><geom size="0.1"/></body>'
CHAIN = '<equality><joint joint1="swing" joint2="lift"/></equality></mujoco>'
BALL = 'name="elbow" type="ball"'
REFUSED = {
    "no base": (FOREIGN.replace('<freejoint name="afloat"/>', ""), HANDS, "no body floats"),
    "two bases": (
        FOREIGN.replace("</worldbody>", SPARE + "</worldbody>"),
        HANDS,
        r"several bodies float freely \(bus, debris\)",
    ),
    "ball": (FOREIGN.replace('name="elbow" axis="0 1 1"', BALL), HANDS, "'elbow' is ball"),
    "coupled": (FOREIGN.replace("</mujoco>", CHAIN), HANDS, "'swing' is coupled"),
    "misspelt hand": (FOREIGN, ("grip", "clow"), "`end_effector` 'clow'.*did you mean claw"),
    "hand on the base": (FOREIGN, ("grip", "mast"), "no joint moves 'mast'"),
    "hand on the ground": (FOREIGN, ("stand", "claw"), "no joint moves 'stand'"),
    "out of the plane": (PLANAR_ROOT.format(axis="1 0 0"), ("a", "b"), "'jb' moves its link out"),
    "not a model": ("<mujoco><worldbody><body/></mujoco>", HANDS, "not an XML file"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_space_robot_is_refused_by_name(name, tmp_path):
    text, hands, message = REFUSED[name]
    with pytest.raises(ValueError, match=message) as error:
        load_text(tmp_path, text, hands)
    assert "robot.xml" in str(error.value)


def test_hands_are_two(tmp_path):
    file = tmp_path / "robot.xml"
    file.write_text(FOREIGN)
    with pytest.raises(ValueError, match="name each hand once"):
        load_robot(file, ("grip", "grip"))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nowhere\.xml"):
        load_robot(tmp_path / "nowhere.xml", HANDS)


def test_arms_stand_on_the_base_where_they_are_mounted():
    body = InertialParameters(np.asarray(80.0), np.zeros(3), 5.0 * np.eye(3))
    payload = InertialParameters(np.asarray(2.0), np.array([0.0, 0.0, 0.1]), 0.01 * np.eye(3))
    arms = baxter("right", "bare"), baxter("left", "bare").replace(payload=payload)
    mounts = Pose(np.eye(3), np.array([0.0, 0.0, 0.3])), Pose.identity()
    robot = with_arms(body, (0.5, 0.5, 0.5), arms, mounts, "pair")
    assert robot.joint_names[0].startswith("right_")
    assert robot.parents == (BASE, *range(6), BASE, *range(7, 13))
    model = robot_spec(robot).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    wanted = mounts[0] @ arms[0].T_world_base
    wanted = wanted @ Pose(
        arms[0].T_parent_joint.rotation[0], arms[0].T_parent_joint.translation[0]
    )
    np.testing.assert_allclose(data.body(2).xpos, wanted.translation, atol=1e-12)
    np.testing.assert_allclose(
        robot.links.mass[13] - arms[1].links.mass[6], payload.mass, atol=1e-12
    )
