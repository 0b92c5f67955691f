"""An arm as a MuJoCo model: exact inertias, simple geometry for looks and contact.

In: an `Arm`. Out: `mujoco.MjSpec`, or its text, in which body frames are the arm's link frames, so
that MuJoCo's mass matrix and bias forces are the arm's. Capsules run along the links; two fingers
at a fixed gap stand at the hand. Geometry is without mass and does not collide with the arm itself.
A payload becomes a body of its own, `payload`, fixed to the last link and without geometry.
"""

import dataclasses
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.robots.arm import Arm
from mjx_inertia.spatial import InertialParameters, Pose

_LINK_COLOR, _HAND_COLOR = (0.75, 0.2, 0.2, 1.0), (0.25, 0.25, 0.28, 1.0)
_SHORT = 0.02  # m: a link of no more length gets a ball


@dataclasses.dataclass(frozen=True)
class ArmLooks:
    """Sizes of the simple geometry, m.

    Attributes:
      base_radius: of the capsules at the base.
      tip_radius: of those at the hand.
      finger_gap: between the inner faces of the two fingers; no hand is drawn at zero.
      finger_size: of a finger along x, y and z of the hand; it ends at the hand's origin.
      actuators: a motor on each joint, limited to the joint's torque.
    """

    base_radius: float = 0.06
    tip_radius: float = 0.035
    finger_gap: float = 0.06
    finger_size: tuple[float, float, float] = (0.02, 0.012, 0.08)
    actuators: bool = True


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
    body = spec.worldbody.add_body(name="base", **_frame(arm.T_world_base))
    radii = np.linspace(looks.base_radius, looks.tip_radius, arm.dof + 1).tolist()
    offsets = [*np.asarray(arm.T_parent_joint.translation), arm.T_link_hand.translation]
    _limb(body, np.asarray(offsets[0]), radii[0])
    for i, name in enumerate(joint_names(arm)):
        T = Pose(arm.T_parent_joint.rotation[i], arm.T_parent_joint.translation[i])
        body = body.add_body(name=f"{name}_link", **_frame(T))
        _inertial(body, _entry(arm.links, i))
        _joint(body, arm, i, name)
        _limb(body, np.asarray(offsets[i + 1]), radii[i + 1])
        if looks.actuators:
            _motor(spec, arm, i, name)
    body.add_site(name="hand", size=[0.01, 0.01, 0.01], **_frame(arm.T_link_hand))
    if looks.finger_gap > 0.0:
        _fingers(body, arm.T_link_hand, looks)
    if arm.payload is not None:
        _inertial(body.add_body(name="payload"), arm.payload)
    return spec


def arm_mjcf(arm: Arm, looks: ArmLooks | None = None) -> str:
    """The text of `arm_spec`."""
    spec = arm_spec(arm, looks)
    spec.compile()
    return spec.to_xml()


def joint_names(arm: Arm) -> tuple[str, ...]:
    """Names of the joints in the model: the arm's, or `joint_1` and so on."""
    return arm.joint_names or tuple(f"joint_{i + 1}" for i in range(arm.dof))


def _frame(T: Pose) -> dict[str, Float[ndarray, "..."]]:
    rotation = Rotation.from_matrix(np.asarray(T.rotation, np.float64))
    quaternion = rotation.as_quat(scalar_first=True)
    return {"pos": np.asarray(T.translation, np.float64), "quat": quaternion}


def _entry(links: InertialParameters, i: int) -> InertialParameters:
    return InertialParameters(links.mass[i], links.com[i], links.inertia[i])


def _inertial(body: mujoco.MjsBody, params: InertialParameters) -> None:
    tensor = np.asarray(params.inertia, np.float64)
    body.explicitinertial = True
    body.mass = float(params.mass)
    body.ipos = np.asarray(params.com, np.float64)
    body.fullinertia = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _joint(body: mujoco.MjsBody, arm: Arm, i: int, name: str) -> None:
    slides = arm.prismatic[i]
    joint = body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE,
        axis=np.asarray(arm.axis[i], np.float64),
        armature=float(arm.armature[i]),
    )
    limits = [float(arm.lower[i]), float(arm.upper[i])]
    if np.isfinite(limits).all():
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.range = limits
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


def _limb(body: mujoco.MjsBody, end: Float[ndarray, "3"], radius: float) -> None:
    """A capsule from the body's origin to `end`."""
    if np.linalg.norm(end) > _SHORT:
        _geom(body, mujoco.mjtGeom.mjGEOM_CAPSULE, [radius, 0.0, 0.0], fromto=[0, 0, 0, *end])
    else:
        _geom(body, mujoco.mjtGeom.mjGEOM_SPHERE, [radius, 0.0, 0.0])


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
        _geom(body, mujoco.mjtGeom.mjGEOM_BOX, half, rgba=_HAND_COLOR, **_frame(T))


def _geom(
    body: mujoco.MjsBody,
    kind: mujoco.mjtGeom,
    size: Sequence[float],
    rgba: tuple[float, float, float, float] = _LINK_COLOR,
    **place: object,
) -> None:
    # of two such geoms neither's type meets the other's affinity, so the arm does not hit itself
    body.add_geom(
        type=kind, size=size, rgba=rgba, mass=0.0, contype=0, conaffinity=1, group=2, **place
    )
