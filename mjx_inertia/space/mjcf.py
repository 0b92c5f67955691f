"""A space robot as a MuJoCo model, alone or with the object in its hands.

In: a `SpaceRobot`, a `Capture`. Out: `mujoco.MjSpec`, or its text, in which body frames are the
robot's link frames and degrees of freedom are those of the base, then the joints in order. There is
no gravity, and nothing collides with the robot. The object is fixed to the first hand and welded to
the second; sensors `force_right`, `torque_right`, `force_left`, `torque_left` show what each hand
exerts on it, in the axes of the site `hand_right` or `hand_left`, about its origin.
"""

import mujoco
import numpy as np

from mjx_inertia.robots.mjcf_parts import (
    Color,
    add_geom,
    add_joint,
    add_limb,
    joint_names,
    placement,
    set_inertial,
)
from mjx_inertia.robots.rigid_links import float64_parameters
from mjx_inertia.space.robot import BASE, Capture, SpaceRobot, pose_at_index
from mjx_inertia.spatial import InertialParameters, Pose

HANDS = ("right", "left")
_BASE_COLOR: Color = (0.7, 0.72, 0.75, 1.0)
_OBJECT_COLOR: Color = (0.2, 0.45, 0.8, 1.0)
_WEIGHTLESS = 1e-12  # kg, kg m²: MuJoCo refuses moving bodies of less than 1e-15
_PLANAR_JOINTS = (("x", 0, True), ("y", 1, True), ("turn", 2, False))  # name, axis, slides


def space_spec(robot: SpaceRobot, capture: Capture | None = None) -> mujoco.MjSpec:
    """The robot as an editable model.

    Bodies: `base`, one for each link, named like its joint with `_link` behind, and `object`. The
    base has a free joint `free`, or `x`, `y` and `turn` of a planar robot.
    """
    spec = mujoco.MjSpec()
    spec.modelname = robot.name or "space robot"
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    spec.option.gravity = np.zeros(3)
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    base = spec.worldbody.add_body(name="base")
    set_inertial(base, robot.base)
    half = [edge / 2.0 for edge in robot.base_size]
    add_geom(base, mujoco.mjtGeom.mjGEOM_BOX, half, rgba=_BASE_COLOR)
    if robot.planar:
        for name, axis, slides in _PLANAR_JOINTS:
            add_joint(base, name, np.eye(3)[axis], slides, 0.0, (-np.inf, np.inf))
    else:
        base.add_freejoint(name="free")
    bodies = _links(robot, base)
    for k, (side, link) in enumerate(zip(HANDS, robot.hands, strict=True)):
        T_link_hand = pose_at_index(robot.T_link_hand, k)
        add_limb(bodies[link], np.asarray(T_link_hand.translation), robot.radius)
        site = {"size": [0.01, 0.01, 0.01], **placement(T_link_hand)}
        if capture is None:
            bodies[link].add_site(name=f"hand_{side}", **site)
    if capture is not None:
        _hold(spec, robot, capture, bodies)
    return spec


def space_mjcf(robot: SpaceRobot, capture: Capture | None = None) -> str:
    """The text of `space_spec`; MuJoCo writes its figures to six digits."""
    spec = space_spec(robot, capture)
    spec.compile()
    return spec.to_xml()


def _links(robot: SpaceRobot, base: mujoco.MjsBody) -> list[mujoco.MjsBody]:
    bodies: list[mujoco.MjsBody] = []
    names = joint_names(robot.joint_names, robot.dof)
    for i, (name, parent) in enumerate(zip(names, robot.parents, strict=True)):
        T_parent_joint = pose_at_index(robot.T_parent_joint, i)
        before = base if parent == BASE else bodies[parent]
        if parent != BASE:
            add_limb(before, np.asarray(T_parent_joint.translation), robot.radius)
        body = before.add_body(name=f"{name}_link", **placement(T_parent_joint))
        set_inertial(body, _link(robot, i))
        limits = float(robot.lower[i]), float(robot.upper[i])
        armature = float(robot.armature[i])
        add_joint(body, name, robot.axis[i], robot.prismatic[i], armature, limits)
        bodies.append(body)
    return bodies


def _hold(
    spec: mujoco.MjSpec, robot: SpaceRobot, capture: Capture, bodies: list[mujoco.MjsBody]
) -> None:
    """The object in the first hand, and the weld that ties the second to it.

    A force sensor shows what a body's parent exerts on it. So the second hand is a body without
    mass, `palm`: what its link exerts on it, it passes on to the object.
    """
    T_hand_obj = [pose_at_index(capture.T_hand_obj, k) for k in (0, 1)]
    T_link_hand = [pose_at_index(robot.T_link_hand, k) for k in (0, 1)]
    held = bodies[robot.hands[0]].add_body(
        name="object", **placement(T_link_hand[0] @ T_hand_obj[0])
    )
    set_inertial(held, capture.inertial)
    add_geom(held, mujoco.mjtGeom.mjGEOM_SPHERE, [capture.radius, 0.0, 0.0], rgba=_OBJECT_COLOR)
    palm = bodies[robot.hands[1]].add_body(name="palm", **placement(T_link_hand[1]))
    palm.explicitinertial = True
    palm.mass, palm.inertia = 0.0, np.zeros(3)
    places = ((held, T_hand_obj[0].inverse()), (palm, Pose.identity()))
    for side, (body, T_body_hand) in zip(HANDS, places, strict=True):
        name = f"hand_{side}"
        body.add_site(name=name, size=[0.01, 0.01, 0.01], **placement(T_body_hand))
        for kind in ("force", "torque"):
            spec.add_sensor(
                name=f"{kind}_{side}",
                type=getattr(mujoco.mjtSensor, f"mjSENS_{kind.upper()}"),
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                objname=name,
            )
    relative = placement(T_hand_obj[1])
    weld = spec.add_equality(
        name="grasp", type=mujoco.mjtEq.mjEQ_WELD, name1="palm", name2="object"
    )
    weld.objtype = mujoco.mjtObj.mjOBJ_BODY
    weld.data[:11] = np.concatenate([np.zeros(3), relative["pos"], relative["quat"], [1.0]])


def _link(robot: SpaceRobot, i: int) -> InertialParameters:
    if float(robot.links.mass[i]) == 0.0:  # one of several joints of one body
        return float64_parameters(_WEIGHTLESS, np.zeros(3), _WEIGHTLESS * np.eye(3))
    return float64_parameters(robot.links.mass[i], robot.links.com[i], robot.links.inertia[i])
