"""An MJCF file as a tree of links, as MuJoCo compiles it.

In: a path. Out: `LinkTree`. A link's frame has the axes of its body and its origin at the joint; a
body with several joints becomes as many links. MuJoCo's `ref` is taken into account: joint
positions are MuJoCo's. Damping, friction, springs, gravity compensation and fluids are left out,
and `LinkTree.remarks` says so. Joints that equalities or a tendon's armature couple are marked.
"""

import math
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.robots.link_tree import LinkTree, TreeJoint, TreeLink
from mjx_inertia.robots.rigid_links import about_axis, exact_pose, shift
from mjx_inertia.spatial import InertialParameters, Pose, inertial_float64

_KINDS = {
    mujoco.mjtJoint.mjJNT_FREE: "free",
    mujoco.mjtJoint.mjJNT_BALL: "ball",
    mujoco.mjtJoint.mjJNT_SLIDE: "prismatic",
    mujoco.mjtJoint.mjJNT_HINGE: "revolute",
}
_REPEATING = ("replicate", "composite", "flexcomp")  # elements with a `count` of copies
_MOST_ELEMENTS = 100_000  # copies included


def read_mjcf_links(path: Path, root: ET.Element) -> LinkTree:
    """The bodies of a file.

    Args:
      path: of the file.
      root: its element `mujoco`.

    Raises:
      ValueError: what MuJoCo says against the file, or copies that would fill the memory.
    """
    if (count := _expanded_size(path, root)) > _MOST_ELEMENTS:
        raise ValueError(
            f"{path}: {count:.0f} elements with all copies; a file may have {_MOST_ELEMENTS}: "
            "lower `count` of its replicate or composite"
        )
    try:
        model = mujoco.MjSpec.from_file(str(path)).compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ValueError(f"{path}: MuJoCo does not compile it: {error}") from None
    return tree_of(model, str(path))


def _expanded_size(path: Path, root: ET.Element) -> float:
    """Elements of a file and those that it includes, after the copies that MuJoCo makes."""
    size, waiting, seen = 0.0, [(root, 1.0)], {path}
    while waiting:
        element, copies = waiting.pop()
        if element.tag in _REPEATING:
            copies *= _copies(element)
        size += copies
        waiting += [(child, copies) for child in element]
        file = path.parent / element.get("file", "")
        if element.tag == "include" and file.is_file() and file not in seen:
            seen.add(file)
            try:
                waiting.append((ET.parse(file).getroot(), copies))
            except ET.ParseError:
                continue  # MuJoCo says what is wrong with it
    return size


def _copies(element: ET.Element) -> float:
    try:
        return math.prod(max(float(word), 1.0) for word in element.get("count", "1").split())
    except ValueError:
        return 1.0  # MuJoCo says what is wrong with it


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
    weightless = _is_disabled(model, mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    gravity = np.zeros(3) if weightless else np.array(model.opt.gravity)
    return LinkTree(path, name, links, frames, gravity, _left_out(model))


def _is_disabled(model: mujoco.MjModel, flag: mujoco.mjtDisableBit) -> bool:
    return bool(int(model.opt.disableflags) & int(flag))


def _left_out(model: mujoco.MjModel) -> tuple[str, ...]:
    """What acts on the bodies in MuJoCo and is not read."""
    acting = {
        "springs of joints": model.jnt_stiffness.any(),
        "damping of joints": model.dof_damping.any(),
        "dry friction of joints": model.dof_frictionloss.any(),
        "gravity compensation": model.body_gravcomp.any(),
        "springs, damping and friction of tendons": any(
            x.any()
            for x in (model.tendon_stiffness, model.tendon_damping, model.tendon_frictionloss)
        ),
        "forces of a fluid": model.opt.density > 0.0 or model.opt.viscosity > 0.0,
    }
    return tuple(f"{name} are left out" for name, acts in acting.items() if acts)


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
        up = np.array([0.0, 0.0, 1.0])
        return TreeJoint(name, kind, up, coupled=_constraint(model, j)), 0.0
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
        coupled=_constraint(model, j),
        shared_armature=_shared_armature(model, j),
    )
    return joint, float(model.qpos0[model.jnt_qposadr[j]])


