"""A robot file as a tree of links, and the arm that one path through it makes.

In: `LinkTree` from `urdf_file.py` or `mjcf_file.py`. Out: `Arm`. Fixed links join those that they
are fixed to. Joints beside the path (fingers, a second arm further out) are held at their reference
position, and what they carry joins the link of the path that they hang on.
"""

import dataclasses
import difflib

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.robots.arm import Arm
from mjx_inertia.robots.rigid_links import (
    exact_pose,
    merge_links,
    stacked_links,
    transform_parameters,
)
from mjx_inertia.spatial import InertialParameters, Pose

KINDS = ("revolute", "prismatic")


@dataclasses.dataclass(frozen=True)
class TreeJoint:
    """How a link moves against its parent."""

    name: str  # of the joint
    kind: str  # "revolute", "prismatic", or what else the file calls it
    axis: Float[ndarray, "3"]  # unit vector in the link's frame
    lower: float = -np.inf  # rad or m; minus infinity without a limit
    upper: float = np.inf  # rad or m; infinite without a limit
    velocity: float = np.inf  # greatest speed; infinite if not stated
    torque: float = np.inf  # greatest torque or force; infinite if not stated
    armature: float = 0.0  # inertia of the drive, kg m² or kg
    coupled: str = ""  # name of what binds the joint to others; "" if nothing does


@dataclasses.dataclass(frozen=True)
class TreeLink:
    """A link of a tree."""

    name: str  # of the link
    parent: int  # index of the link before; -1 for a root
    T_parent_zero: Pose  # the link in its parent with the joint at position zero
    T_parent_held: Pose  # the same with the joint held at its reference position
    joint: TreeJoint | None  # that moves it; None if it is fixed
    inertial: InertialParameters | None  # in the link's frame; None if the file states none
    # may weigh nothing though it moves (one of several joints of one body)
    weightless: bool = False


@dataclasses.dataclass(frozen=True)
class LinkTree:
    """A robot file."""

    path: str  # of the file, for messages
    name: str  # of the robot
    links: list[TreeLink]  # each after its parent
    # every name that an end effector or a base may have: the link and the frame in it
    frames: dict[str, tuple[int, Pose]]
    gravity: Float[ndarray, "3"]  # m/s², in the world


def arm_on_path(tree: LinkTree, end_effector: str, base: str | None, T_hand: Pose) -> Arm:
    """The arm from `base` (the root if None) to a named frame.

    Raises:
      ValueError: a name that the file does not know, a path without joints, a joint that an arm
        cannot have, or a moving link without inertia; each by its name.
    """
    end, T_end = named_frame(tree, "end_effector", end_effector)
    moving = _moving_joints(tree, end, end_effector, base)
    owner = owners(tree, moving)
    joints = [joint for i in moving if (joint := tree.links[i].joint)]
    befores = [tree.links[moving[0]].parent, *moving]
    poses = [pose_at_zero(tree, i, before) for before, i in zip(befores, moving, strict=False)]
    return Arm(
        T_world_base=held_pose(tree, befores[0]),
        T_parent_joint=Pose(
            np.stack([p.rotation for p in poses]), np.stack([p.translation for p in poses])
        ),
        axis=np.stack([j.axis for j in joints]),
        links=stacked_links([carried_by(tree, i, owner) for i in moving]),
        armature=np.array([j.armature for j in joints]),
        lower=np.array([j.lower for j in joints]),
        upper=np.array([j.upper for j in joints]),
        velocity_limit=np.array([j.velocity for j in joints]),
        torque_limit=np.array([j.torque for j in joints]),
        T_link_hand=_tidy(held_pose(tree, end, moving[-1]) @ T_end @ T_hand),
        gravity=tree.gravity,
        prismatic=tuple(j.kind == "prismatic" for j in joints),
        name=tree.name,
        joint_names=tuple(j.name for j in joints),
        note=_note(tree, owner, moving),
    )


