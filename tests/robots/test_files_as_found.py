"""Robot files as users find them: read as elsewhere, refused by name, or with a remark."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pinocchio
import pytest

from mjx_inertia.robots import gravity_torque, load_robot, mass_matrix

INERTIAL = """<inertial><origin xyz="0.1 0 0.2"/><mass value="1.5"/>
<inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.025"/></inertial>"""
LIMIT = '<limit lower="-1" upper="2" effort="5" velocity="3"/>'


def urdf(limit=LIMIT, first=INERTIAL, second=INERTIAL):
    return f"""<robot name="r"><link name="base"/><link name="l1">{first}</link>
<link name="l2">{second}</link>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="1 0 0"/>{limit}
</joint><joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>
<origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>{limit}</joint></robot>"""


def mjcf(outside="", inside="", option=""):
    """Two joints to a hand, and a rod beside them."""
    return f"""<mujoco>{option}<worldbody><body name="l1"><joint name="j1" axis="0 0 1"/>
<inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.02 0.01"/><body name="l2" pos="0.3 0 0">
<joint name="j2" axis="0 1 0"/><inertial pos="0.2 0 0.1" mass="1" diaginertia="0.02 0.03 0.025"/>
{inside}<site name="hand" pos="0 0 0.3"/></body></body><body name="rod" pos="0 1 0.5">
<joint name="jr" axis="0 1 0"/><inertial pos="0 0 0" mass="0.1" diaginertia="0.01 0.01 0.01"/>
</body></worldbody>{outside}</mujoco>"""


def loaded(tmp_path, text, end="l2", **options):
    path = tmp_path / "robot.xml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_robot(path, end, **options)


def assert_alike(a, b):
    jax.tree.map(np.testing.assert_array_equal, a.links, b.links)
    np.testing.assert_array_equal(a.T_parent_joint.translation, b.T_parent_joint.translation)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: '\n\n<?xml version="1.0"?>\n' + text,
        lambda text: text.replace("<link name=", '<drake:meta drake:kind="x"/><link name=', 1),
        lambda text: text.replace("<robot", '<robot xmlns="http://example.org/robot"'),
        lambda text: b'<?xml version="1.0" encoding="utf-8"?><!-- m\xe9trique -->' + text.encode(),
    ],
    ids=["blank line", "prefix without namespace", "default namespace", "Latin-1 comment"],
)
def test_xml_as_it_is_found(change, tmp_path):
    plain = loaded(tmp_path, urdf())
    assert_alike(loaded(tmp_path, change(urdf())), plain)


def test_a_massless_link_between_joints_is_that_of_pinocchio(tmp_path):
    robot = loaded(tmp_path, urdf(first=""))
    model = pinocchio.buildModelFromXML(urdf(first=""))
    q = np.array([0.4, -0.7])
    upper = np.triu(pinocchio.crba(model, model.createData(), q))
    np.testing.assert_allclose(np.triu(mass_matrix(robot, jnp.asarray(q))), upper, atol=1e-14)


@pytest.mark.parametrize("kind", ["link", "joint"])
def test_names_that_are_there_twice_are_refused(kind, tmp_path):
    text = urdf().replace('name="l2">', 'name="l1">').replace('link="l2"', 'link="l1"')
    text = text if kind == "link" else urdf().replace('name="j2"', 'name="j1"')
    with pytest.raises(ValueError, match=f"{kind} '{kind[0]}1' is there twice"):
        loaded(tmp_path, text, "l1")


def test_limits_that_are_not_stated(tmp_path):
    zero = loaded(tmp_path, urdf(limit='<limit lower="-1" upper="2" effort="0" velocity="0"/>'))
    assert np.isinf(zero.torque_limit).all() and np.isinf(zero.velocity_limit).all()
    assert "effort of joint 'j1' is 0 and taken as not stated" in zero.note
    none = loaded(tmp_path, urdf(limit=""))
    assert np.isinf(none.lower).all() and np.isinf(none.upper).all()
    assert "joint 'j2' states no range and is taken as unlimited" in none.note
    with pytest.raises(ValueError, match=r"'j1' has the limits 2\.0 to -1\.0; expected lower"):
        loaded(tmp_path, urdf(limit='<limit lower="2" upper="-1" effort="5" velocity="3"/>'))


