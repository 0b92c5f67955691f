"""Any free-floating robot with two hands, from an MJCF file.

In: a path and the names of two hands. Out: `SpaceRobot`. The file's tree, with bodies that are
fixed to others merged into them, is what `robots` reads of any arm.
"""

from pathlib import Path

import numpy as np

from mjx_inertia.robots.link_tree import (
    KINDS,
    LinkTree,
    TreeJoint,
    carried_by,
    held_pose,
    named_frame,
    owners,
    pose_at_zero,
)
from mjx_inertia.robots.mjcf_file import read_mjcf_links
from mjx_inertia.robots.rigid_links import stacked_links
from mjx_inertia.space.robot import BASE, SpaceRobot, stacked_poses

_ALONG = 1.0 - 1e-9  # of an axis on another


def load_space_robot(path: str | Path, hands: tuple[str, str], planar: bool = False) -> SpaceRobot:
    """The one robot of a file that floats freely, with all its joints.

    Its base is the body with a free joint, or with two slides and a hinge across both, which makes
    a planar robot. Gravity, friction, springs and what does not hang on the base are left out.
    The frame of the base is the world's, wherever the file has it. Sizes for looks and clearance
    are not read: `robot.replace(radius=..., base_size=...)` sets them.

    Args:
      path: of an MJCF file.
      hands: names of two bodies or sites.
      planar: take a robot with a free joint as one that moves in the plane z = 0 of its base only.

    Raises:
      ValueError: no base that floats or several, a name that is not in the file, a hand that no
        joint moves, joints that are not hinges or slides or that are coupled, a planar robot with
        joints out of its plane, a moving link without mass; each by its name.
      FileNotFoundError: there is no such file.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected an MJCF file")
    if len(hands) != 2 or hands[0] == hands[1]:
        raise ValueError(f"`hands` is {hands}: name two, one for each side of the object")
    tree = read_mjcf_links(path)
    base, in_plane = _base(tree)
    below = _below(tree, base)
    moving = [i for i in below if i != base and tree.links[i].joint is not None]
    joints = [_checked(tree, i) for i in moving]
    owner = owners(tree, [base, *moving])
    number = {link: k for k, link in enumerate(moving)} | {base: BASE}
    befores = [owner[tree.links[i].parent] for i in moving]
    placed = [pose_at_zero(tree, i, before) for i, before in zip(moving, befores, strict=True)]
    carried, T_link_hand = [], []
    for name in hands:
        link, T = named_frame(tree, "hands", name)
        if owner[link] not in moving:
            raise ValueError(
                f"{tree.path}: no joint of the floating robot moves the hand {name!r}; name a body "
                "or site behind one"
            )
        carried.append(number[owner[link]])
        T_link_hand.append(held_pose(tree, link, owner[link]) @ T)
    robot = SpaceRobot(
        base=carried_by(tree, base, owner),
        T_parent_joint=stacked_poses(placed),
        axis=np.array([j.axis for j in joints]),
        links=stacked_links([carried_by(tree, i, owner) for i in moving]),
        armature=np.array([j.armature for j in joints]),
        lower=np.array([j.lower for j in joints]),
        upper=np.array([j.upper for j in joints]),
        T_link_hand=stacked_poses(T_link_hand),
        parents=tuple(number[before] for before in befores),
        hands=(carried[0], carried[1]),
        prismatic=tuple(j.kind == "prismatic" for j in joints),
        planar=planar or in_plane,
        name=tree.name,
        joint_names=tuple(j.name for j in joints),
    )
    if robot.planar:
        _check_planar(tree, robot)
    return robot


def _base(tree: LinkTree) -> tuple[int, bool]:
    """The link of the base, and whether it moves in a plane only."""
    free = [i for i, link in enumerate(tree.links) if link.joint and link.joint.kind == "free"]
    flat = _planar_bases(tree)
    roots = free + flat
    if len(roots) > 1:
        names = ", ".join(tree.links[i].name for i in roots)
        raise ValueError(
            f"{tree.path}: several bodies float freely ({names}), and a robot has one base; take "
            "the others out of the file"
        )
    if not roots:
        raise ValueError(
            f"{tree.path}: no body floats freely; give the base a free joint, or slides along x "
            "and y and a hinge about z"
        )
    return roots[0], bool(flat)


def _planar_bases(tree: LinkTree) -> list[int]:
    """Links behind two slides and a hinge across both of one body that hangs on the world."""
    last = []
    for i in range(2, len(tree.links)):
        chain = [tree.links[k] for k in (i - 2, i - 1, i)]
        joints = [link.joint for link in chain]
        of_world = not _moved(tree, chain[0].parent)
        in_line = chain[1].parent == i - 2 and chain[2].parent == i - 1
        if not (of_world and in_line and len({link.name for link in chain}) == 1):
            continue
        slides = [j.axis for j in joints if j and j.kind == "prismatic"]
        hinges = [j.axis for j in joints if j and j.kind == "revolute"]
        if len(slides) == 2 and len(hinges) == 1:
            across = np.cross(slides[0], slides[1])
            square = abs(np.linalg.norm(across)) > _ALONG
            upright = abs(hinges[0][2]) > _ALONG and abs(across[2]) > _ALONG
            if square and upright:
                last.append(i)
    return last


def _moved(tree: LinkTree, i: int) -> bool:
    """Whether a joint moves a link."""
    while i >= 0:
        if tree.links[i].joint is not None:
            return True
        i = tree.links[i].parent
    return False


def _below(tree: LinkTree, base: int) -> list[int]:
    """A link and all that hang on it."""
    found = [base]
    for i in range(base + 1, len(tree.links)):
        if tree.links[i].parent in found:
            found.append(i)
    return found


def _checked(tree: LinkTree, i: int) -> TreeJoint:
    joint = tree.links[i].joint
    assert joint is not None
    if joint.kind not in KINDS:
        raise ValueError(
            f"{tree.path}: joint {joint.name!r} is {joint.kind}, and a space robot has hinges and "
            "slides; write a ball joint as three hinges"
        )
    if joint.coupled:
        raise ValueError(
            f"{tree.path}: joint {joint.name!r} is coupled to others by {joint.coupled}, and all "
            "joints of a space robot are independent; take the coupling out of the file"
        )
    return joint


def _check_planar(tree: LinkTree, robot: SpaceRobot) -> None:
    turns: list[np.ndarray] = []
    for i, parent in enumerate(robot.parents):
        before = np.eye(3) if parent == BASE else turns[parent]
        turns.append(before @ robot.T_parent_joint.rotation[i])
        axis = turns[i] @ robot.axis[i]
        leaves = abs(axis[2]) if robot.prismatic[i] else np.hypot(axis[0], axis[1])
        if leaves > 1e-9:
            name = robot.joint_names[i]
            raise ValueError(
                f"{tree.path}: joint {name!r} moves its link out of the plane z = 0 of the base, "
                "and the robot is planar; give the base a free joint and leave `planar` False"
            )
