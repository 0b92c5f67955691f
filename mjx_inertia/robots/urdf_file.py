"""A URDF file as a tree of links.

In: a path. Out: `LinkTree`. Only links, joints and inertial elements are read, so meshes and
`package://` addresses need not be there. Masses that geometry alone would give are not made up.
"""

import dataclasses
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from mjx_inertia.robots.link_tree import LinkTree, TreeJoint, TreeLink
from mjx_inertia.robots.rigid_links import about_axis, link_parameters as link_of, pose, shift
from mjx_inertia.spatial import InertialParameters, Pose

_MOST_LINKS = 2000
_GRAVITY = (0.0, 0.0, -9.81)
_UPPER = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_KINDS = {"continuous": "revolute", "floating": "free"}  # names of our own


def read_urdf_links(path: Path, root: ET.Element) -> LinkTree:
    """The links of a file, its first link as the world.

    Args:
      path: of the file, for messages.
      root: its element `robot`.

    Raises:
      ValueError: links that nothing joins, or elements that are not as URDF defines them.
    """
    elements = {_text(e, "name", "a link", path): e for e in root.findall("link")}
    for kind in ("link", "joint"):
        names = Counter(e.get("name") for e in root.findall(kind))
        if twice := [name for name, count in names.items() if count > 1]:
            raise ValueError(f"{path}: {kind} {twice[0]!r} is there twice; rename one of the two")
    remarks: list[str] = []
    joints: dict[str, ET.Element] = {}
    for joint in root.findall("joint"):
        child = _end(joint, "child", elements, path)
        _end(joint, "parent", elements, path)
        if child in joints:
            raise ValueError(f"{path}: link {child!r} is the child of two joints")
        joints[child] = joint
    roots = [name for name in elements if name not in joints]
    if len(roots) != 1:
        raise ValueError(f"{path}: expected one link without a parent, found {roots or 'none'}")
    if len(elements) > _MOST_LINKS:
        raise ValueError(f"{path}: {len(elements)} links; a robot has at most {_MOST_LINKS}")
    bound = {m.get("joint") for j in joints.values() for m in j.findall("mimic")}
    held = _held_positions(joints.values(), path)
    after: dict[str, list[str]] = {}
    for child, joint in joints.items():
        after.setdefault(_end(joint, "parent", elements, path), []).append(child)
    order, links = {roots[0]: 0}, []
    links.append(_link(path, roots[0], elements[roots[0]], -1, None, bound, remarks))
    waiting = [roots[0]]
    while waiting:
        parent = waiting.pop(0)
        for child in after.get(parent, []):
            order[child] = len(links)
            joint, element = joints[child], elements[child]
            link = _link(path, child, element, order[parent], joint, bound, remarks)
            if offset := held.get(joint.get("name"), 0.0):
                link = _moved(link, offset)
            links.append(link)
            waiting.append(child)
    if len(order) < len(elements):
        lost = [name for name in elements if name not in order]
        raise ValueError(f"{path}: links {lost} do not hang on {roots[0]!r}: a loop of joints")
    frames = {name: (i, Pose.identity()) for name, i in order.items()}
    return LinkTree(
        str(path), root.get("name", path.stem), links, frames, np.array(_GRAVITY), tuple(remarks)
    )


def _link(
    path: Path,
    name: str,
    element: ET.Element,
    parent: int,
    joint: ET.Element | None,
    bound: set[str | None],
    remarks: list[str],
) -> TreeLink:
    T = Pose.identity() if joint is None else _origin(joint, path)
    moves = None
    if joint is not None and joint.get("type") != "fixed":
        moves = _joint(joint, bound, path, remarks)
    return TreeLink(name, parent, T, T, moves, _inertial(element, name, path, remarks))


def _held_positions(joints: Iterable[ET.Element], path: Path) -> dict[str | None, float]:
    """Positions of joints that mimic others, where those others are at zero."""
    rules: dict[str | None, tuple[str | None, float, float]] = {}
    for joint in joints:
        if (mimic := joint.find("mimic")) is not None:
            where = f"mimic of joint {joint.get('name')!r}"
            filled = ET.Element("mimic", {"multiplier": "1", "offset": "0"} | mimic.attrib)
            (multiplier,) = _numbers(filled, "multiplier", 1, where, path)
            (offset,) = _numbers(filled, "offset", 1, where, path)
            rules[joint.get("name")] = (mimic.get("joint"), multiplier, offset)

    def position(name: str | None, depth: int = 0) -> float:
        if name not in rules:
            return 0.0
        if depth > len(rules):
            raise ValueError(f"{path}: joint {name!r} mimics itself through others")
        other, multiplier, offset = rules[name]
        return multiplier * position(other, depth + 1) + offset

    return {name: position(name) for name in rules}


