"""An MJCF file as a tree of links, as MuJoCo compiles it.

In: a path. Out: `LinkTree`. A link's frame has the axes of its body and its origin at the joint; a
body with several joints becomes as many links. MuJoCo's `ref` is taken into account: joint
positions are MuJoCo's. Damping, friction and gravity compensation are left out.
"""

from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.robots.link_tree import LinkTree, TreeJoint, TreeLink
from mjx_inertia.robots.rigid_links import about_axis, exact_pose, float64_parameters, shift
from mjx_inertia.spatial import InertialParameters, Pose

_KINDS = {
    mujoco.mjtJoint.mjJNT_FREE: "free",
    mujoco.mjtJoint.mjJNT_BALL: "ball",
    mujoco.mjtJoint.mjJNT_SLIDE: "prismatic",
    mujoco.mjtJoint.mjJNT_HINGE: "revolute",
}


def read_mjcf_links(path: Path) -> LinkTree:
    """The bodies of a file.

    Raises:
      ValueError: what MuJoCo says against the file.
    """
    try:
        model = mujoco.MjSpec.from_file(str(path)).compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ValueError(f"{path}: MuJoCo does not compile it: {error}") from None
    return tree_of(model, str(path))


def tree_of(model: mujoco.MjModel, path: str) -> LinkTree:
    """The bodies of a compiled model, the world as the first link."""
    last = {0: 0}  # body to the link that carries its inertia
    T_last_body = {0: Pose.identity()}
    links = [TreeLink("world", -1, Pose.identity(), Pose.identity(), None, None)]
    for body in range(1, model.nbody):
        _add_body(model, body, links, last, T_last_body)
    frames: dict[str, tuple[int, Pose]] = {}
    for site in range(model.nsite):
        body = int(model.site_bodyid[site])
        T_body_site = _pose(model.site_quat[site], model.site_pos[site])
        frames[model.site(site).name] = (last[body], T_last_body[body] @ T_body_site)
    for body in range(model.nbody):
        frames[model.body(body).name] = (last[body], T_last_body[body])
    name = model.names[: model.names.index(b"\x00")].decode()
    return LinkTree(path, name, links, frames, np.array(model.opt.gravity))


def _add_body(
    model: mujoco.MjModel,
    body: int,
    links: list[TreeLink],
    last: dict[int, int],
    T_last_body: dict[int, Pose],
) -> None:
    parent = int(model.body_parentid[body])
    before = last[parent]
    T_before_body = T_last_body[parent] @ _pose(model.body_quat[body], model.body_pos[body])
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    name = model.body(body).name or f"body {body}"
    anchor = np.zeros(3)
    for k, j in enumerate(range(first, first + count)):
        # the frame has the body's axes and its origin at the joint
        anchor = np.array(model.jnt_pos[j])
        T_held = T_before_body @ shift(anchor)
        joint, reference = _joint(model, j)
        back = (
            shift(-reference * joint.axis)
            if joint.kind == "prismatic"
            else about_axis(joint.axis, -reference)
        )
        final = k == count - 1
        inertial = _inertial(model, body, anchor) if final else None
        links.append(
            TreeLink(name, before, T_held @ back, T_held, joint, inertial, weightless=not final)
        )
        before, T_before_body = len(links) - 1, shift(-anchor)
    if not count:
        inertial = _inertial(model, body, anchor)
        links.append(TreeLink(name, before, T_before_body, T_before_body, None, inertial))
        before, T_before_body = len(links) - 1, Pose.identity()
    last[body], T_last_body[body] = before, T_before_body


def _joint(model: mujoco.MjModel, j: int) -> tuple[TreeJoint, float]:
    """A joint and its reference position."""
    kind = _KINDS[mujoco.mjtJoint(model.jnt_type[j])]
    name = model.joint(j).name or f"joint {j}"
    if kind in ("free", "ball"):
        return TreeJoint(name, kind, np.array([0.0, 0.0, 1.0])), 0.0
    limited = bool(model.jnt_limited[j])
    axis = np.array(model.jnt_axis[j])
    joint = TreeJoint(
        name=name,
        kind=kind,
        axis=np.where(abs(axis) < 1e-15, 0.0, axis),
        lower=float(model.jnt_range[j, 0]) if limited else -np.inf,
        upper=float(model.jnt_range[j, 1]) if limited else np.inf,
        torque=_torque_limit(model, j),
        armature=float(model.dof_armature[model.jnt_dofadr[j]]),
        coupled=_coupling(model, j),
    )
    return joint, float(model.qpos0[model.jnt_qposadr[j]])


def _torque_limit(model: mujoco.MjModel, j: int) -> float:
    """What the joint or an actuator on it allows; infinite if nothing is stated."""
    if model.jnt_actfrclimited[j]:
        return float(abs(model.jnt_actfrcrange[j]).max())
    for a in range(model.nu):
        on_joint = model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT
        if not on_joint or model.actuator_trnid[a, 0] != j:
            continue
        gear = abs(float(model.actuator_gear[a, 0]))
        if model.actuator_forcelimited[a]:
            return gear * float(abs(model.actuator_forcerange[a]).max())
        plain = model.actuator_biastype[a] == mujoco.mjtBias.mjBIAS_NONE
        if model.actuator_ctrllimited[a] and plain:
            gain = abs(float(model.actuator_gainprm[a, 0]))
            return gear * gain * float(abs(model.actuator_ctrlrange[a]).max())
    return np.inf


def _coupling(model: mujoco.MjModel, j: int) -> str:
    for e in range(model.neq):
        of_joints = model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and model.eq_active0[e]
        if of_joints and j in (model.eq_obj1id[e], model.eq_obj2id[e]):
            return f"equality {model.equality(e).name or e}"
    return ""


def _inertial(
    model: mujoco.MjModel, body: int, anchor: Float[ndarray, "3"]
) -> InertialParameters | None:
    """In the frame with the body's axes and its origin at `anchor`."""
    if not model.body_mass[body] > 0.0:
        return None
    turn = _pose(model.body_iquat[body], np.zeros(3)).rotation
    inertia = (turn * model.body_inertia[body]) @ turn.T
    return float64_parameters(float(model.body_mass[body]), model.body_ipos[body] - anchor, inertia)


def _pose(quaternion: Float[ndarray, "4"], position: Float[ndarray, "3"]) -> Pose:
    rotation = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    return exact_pose(rotation, np.array(position))
