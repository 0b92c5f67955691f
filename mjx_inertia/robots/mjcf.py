"""A robot as a MuJoCo model: exact inertias, simple geometry for looks and contact.

In: a `Robot`. Out: `mujoco.MjSpec`, or its text, in which body frames are the robot's link frames
and degrees of freedom are those of a free base, then the joints in order: MuJoCo's mass matrix and
bias forces are the robot's. Capsules run along the links. Geometry is without mass, and no two
geoms of the robot collide.
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.robots.robot import BASE, Robot, joint_names
from mjx_inertia.spatial import AnyArray, InertialParameters, Pose, inertial_float64

Color = tuple[float, float, float, float]
SIDES = ("right", "left")
_LINK_COLOR: Color = (0.75, 0.2, 0.2, 1.0)
_BASE_COLOR: Color = (0.7, 0.72, 0.75, 1.0)
_FINGER_COLOR: Color = (0.25, 0.25, 0.28, 1.0)
_FINGER = (0.02, 0.012, 0.08)  # size along x, y and z of the hand, m
_SHORT = 0.02  # m: a link of no more length gets a ball
_WEIGHTLESS = 1e-12  # kg, kg m²: MuJoCo refuses moving bodies of less than 1e-15
_PLANAR_JOINTS = (("x", 0, True), ("y", 1, True), ("turn", 2, False))  # name, axis, slides
_NO_LIMITS = (-np.inf, np.inf)


def robot_spec(robot: Robot, finger_gap: float = 0.06, motors: bool = True) -> mujoco.MjSpec:
    """The robot as an editable model.

    Bodies: `base`, one for each link, named like its joint with `_link` behind, and `payload`,
    fixed to the first hand's link and without geometry. Sites: `hand`, or `hand_right` and
    `hand_left` of two. A free base has a free joint `free`, or `x`, `y` and `turn` of a planar one.

    Args:
      robot: the robot.
      finger_gap: m, between the two fingers that stand at the hands of a robot on a fixed base and
        end at the hand's origin; none at zero.
      motors: whether each joint has a motor, limited to the joint's torque.
    """
    spec = mujoco.MjSpec()
    spec.modelname = robot.name or "robot"
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    spec.option.gravity = np.asarray(robot.gravity)
    base = spec.worldbody.add_body(name="base", **placement(robot.T_world_base))
    if robot.base is not None:
        _add_free_base(base, robot, robot.base)
    bodies = _add_links(base, robot)
    for k, (name, link) in enumerate(zip(hand_names(robot), robot.hands, strict=True)):
        T_link_hand = robot.T_link_hand[k]
        add_limb(bodies[link], np.asarray(T_link_hand.translation), robot.radius)
        bodies[link].add_site(name=name, size=[0.01, 0.01, 0.01], **placement(T_link_hand))
        if robot.base is None and finger_gap > 0.0:
            _add_fingers(bodies[link], T_link_hand, finger_gap)
    if robot.payload is not None:
        set_inertial(bodies[robot.hands[0]].add_body(name="payload"), robot.payload)
    if motors:
        for i, name in enumerate(joint_names(robot)):
            _add_motor(spec, name, float(robot.torque_limit[i]))
    return spec


def robot_mjcf(robot: Robot, finger_gap: float = 0.06, motors: bool = True) -> str:
    """The text of `robot_spec`; MuJoCo writes its figures to six digits."""
    spec = robot_spec(robot, finger_gap, motors)
    spec.compile()
    return spec.to_xml()


def hand_names(robot: Robot) -> tuple[str, ...]:
    """Names of the hands' sites in a model."""
    if len(robot.hands) == 1:
        return ("hand",)
    if len(robot.hands) == 2:
        return tuple(f"hand_{side}" for side in SIDES)
    return tuple(f"hand_{k + 1}" for k in range(len(robot.hands)))


def placement(T: Pose) -> dict[str, Float[ndarray, "..."]]:
    """A pose as `pos` and `quat`."""
    rotation = Rotation.from_matrix(np.asarray(T.rotation, np.float64))
    quaternion = rotation.as_quat(scalar_first=True)
    return {"pos": np.asarray(T.translation, np.float64), "quat": quaternion}