def named_frame(tree: LinkTree, argument: str, name: str) -> tuple[int, Pose]:
    """The link of a named frame, and the frame in it.

    Raises:
      ValueError: no such name, with those that are like it; `argument` is where it was given.
    """
    if name in tree.frames:
        return tree.frames[name]
    close = difflib.get_close_matches(name, tree.frames, n=5, cutoff=0.4)
    known = close or sorted(tree.frames)[:20]
    raise ValueError(
        f"{tree.path}: `{argument}` {name!r} is no body, link or site of this file; "
        f"{'did you mean' if close else 'it has'} {', '.join(known)}?"
    )


def _moving_joints(tree: LinkTree, end: int, end_effector: str, base: str | None) -> list[int]:
    """Links that joints between `base` and the end effector move, from the base on."""
    start = -1 if base is None else named_frame(tree, "base", base)[0]
    path, i = [], end
    while i not in (start, -1):
        path.append(i)
        i = tree.links[i].parent
    if i != start:
        raise ValueError(
            f"{tree.path}: `base` {base!r} is not before {end_effector!r} on its path; "
            f"before it are {', '.join(tree.links[k].name for k in reversed(path))}"
        )
    moving = [k for k in reversed(path) if tree.links[k].joint is not None]
    if not moving:
        raise ValueError(f"{tree.path}: no joint moves {end_effector!r}; choose another frame")
    for k in moving:
        _check_joint(tree, tree.links[k].joint)
    return moving


def _check_joint(tree: LinkTree, joint: TreeJoint | None) -> None:
    if joint is None:
        return
    if joint.kind not in KINDS:
        raise ValueError(
            f"{tree.path}: joint {joint.name!r} on the path is {joint.kind}, and an arm has "
            "revolute and prismatic joints; give a `base` behind it"
        )
    if joint.coupled:
        raise ValueError(
            f"{tree.path}: joint {joint.name!r} on the path is coupled to others by "
            f"{joint.coupled}, which an arm of independent joints cannot follow"
        )


def owners(tree: LinkTree, moving: list[int]) -> list[int]:
    """For each link the last joint of the path before it; -1 for what is fixed to the base."""
    owner: list[int] = []
    for k, entry in enumerate(tree.links):
        owner.append(k if k in moving else -1 if entry.parent < 0 else owner[entry.parent])
    return owner


def held_pose(tree: LinkTree, k: int, ancestor: int = -1) -> Pose:
    """Link k in a link before it (the world if -1), with the joints on the way held."""
    T = Pose.identity()
    while k != ancestor:
        T = tree.links[k].T_parent_held @ T
        k = tree.links[k].parent
    return _tidy(T)


def pose_at_zero(tree: LinkTree, k: int, ancestor: int) -> Pose:
    """Link k in a link before it, with its own joint at zero and those on the way held."""
    return _tidy(held_pose(tree, tree.links[k].parent, ancestor) @ tree.links[k].T_parent_zero)


def carried_by(tree: LinkTree, i: int, owner: list[int]) -> InertialParameters:
    """Link i of the path with all that is fixed to it, in its frame."""
    parts = [
        transform_parameters(entry.inertial, held_pose(tree, k, i))
        for k, entry in enumerate(tree.links)
        if owner[k] == i and entry.inertial is not None
    ]
    whole = merge_links(parts)
    entry = tree.links[i]
    if not (whole.mass > 0.0 or entry.weightless):
        raise ValueError(
            f"{tree.path}: link {entry.name!r} moves and has no mass; state its inertial parameters"
        )
    return whole


def _note(tree: LinkTree, owner: list[int], moving: list[int]) -> str:
    held = [
        entry.joint.name
        for k, entry in enumerate(tree.links)
        if entry.joint is not None and owner[k] >= 0 and k not in moving
    ]
    if not held:
        return f"From {tree.path}."
    return f"From {tree.path}; held at their reference position: {', '.join(held)}."


def _tidy(T: Pose) -> Pose:
    return exact_pose(np.asarray(T.rotation), np.asarray(T.translation))