def _moved(link: TreeLink, position: float) -> TreeLink:
    """The link held with its joint at another position than zero."""
    joint = link.joint
    if joint is None or joint.kind not in ("revolute", "prismatic"):
        return link
    slides = joint.kind == "prismatic"
    step = shift(position * joint.axis) if slides else about_axis(joint.axis, position)
    return dataclasses.replace(link, T_parent_held=link.T_parent_zero @ step)


def _joint(joint: ET.Element, bound: set[str | None], path: Path, remarks: list[str]) -> TreeJoint:
    name, kind = _text(joint, "name", "a joint", path), joint.get("type", "")
    axis = np.array([1.0, 0.0, 0.0])
    if (element := joint.find("axis")) is not None:
        axis = np.array(_numbers(element, "xyz", 3, f"axis of joint {name!r}", path))
    length = np.linalg.norm(axis)
    if not length > 0.0:
        raise ValueError(f"{path}: the axis of joint {name!r} is zero")
    limit = joint.find("limit")

    def stated(key: str, otherwise: float) -> float:
        if limit is None or limit.get(key) is None:
            return otherwise
        return _numbers(limit, key, 1, f"limit of joint {name!r}", path)[0]

    def greatest(key: str, what: str) -> float:
        """Zero stands for what is not known."""
        value = stated(key, np.inf)
        if value == 0.0:
            remarks.append(f"{what} of joint {name!r} is 0 and taken as not stated")
        return value or np.inf

    # limits of a continuous joint are those of speed and effort alone
    bounded = kind not in ("continuous", "floating")
    lower, upper = stated("lower", 0.0), stated("upper", 0.0)
    if bounded and lower > upper:
        raise ValueError(
            f"{path}: joint {name!r} has the limits {lower} to {upper}; expected lower below upper"
        )
    if bounded and lower == upper == 0.0:
        remarks.append(f"joint {name!r} states no range and is taken as unlimited")
        bounded = False
    coupled = "mimic" if joint.find("mimic") is not None or name in bound else ""
    return TreeJoint(
        name=name,
        kind=_KINDS.get(kind, kind or "of no type"),
        axis=np.where(abs(axis / length) < 1e-15, 0.0, axis / length),
        lower=lower if bounded else -np.inf,
        upper=upper if bounded else np.inf,
        velocity=greatest("velocity", "velocity"),
        torque=greatest("effort", "effort"),
        coupled=coupled,
    )


def _inertial(
    element: ET.Element, name: str, path: Path, remarks: list[str]
) -> InertialParameters | None:
    inertial = element.find("inertial")
    if inertial is None:
        return None
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is None or tensor is None:
        raise ValueError(f"{path}: the inertial element of link {name!r} lacks mass or inertia")
    where = f"inertial element of link {name!r}"
    upper = [_numbers(tensor, key, 1, where, path)[0] for key in _UPPER]
    (kg,) = _numbers(mass, "value", 1, where, path)
    if kg < 0.0:
        raise ValueError(f"{path}: the mass of link {name!r} is {kg} kg; expected zero or more")
    xx, xy, xz, yy, yz, zz = upper
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if moments[0] < 0.0 or moments[2] > (1.0 + 1e-6) * (moments[0] + moments[1]) + 1e-12:
        listed = ", ".join(f"{m:.4g}" for m in moments)
        remarks.append(f"no body has the principal moments {listed} kg m² of link {name!r}")
    return link_of(kg, [0.0, 0.0, 0.0], upper, _origin(inertial, path))


def _origin(element: ET.Element, path: Path) -> Pose:
    origin = element.find("origin")
    if origin is None:
        return Pose.identity()
    zeros = "0 0 0"
    where = f"origin of {element.get('name', element.tag)!r}"
    values = {key: origin.get(key, zeros) for key in ("xyz", "rpy")}
    filled = ET.Element("origin", values)
    return pose(*(_numbers(filled, key, 3, where, path) for key in ("xyz", "rpy")))


def _end(joint: ET.Element, kind: str, links: dict[str, ET.Element], path: Path) -> str:
    element = joint.find(kind)
    name = "" if element is None else element.get("link", "")
    if name not in links:
        raise ValueError(
            f"{path}: the {kind} of joint {joint.get('name')!r}, {name!r}, is no link of the file"
        )
    return name


def _text(element: ET.Element, key: str, what: str, path: Path) -> str:
    value = element.get(key)
    if not value:
        raise ValueError(f"{path}: {what} has no `{key}`")
    return value


def _numbers(element: ET.Element, key: str, count: int, what: str, path: Path) -> list[float]:
    text = element.get(key, "")
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        raise ValueError(f"{path}: `{key}` of the {what} is {text!r}; expected {count} number(s)")
    return values