def test_inertia_that_no_body_has_is_remarked(tmp_path):
    negative = loaded(tmp_path, urdf(second=INERTIAL.replace('izz="0.025"', 'izz="-0.025"')))
    assert "no body has the principal moments -0.025, " in negative.note
    assert "of link 'l2'" in negative.note and "'l1'" not in negative.note
    flat = loaded(tmp_path, urdf(second=INERTIAL.replace('izz="0.025"', 'izz="0.25"')))
    assert "no body has the principal moments" in flat.note
    with pytest.raises(ValueError, match=r"mass of link 'l2' is -1\.5 kg"):
        loaded(tmp_path, urdf(second=INERTIAL.replace('"1.5"', '"-1.5"')))


def test_gravity_that_is_disabled(tmp_path):
    q = jnp.array([0.3, -0.2])
    heavy = loaded(tmp_path, mjcf(), "hand")
    light = loaded(tmp_path, mjcf(option='<option><flag gravity="disable"/></option>'), "hand")
    assert np.abs(gravity_torque(heavy, q)).max() > 1.0
    np.testing.assert_array_equal(gravity_torque(light, q), 0.0)


def test_what_mujoco_has_and_a_robot_has_not_is_remarked(tmp_path):
    text = mjcf(option='<option density="1.2"/>').replace('name="j2"', 'name="j2" stiffness="3"')
    note = loaded(tmp_path, text, "hand").note
    assert "springs of joints are left out" in note and "forces of a fluid are left out" in note
    assert "left out" not in loaded(tmp_path, mjcf(), "hand").note


LOOPS = {
    "connect": '<equality><connect name="e" body1="l2" body2="rod" anchor="0 0 0.1"/></equality>',
    "weld": '<equality><weld name="e" body1="l2" body2="rod"/></equality>',
    "tendon": '<tendon><fixed name="t"><joint joint="j1" coef="1"/><joint joint="j2" coef="1"/>'
    '</fixed></tendon><equality><tendon name="e" tendon1="t"/></equality>',
}


@pytest.mark.parametrize("kind", LOOPS)
def test_loops_are_refused_by_name(kind, tmp_path):
    with pytest.raises(ValueError, match=rf"'j1' is coupled to others by equality e \({kind}\)"):
        loaded(tmp_path, mjcf(LOOPS[kind]), "hand")
    off = LOOPS[kind].replace('name="e"', 'name="e" active="false"')
    assert loaded(tmp_path, mjcf(off), "hand").dof == 2
    disabled = '<option><flag equality="disable"/></option>'
    assert loaded(tmp_path, mjcf(LOOPS[kind], option=disabled), "hand").dof == 2


def test_a_loop_among_held_joints_leaves_the_robot_alone(tmp_path):
    """As of the fingers of a gripper behind the hand."""
    fingers = "".join(
        f'<body name="{name}"><joint name="{name}"/><geom size="0.01" mass="0.1"/></body>'
        for name in ("f1", "f2")
    )
    tie = '<equality><connect body1="f1" body2="f2" anchor="0 0 0.05"/></equality>'
    robot = loaded(tmp_path, mjcf(tie, fingers), "hand")
    assert robot.dof == 2 and "held at their reference position: f1, f2" in robot.note


def test_a_free_base_that_is_tied_is_refused(tmp_path):
    text = """<mujoco><worldbody><body name="bus"><freejoint/><geom size="0.3" mass="9"/>
<body name="arm" pos="0.3 0 0"><joint axis="0 1 0"/><geom size="0.1" pos="0.2 0 0" mass="1"/>
</body></body></worldbody><equality><weld name="dock" body1="bus"/></equality></mujoco>"""
    with pytest.raises(ValueError, match=r"'bus' is bound by equality dock \(weld\)"):
        loaded(tmp_path, text, ("arm",))


def test_the_armature_of_a_tendon_is_refused(tmp_path):
    text = mjcf('<tendon><fixed name="t" armature="0.5"><joint joint="j1" coef="1"/><joint '
                'joint="j2" coef="-1"/></fixed></tendon>')  # fmt: skip
    with pytest.raises(ValueError, match="'j1' is coupled to others by the armature of tendon t"):
        loaded(tmp_path, text, "hand")


def test_all_motors_of_a_joint_count(tmp_path):
    motors = "".join(
        f'<motor joint="j1" ctrllimited="true" ctrlrange="-1 1" gear="{gear}"/>'
        for gear in (30, 50)
    )
    text = mjcf(f"<actuator>{motors}</actuator>")
    limit = loaded(tmp_path, text, "hand").torque_limit
    np.testing.assert_array_equal(limit, [80.0, np.inf])
    assert mujoco.MjModel.from_xml_string(text).nu == 2