def _torque_limit(model: mujoco.MjModel, j: int) -> float:
    """What the joint or all actuators on it allow; infinite if nothing is stated."""
    if model.jnt_actfrclimited[j]:
        return float(abs(model.jnt_actfrcrange[j]).max())
    stated = []
    for a in range(model.nu):
        on_joint = model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT
        if not on_joint or model.actuator_trnid[a, 0] != j:
            continue
        gear = abs(float(model.actuator_gear[a, 0]))
        if model.actuator_forcelimited[a]:
            stated.append(gear * float(abs(model.actuator_forcerange[a]).max()))
            continue
        plain = model.actuator_biastype[a] == mujoco.mjtBias.mjBIAS_NONE
        if model.actuator_ctrllimited[a] and plain:
            gain = abs(float(model.actuator_gainprm[a, 0]))
            stated.append(gear * gain * float(abs(model.actuator_ctrlrange[a]).max()))
    return sum(stated) if stated else np.inf


def _constraint(model: mujoco.MjModel, j: int) -> str:
    """The equality that binds a joint to others, one that closes a loop of bodies included."""
    unbound = _is_disabled(model, mujoco.mjtDisableBit.mjDSBL_EQUALITY)
    for e in range(0 if unbound else model.neq):
        if model.eq_active0[e] and j in _joints_of_equality(model, e):
            kind = mujoco.mjtEq(int(model.eq_type[e])).name.removeprefix("mjEQ_").lower()
            return f"equality {model.equality(e).name or e} ({kind})"
    return ""


def _shared_armature(model: mujoco.MjModel, j: int) -> str:
    """The tendon whose armature couples a joint to others."""
    for t in np.flatnonzero(model.tendon_armature):
        if j in _joints_of_tendon(model, int(t)):
            return f"the armature of tendon {model.tendon(t).name or t}"
    return ""


def _joints_of_equality(model: mujoco.MjModel, e: int) -> set[int]:
    kind = mujoco.mjtEq(int(model.eq_type[e]))
    first, second = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
    if kind == mujoco.mjtEq.mjEQ_JOINT:
        return {first, second}
    if kind == mujoco.mjtEq.mjEQ_TENDON:
        ends = [t for t in (first, second) if t >= 0]
        return set().union(*(_joints_of_tendon(model, t) for t in ends))
    if kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
        if model.eq_objtype[e] == mujoco.mjtObj.mjOBJ_SITE:
            first, second = (int(model.site_bodyid[site]) for site in (first, second))
        # what moves both bodies alike is not bound
        return _joints_before(model, first) ^ _joints_before(model, second)
    return set()


def _joints_of_tendon(model: mujoco.MjModel, t: int) -> set[int]:
    joints: set[int] = set()
    start = int(model.tendon_adr[t])
    for w in range(start, start + int(model.tendon_num[t])):
        kind, part = int(model.wrap_type[w]), int(model.wrap_objid[w])
        if kind == mujoco.mjtWrap.mjWRAP_JOINT:
            joints.add(part)
        elif kind == mujoco.mjtWrap.mjWRAP_SITE:
            joints |= _joints_before(model, int(model.site_bodyid[part]))
    return joints


def _joints_before(model: mujoco.MjModel, body: int) -> set[int]:
    """Joints that move a body."""
    joints: set[int] = set()
    while body > 0:
        first = int(model.body_jntadr[body])
        joints.update(range(first, first + int(model.body_jntnum[body])))
        body = int(model.body_parentid[body])
    return joints


def _inertial(
    model: mujoco.MjModel, body: int, anchor: Float[ndarray, "3"]
) -> InertialParameters | None:
    """In the frame with the body's axes and its origin at `anchor`."""
    if not model.body_mass[body] > 0.0:
        return None
    turn = _pose(model.body_iquat[body], np.zeros(3)).rotation
    inertia = (turn * model.body_inertia[body]) @ turn.T
    return inertial_float64(float(model.body_mass[body]), model.body_ipos[body] - anchor, inertia)


def _pose(quaternion: Float[ndarray, "4"], position: Float[ndarray, "3"]) -> Pose:
    rotation = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    return exact_pose(rotation, np.array(position))
