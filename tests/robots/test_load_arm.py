"""Arms from files: MuJoCo's and Pinocchio's dynamics, and what is wrong with a file, by name."""

import importlib.util
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pinocchio
import pytest
from arm_dynamics import dynamics
from reference_models import (
    Dynamics,
    assert_same,
    baxter_urdf,
    by_mujoco,
    by_pinocchio,
    states,
)
from small_arms import SMALL_ARM, small_arm

from mjx_inertia.robots import (
    BASE,
    baxter,
    gravity_torque,
    hand_pose,
    load_robot,
    mass_matrix,
    robot_spec,
)
from mjx_inertia.robots.mjcf import robot_mjcf

LINK = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
GRIPPER = """
<link name="palm"><inertial><origin xyz="0 0 0.05" rpy="0.3 0 0"/><mass value="0.5"/>
  <inertia ixx="2e-3" ixy="0" ixz="1e-4" iyy="1e-3" iyz="0" izz="2e-3"/></inertial>
  <visual><geometry><mesh filename="package://nowhere/palm.dae"/></geometry></visual></link>
<joint name="to_palm" type="fixed"><parent link="flange"/><child link="palm"/>
  <origin xyz="0 0 0.02" rpy="0 0 0.5"/></joint>
<link name="finger"><inertial><mass value="0.1"/>
  <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
<joint name="close" type="prismatic"><parent link="palm"/><child link="finger"/>
  <origin xyz="0 0.03 0.1"/><axis xyz="0 1 0"/>
  <limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
<link name="other_finger"><inertial><mass value="0.1"/>
  <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
<joint name="follow" type="prismatic"><parent link="palm"/><child link="other_finger"/>
  <origin xyz="0 -0.03 0.1"/><axis xyz="0 -1 0"/><mimic joint="close"/>
  <limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.fixture(scope="module")
def panda_file():
    """A Panda with two fingers in a kitchen."""
    package = importlib.util.find_spec("gymnasium_robotics")
    assets = Path(package.submodule_search_locations[0]) / "envs" / "assets" / "kitchen_franka"
    return assets / "kitchen_assets" / "kitchen_env_model.xml"


@pytest.mark.long
def test_a_panda_is_that_of_mujoco(panda_file):
    arm, model = (
        load_robot(panda_file, "end_effector"),
        mujoco.MjModel.from_xml_path(str(panda_file)),
    )
    assert arm.joint_names == tuple(f"robot:panda0_joint{i}" for i in range(1, 8))
    assert arm.torque_limit.tolist() == [87.0] * 4 + [12.0] * 3
    assert "finger_joint1" in arm.note
    state = states(7)
    columns = [model.joint(name).dofadr[0] for name in arm.joint_names]
    few = slice(0, 100)  # the whole kitchen moves with each
    ours = Dynamics(*(x[few] for x in vars(dynamics(arm, state)[0]).values()))
    expected = by_mujoco(model, "end_effector", *(x[few] for x in state), columns)
    assert_same(ours, expected)


@pytest.mark.slow  # an arm more to compile
def test_a_urdf_with_a_gripper_is_that_of_pinocchio(tmp_path):
    text = baxter_urdf("right").replace("</robot>", GRIPPER)
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    arm, model = load_robot(path, "palm"), pinocchio.buildModelFromXML(text)
    assert arm.note.endswith("held at their reference position: close, follow.")
    state = states(7)
    columns = [model.joints[model.getJointId(name)].idx_v for name in arm.joint_names]
    assert_same(dynamics(arm, state)[0], by_pinocchio(model, "palm", *state, columns))
    given = baxter("right", "bare")
    np.testing.assert_array_equal(arm.lower, given.lower)
    np.testing.assert_array_equal(arm.velocity_limit, given.velocity_limit)
    np.testing.assert_array_equal(arm.torque_limit, given.torque_limit)


@pytest.mark.long
def test_slides_references_anchors_and_several_joints_of_a_body(tmp_path):
    arm, model = small_arm(tmp_path), mujoco.MjModel.from_xml_string(SMALL_ARM)
    assert arm.prismatic == (False, True, False, False)
    assert arm.torque_limit.tolist() == [20.0, np.inf, np.inf, np.inf]
    assert arm.lower.tolist() == [-1.0, -0.3, -np.inf, -np.inf]
    state = states(4)
    assert_same(dynamics(arm, state)[0], by_mujoco(model, "grip", *state, np.arange(4)))


def test_the_generated_text_loads_to_the_same_arm(tmp_path):
    arm = baxter().replace(armature=np.linspace(0.1, 0.2, 7))
    path = tmp_path / "baxter.xml"
    path.write_text(robot_mjcf(arm))
    again = load_robot(path, "hand")
    assert again.joint_names == arm.joint_names
    infinite = np.full(7, np.inf)  # MJCF has no limits of speed
    pairs = zip(
        jax.tree.leaves(again),
        jax.tree.leaves(arm.replace(velocity_limit=infinite)),
        strict=True,
    )
    for actual, expected in pairs:
        np.testing.assert_allclose(actual, expected, rtol=1e-5, atol=1e-6)  # six digits of text


def test_a_base_on_the_way_holds_what_is_before_it(tmp_path):
    path = tmp_path / "small.xml"
    path.write_text(SMALL_ARM)
    whole, part = load_robot(path, "grip"), load_robot(path, "grip", base="upper")
    assert part.joint_names == ("slide", "bend", "roll")
    q = np.array([0.4, 0.2, -0.5, 0.7])  # 0.4 is the reference of the joint before
    places = [jax.jit(partial(hand_pose, arm))(x) for arm, x in ((whole, q), (part, q[1:]))]
    np.testing.assert_allclose(places[0].translation, places[1].translation, atol=1e-12)
    np.testing.assert_allclose(places[0].rotation, places[1].rotation, atol=1e-12)


def urdf(kind="revolute", inertial=LINK + "</inertial>", more=""):
    return (
        f'<robot name="r"><link name="a"/><link name="b">{inertial}</link><link name="c">{LINK}'
        f'</inertial></link><joint name="j" type="{kind}"><parent link="a"/><child link="b"/>'
        f'{more}</joint><joint name="k" type="revolute"><parent link="b"/><child link="c"/>'
        f'<origin xyz="1 0 0"/></joint></robot>'
    )


BALL = SMALL_ARM.replace('type="slide" axis="0 1 1" range="-0.3 0.4" armature="0.1"', 'type="ball"')
BAD = {
    "no such link": (urdf(), "bb", "did you mean b"),
    "planar": (urdf("planar"), "c", "'j' is planar"),
    "no inertia": (urdf(inertial="").replace(LINK + "</inertial>", ""), "c",
                   "'b' moves and has no mass"),
    "mimic": (urdf(more='<mimic joint="k"/>'), "c", "'j' is coupled"),
    "mimicked": (
        urdf().replace("</robot>", '<link name="d"/><joint name="l" type="revolute"><parent '
                       'link="a"/><child link="d"/><mimic joint="k"/></joint></robot>'),
        "c",
        "'k' is coupled",
    ),
    "no joint": (urdf(), "a", "no joint moves 'a'"),
    "bad number": (urdf(more='<origin xyz="0 0"/>'), "c", "expected 3 number"),
    "unknown child": (urdf().replace('<child link="b"/>', '<child link="z"/>'), "c", "no link"),
    "two roots": (urdf().replace("</robot>", '<link name="d"/></robot>'), "c", "without a parent"),
    "not XML": ("arm", "c", "not an XML file"),
    "another format": ("<sdf/>", "c", "expected <robot>"),
    "ball": (BALL.replace('ref="0.1"', ""), "grip", "'slide' is ball"),
    "MuJoCo's word": (SMALL_ARM.replace('mass="2.5"', 'mass="-1"'), "grip", "does not compile"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_told_by_name(name, tmp_path):
    text, end, word = BAD[name]
    path = tmp_path / "bad.xml"
    path.write_text(text)
    with pytest.raises(ValueError, match=word) as error:
        load_robot(path, end)
    assert str(path) in str(error.value)


def test_a_missing_file_and_a_wrong_base(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file"):
        load_robot(tmp_path / "nothing.urdf", "hand")
    path = tmp_path / "a.urdf"
    path.write_text(urdf())
    with pytest.raises(ValueError, match="'c' is not before 'b'"):
        load_robot(path, "b", base="c")


def test_coupled_joints_of_mjcf(tmp_path):
    path = tmp_path / "coupled.xml"
    equality = '<equality><joint name="tie" joint1="turn" joint2="bend"/></equality></mujoco>'
    path.write_text(SMALL_ARM.replace("</mujoco>", equality))
    with pytest.raises(ValueError, match="'turn' is coupled to others by equality tie"):
        load_robot(path, "grip")


FLOATING = """<robot name="pair"><link name="world"/><link name="bus"><inertial>
  <origin xyz="0.1 0 0.2"/><mass value="20"/>
  <inertia ixx="2" ixy="0.1" ixz="0" iyy="3" iyz="0" izz="2.5"/></inertial></link>