def test_a_mimicking_finger_sits_at_its_offset(tmp_path):
    """The joint that it mimics is held at zero: the finger is at multiplier · 0 + offset."""
    finger = """<link name="{0}">{1}</link><joint name="{0}" type="revolute"><parent link="l2"/>
<child link="{0}"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>{2}{3}</joint>"""
    mimic = '<mimic joint="f1" multiplier="-1" offset="0.5"/>'
    fingers = (
        finger.format("f1", INERTIAL, LIMIT, ""),
        finger.format("f2", INERTIAL, LIMIT, mimic),
    )
    text = urdf().replace("</robot>", "".join(fingers) + "</robot>")
    model = pinocchio.buildModelFromXML(text)
    full = pinocchio.crba(model, model.createData(), np.array([0.4, -0.7, 0.0, 0.5]))
    ours = mass_matrix(loaded(tmp_path, text), jnp.array([0.4, -0.7]))
    np.testing.assert_allclose(np.triu(ours), np.triu(full[:2, :2]), atol=1e-14)


def test_endless_chains_are_refused_at_once(tmp_path):
    links = "".join(f'<link name="l{k}"/>' for k in range(20_000))
    joints = "".join(
        f'<joint name="j{k}" type="fixed"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k in range(19_999)
    )
    with pytest.raises(ValueError, match="20000 links; a robot has at most 2000"):
        loaded(tmp_path, f'<robot name="r">{links}{joints}</robot>')


def test_couplings_are_left_out_where_it_is_asked_for(tmp_path):
    """Then both joints are independent, as in Pinocchio's model and MuJoCo's mass matrix."""
    q = jnp.array([0.4, -0.7])
    text = urdf().replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="j1"/>')
    with pytest.raises(ValueError, match=r"by mimic, .* or pass `ignore_couplings=True`"):
        loaded(tmp_path, text)
    robot = loaded(tmp_path, text, ignore_couplings=True)
    assert "coupled in the file, independent here: j1, j2" in robot.note
    model = pinocchio.buildModelFromXML(text)
    upper = np.triu(pinocchio.crba(model, model.createData(), np.asarray(q)))
    np.testing.assert_allclose(np.triu(mass_matrix(robot, q)), upper, atol=1e-14)
    tied = loaded(tmp_path, mjcf(LOOPS["tendon"]), "hand", ignore_couplings=True)
    plain = loaded(tmp_path, mjcf(), "hand")
    np.testing.assert_array_equal(mass_matrix(tied, q), mass_matrix(plain, q))


def test_a_shared_armature_is_refused_though_couplings_are_left_out(tmp_path):
    text = mjcf('<tendon><fixed name="t" armature="0.5"><joint joint="j1" coef="1"/><joint '
                'joint="j2" coef="-1"/></fixed></tendon>')  # fmt: skip
    with pytest.raises(ValueError, match="by the armature of tendon t"):
        loaded(tmp_path, text, "hand", ignore_couplings=True)


MANY = '<body><geom size="0.1"/></body>'


@pytest.mark.parametrize(
    "copies",
    [
        f'<replicate count="1000000">{MANY}</replicate>',
        f'<replicate count="1000"><replicate count="1000">{MANY}</replicate></replicate>',
        '<body><composite type="cable" count="1000000 1 1" size="1 0 0"/></body>',
        '<include file="many.xml"/>',
    ],
    ids=["replicate", "nested", "composite", "include"],
)
def test_copies_that_would_fill_the_memory_are_refused(copies, tmp_path):
    many = f'<mujocoinclude><replicate count="1000000">{MANY}</replicate></mujocoinclude>'
    (tmp_path / "many.xml").write_text(many)
    with pytest.raises(ValueError, match=r"elements with all copies; a file may have 100000"):
        loaded(tmp_path, mjcf(inside=copies), "hand")


def test_some_copies_are_read(tmp_path):
    copies = f'<replicate count="3" offset="0.1 0 0">{MANY}</replicate>'
    robot, plain = loaded(tmp_path, mjcf(inside=copies), "hand"), loaded(tmp_path, mjcf(), "hand")
    assert robot.dof == 2 and robot.links.mass[1] > plain.links.mass[1]
