"""Robot files against Pinocchio and MuJoCo: each outcome from a file that has it."""

import pytest

from parts.robot_files import (
    NO_REFERENCE,
    REFUSED,
    RIGHT,
    RIGHT_UNCOUPLED,
    TRACEBACK,
    WRONG,
    MujocoReference,
    PinocchioReference,
    Torques,
    compare_file,
    kind_of_file,
)

pytestmark = pytest.mark.float64

LINK = """<link name="{}"><inertial><origin xyz="0.1 0 0.2"/><mass value="1.5"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.025"/></inertial></link>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>
<origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>{3}<limit lower="-1" upper="1" effort="1" velocity="1"/>
</joint>"""
SECOND = LINK.format("l2")
WALKER = """<mujoco><worldbody><body name="trunk" pos="0 0 1" euler="30 0 0"><freejoint/>
<geom size="0.2"/><body name="leg" pos="0.2 0 0"><joint name="hip" axis="0 1 0" armature="0.1"/>
<geom size="0.1" pos="0 0 -0.3"/></body><body name="tail" pos="-0.2 0 0"><joint axis="0 0 1"/>
<joint name="lift" type="slide" axis="1 0 0"/><geom size="0.1" pos="-0.2 0 0"/></body></body>
</worldbody></mujoco>"""


def urdf(mimic="", second=SECOND):
    joints = JOINT.format("j1", "base", "l1", "") + JOINT.format("j2", "l1", "l2", mimic)
    return f'<robot name="r"><link name="base"/>{LINK.format("l1")}{second}{joints}</robot>'


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        (urdf(), [RIGHT]),
        (urdf('<mimic joint="j1" multiplier="-1" offset="0.2"/>'), [RIGHT_UNCOUPLED]),
        (urdf(second='<link name="l2"/>'), [REFUSED]),
        (urdf() + "</robot>", [NO_REFERENCE]),
        (WALKER, [RIGHT, RIGHT]),
    ],
    ids=["urdf", "mimic", "massless", "damaged", "mjcf"],
)
def test_outcomes(text, kinds, tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(text)
    found = compare_file(path, most=5, states=2)
    assert [outcome.kind for outcome in found] == kinds, found


def test_chains_of_both_references(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(urdf())
    (chain,) = PinocchioReference(path).chains()
    assert (chain.joints, chain.base) == (("j1", "j2"), "base")
    path.write_text(WALKER)
    chains = MujocoReference(path).chains()
    assert [(c.end, c.joints, c.base) for c in chains] == [
        ("leg", ("hip",), "trunk"),
        ("tail", ("joint 2", "lift"), "trunk"),
    ]


def test_what_is_wrong_or_fails_is_found(monkeypatch, tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(urdf())
    true = PinocchioReference.torques

    def heavier(self, chain, positions):
        torques = true(self, chain, positions)
        return Torques(1.00001 * torques.mass_matrix, torques.gravity, torques.scale)

    monkeypatch.setattr(PinocchioReference, "torques", heavier)
    (outcome,) = compare_file(path, most=5, states=2)
    assert outcome.kind == WRONG and outcome.detail == "relative error 1.0e-05"

    def fails(*_):
        raise KeyError("none")

    monkeypatch.setattr("parts.robot_files.load_robot", fails)
    assert [outcome.kind for outcome in compare_file(path, 5, 2)] == [TRACEBACK]


def test_kinds_of_files(tmp_path):
    path = tmp_path / "a.xml"
    for text, kind in (
        ("<!-- <mujoco> --><robot name='r'>", "urdf"),
        ("<mujoco model='m'>", "mjcf"),
        ("<mujocoinclude>", ""),
        ("<package>", ""),
    ):
        path.write_text(text)
        assert kind_of_file(path) == kind