<joint name="float" type="floating"><parent link="world"/><child link="bus"/></joint>""" + "".join(
    f"""<link name="{side}">{LINK}</inertial></link>
<joint name="turn_{side}" type="continuous"><parent link="bus"/><child link="{side}"/>
  <origin xyz="0.3 {y} 0.1" rpy="0.2 {y} 0"/><axis xyz="0 0.6 0.8"/></joint>"""
    for side, y in (("right", -0.4), ("left", 0.4))
) + "</robot>"  # fmt: skip


def test_a_base_floats_where_the_file_has_it_free(tmp_path):
    path = tmp_path / "pair.urdf"
    path.write_text(FLOATING)
    robot = load_robot(path, ("right", "left"))
    assert (robot.parents, robot.hands) == ((BASE, BASE), (0, 1))
    assert not robot.gravity.any()
    one = load_robot(path, "left")
    assert (one.dof, one.hands) == (2, (1,))
    # with the base as the world's frame, MuJoCo's velocities are ours
    q = np.array([0.3, -0.8])
    model = robot_spec(robot).compile()
    data, matrix = mujoco.MjData(model), np.zeros((8, 8))
    data.qpos[-2:] = q
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fullM(model, data, matrix)
    ours = jax.jit(lambda q: (mass_matrix(robot, q), hand_pose(robot, q, 1).translation))(
        jnp.asarray(q)
    )
    np.testing.assert_allclose(ours[0], matrix, rtol=0, atol=1e-11)
    np.testing.assert_allclose(ours[1], data.site("hand_left").xpos, atol=1e-12)
    with pytest.raises(ValueError, match="has a free base"):
        gravity_torque(robot, jnp.asarray(q))


def test_a_named_base_is_fixed(tmp_path):
    path = tmp_path / "pair.urdf"
    path.write_text(FLOATING)
    robot = load_robot(path, ("right", "left"), base="bus")
    assert robot.base is None
    assert (robot.parents, robot.hands) == ((BASE, BASE), (0, 1))
    assert robot.gravity[2] == -9.81
    model = robot_spec(robot).compile()
    data, q = mujoco.MjData(model), np.array([0.3, -0.8])
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    torque = jax.jit(lambda q: gravity_torque(robot, q))(q)
    np.testing.assert_allclose(torque, data.qfrc_bias, rtol=0, atol=1e-11)