def set_inertial(body: mujoco.MjsBody, params: InertialParameters) -> None:
    """Gives a body exactly these parameters, in its frame."""
    tensor = np.asarray(params.inertia, np.float64)
    body.explicitinertial = True
    body.mass = float(params.mass)
    body.ipos = np.asarray(params.com, np.float64)
    body.fullinertia = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _add_joint(
    body: mujoco.MjsBody,
    name: str,
    axis: Float[AnyArray, "3"],
    slides: bool,
    armature: float,
    limits: tuple[float, float],
) -> mujoco.MjsJoint:
    """A joint at the body's origin; limits that are not finite are none."""
    joint = body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE,
        axis=np.asarray(axis, np.float64),
        armature=armature,
    )
    if np.isfinite(limits).all():
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.range = limits
    return joint


def add_limb(body: mujoco.MjsBody, end: Float[AnyArray, "3"], radius: float) -> None:
    """A capsule from the body's origin to `end` (m, in its frame), or a ball if that is near."""
    if np.linalg.norm(end) > _SHORT:
        add_geom(body, mujoco.mjtGeom.mjGEOM_CAPSULE, [radius, 0.0, 0.0], fromto=[0, 0, 0, *end])
    else:
        add_geom(body, mujoco.mjtGeom.mjGEOM_SPHERE, [radius, 0.0, 0.0])


def add_geom(
    body: mujoco.MjsBody,
    kind: mujoco.mjtGeom,
    size: Sequence[float],
    rgba: Color = _LINK_COLOR,
    **place: object,
) -> None:
    """A geom for looks and for contact with others."""
    # of two such geoms neither's type meets the other's affinity, so the robot does not hit itself
    body.add_geom(
        type=kind, size=size, rgba=rgba, mass=0.0, contype=0, conaffinity=1, group=2, **place
    )


def _add_free_base(body: mujoco.MjsBody, robot: Robot, params: InertialParameters) -> None:
    set_inertial(body, params)
    half = [edge / 2.0 for edge in robot.base_size]
    add_geom(body, mujoco.mjtGeom.mjGEOM_BOX, half, rgba=_BASE_COLOR)
    if robot.planar:
        for name, axis, slides in _PLANAR_JOINTS:
            _add_joint(body, name, np.eye(3)[axis], slides, 0.0, _NO_LIMITS)
    else:
        body.add_freejoint(name="free")


def _add_links(base: mujoco.MjsBody, robot: Robot) -> list[mujoco.MjsBody]:
    bodies: list[mujoco.MjsBody] = []
    for i, (name, parent) in enumerate(zip(joint_names(robot), robot.parents, strict=True)):
        T_parent_joint = robot.T_parent_joint[i]
        before = base if parent == BASE else bodies[parent]
        if parent != BASE or robot.base is None:  # a free base is a box
            add_limb(before, np.asarray(T_parent_joint.translation), robot.radius)
        body = before.add_body(name=f"{name}_link", **placement(T_parent_joint))
        set_inertial(body, _link(robot, i))
        limits = float(robot.lower[i]), float(robot.upper[i])
        armature = float(robot.armature[i])
        joint = _add_joint(body, name, robot.axis[i], robot.prismatic[i], armature, limits)
        torque = float(robot.torque_limit[i])
        if np.isfinite(torque):
            joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
            joint.actfrcrange = [-torque, torque]
        bodies.append(body)
    return bodies


def _link(robot: Robot, i: int) -> InertialParameters:
    if float(robot.links.mass[i]) == 0.0:  # one of several joints of one body
        return inertial_float64(_WEIGHTLESS, np.zeros(3), _WEIGHTLESS * np.eye(3))
    return inertial_float64(robot.links.mass[i], robot.links.com[i], robot.links.inertia[i])


def _add_motor(spec: mujoco.MjSpec, joint: str, torque: float) -> None:
    motor = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    if np.isfinite(torque):
        motor.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        motor.ctrlrange = [-torque, torque]


def _add_fingers(body: mujoco.MjsBody, T_link_hand: Pose, gap: float) -> None:
    """Two fingers that end at the hand's origin, and the palm on which they stand."""
    across, thick, length = _FINGER
    away = (gap + thick) / 2
    palm = [across, away + thick / 2, thick / 2]
    boxes = [
        ([0.0, -away, -length / 2], [across / 2, thick / 2, length / 2]),
        ([0.0, away, -length / 2], [across / 2, thick / 2, length / 2]),
        ([0.0, 0.0, -length - thick / 2], palm),
    ]
    for center, half in boxes:
        T = T_link_hand @ Pose(np.eye(3), np.array(center))
        add_geom(body, mujoco.mjtGeom.mjGEOM_BOX, half, rgba=_FINGER_COLOR, **placement(T))
