"""An arm as a MuJoCo model: exact inertias, simple geometry for looks and contact.

In: an `Arm`. Out: `mujoco.MjSpec`, or its text, in which body frames are the arm's link frames, so
that MuJoCo's mass matrix and bias forces are the arm's. Capsules run along the links; two fingers
at a fixed gap stand at the hand. Geometry is without mass and does not collide with the arm itself.
A payload becomes a body of its own, `payload`, fixed to the last link and without geometry.
"""

import dataclasses

import mujoco
import numpy as np

from mjx_inertia.robots.arm import Arm
from mjx_inertia.robots.mjcf_parts import (
    add_geom,
    add_joint,
    add_limb,
    joint_names,
    placement,
    set_inertial,
)
from mjx_inertia.spatial import InertialParameters, Pose

_HAND_COLOR = (0.25, 0.25, 0.28, 1.0)


@dataclasses.dataclass(frozen=True)
class ArmLooks:
    """Sizes of the simple geometry, m."""

    base_radius: float = 0.06  # of the capsules at the base
    tip_radius: float = 0.035  # of those at the hand
    finger_gap: float = 0.06  # between the inner faces of the two fingers; no hand is drawn at zero
    # of a finger along x, y and z of the hand; it ends at the hand's origin
    finger_size: tuple[float, float, float] = (0.02, 0.012, 0.08)
    actuators: bool = True  # a motor on each joint, limited to the joint's torque


def arm_spec(arm: Arm, looks: ArmLooks | None = None) -> mujoco.MjSpec:
    """The arm as an editable model.

    Bodies: `base`, then one per link, named like its joint with `_link` behind. Site: `hand`. The
    model's world is the arm's.
    """
    looks = looks or ArmLooks()
    spec = mujoco.MjSpec()
    spec.modelname = arm.name or "arm"
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    spec.option.gravity = np.asarray(arm.gravity)
    body = spec.worldbody.add_body(name="base", **placement(arm.T_world_base))
    radii = np.linspace(looks.base_radius, looks.tip_radius, arm.dof + 1).tolist()
    offsets = [*np.asarray(arm.T_parent_joint.translation), arm.T_link_hand.translation]
    add_limb(body, np.asarray(offsets[0]), radii[0])
    for i, name in enumerate(joint_names(arm.joint_names, arm.dof)):
        T = Pose(arm.T_parent_joint.rotation[i], arm.T_parent_joint.translation[i])
        body = body.add_body(name=f"{name}_link", **placement(T))
        set_inertial(body, _entry(arm.links, i))
        _joint(body, arm, i, name)
        add_limb(body, np.asarray(offsets[i + 1]), radii[i + 1])
        if looks.actuators:
            _motor(spec, arm, i, name)
    body.add_site(name="hand", size=[0.01, 0.01, 0.01], **placement(arm.T_link_hand))
    if looks.finger_gap > 0.0:
        _fingers(body, arm.T_link_hand, looks)
    if arm.payload is not None:
        set_inertial(body.add_body(name="payload"), arm.payload)
    return spec


def arm_mjcf(arm: Arm, looks: ArmLooks | None = None) -> str:
    """The text of `arm_spec`."""
    spec = arm_spec(arm, looks)
    spec.compile()
    return spec.to_xml()


def _entry(links: InertialParameters, i: int) -> InertialParameters:
    return InertialParameters(links.mass[i], links.com[i], links.inertia[i])


def _joint(body: mujoco.MjsBody, arm: Arm, i: int, name: str) -> None:
    limits = float(arm.lower[i]), float(arm.upper[i])
    armature = float(arm.armature[i])
    joint = add_joint(body, name, arm.axis[i], arm.prismatic[i], armature, limits)
    torque = float(arm.torque_limit[i])
    if np.isfinite(torque):
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.actfrcrange = [-torque, torque]


def _motor(spec: mujoco.MjSpec, arm: Arm, i: int, name: str) -> None:
    motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    torque = float(arm.torque_limit[i])
    if np.isfinite(torque):
        motor.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        motor.ctrlrange = [-torque, torque]


def _fingers(body: mujoco.MjsBody, T_link_hand: Pose, looks: ArmLooks) -> None:
    """Two fingers that end at the hand's origin, and the palm on which they stand."""
    across, thick, length = looks.finger_size
    away = (looks.finger_gap + thick) / 2
    palm = [across, away + thick / 2, thick / 2]
    boxes = [
        ([0.0, -away, -length / 2], [across / 2, thick / 2, length / 2]),
        ([0.0, away, -length / 2], [across / 2, thick / 2, length / 2]),
        ([0.0, 0.0, -length - thick / 2], palm),
    ]
    for center, half in boxes:
        T = T_link_hand @ Pose(np.eye(3), np.array(center))
        add_geom(body, mujoco.mjtGeom.mjGEOM_BOX, half, rgba=_HAND_COLOR, **placement(T))
