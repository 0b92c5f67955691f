"""What models of robots in MuJoCo are made of: frames, inertias, joints, simple geometry.

In: a body of a `mujoco.MjSpec` and figures. Out: the body with them. Geometry is without mass, and
two geoms from here do not collide with each other.
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.spatial import AnyArray, InertialParameters, Pose

Color = tuple[float, float, float, float]
LINK_COLOR: Color = (0.75, 0.2, 0.2, 1.0)
_SHORT = 0.02  # m: a link of no more length gets a ball


def joint_names(names: tuple[str, ...], dof: int) -> tuple[str, ...]:
    """Names of the joints in a model: those of the robot, or `joint_1` and so on."""
    return names or tuple(f"joint_{i + 1}" for i in range(dof))


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


def add_joint(
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
    rgba: Color = LINK_COLOR,
    **place: object,
) -> None:
    """A geom for looks and for contact with others."""
    # of two such geoms neither's type meets the other's affinity, so the robot does not hit itself
    body.add_geom(
        type=kind, size=size, rgba=rgba, mass=0.0, contype=0, conaffinity=1, group=2, **place
    )
