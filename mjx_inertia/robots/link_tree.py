"""A robot file as a tree of links.

In: what `mjcf_file.py` or `urdf_file.py` reads. Out: `LinkTree`, poses of its links while joints
are held, and the links as bodies with all that is fixed to them.
"""

import dataclasses
import difflib

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.robots.rigid_links import exact_pose, merge_links, transform_parameters
from mjx_inertia.spatial import InertialParameters, Pose


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
    coupled: str = ""  # name of the constraint that binds the joint to others; "" if none does
    shared_armature: str = ""  # name of what couples the joint's inertia to that of others


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
    # what the file states and the robot does not have, or what it states that cannot be
    remarks: tuple[str, ...] = ()


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


def ancestors_of(tree: LinkTree, k: int) -> list[int]:
    """A link and those before it, out to the root."""
    path = []
    while k >= 0:
        path.append(k)
        k = tree.links[k].parent
    return path


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
    return tidy_pose(T)


def pose_at_zero(tree: LinkTree, k: int, ancestor: int) -> Pose:
    """Link k in a link before it, with its own joint at zero and those on the way held."""
    return tidy_pose(held_pose(tree, tree.links[k].parent, ancestor) @ tree.links[k].T_parent_zero)


def carried_by(tree: LinkTree, i: int, owner: list[int]) -> InertialParameters:
    """Link i of the path with all that is fixed to it, in its frame."""
    parts = [
        transform_parameters(entry.inertial, held_pose(tree, k, i))
        for k, entry in enumerate(tree.links)
        if owner[k] == i and entry.inertial is not None
    ]
    whole = merge_links(parts)
    entry = tree.links[i]
    carries_mass = any(
        later.inertial is not None and i in ancestors_of(tree, k)
        for k, later in enumerate(tree.links)
    )
    if not (whole.mass > 0.0 or entry.weightless or carries_mass):
        raise ValueError(
            f"{tree.path}: link {entry.name!r} moves and has no mass; state its inertial parameters"
        )
    return whole


def tidy_pose(T: Pose) -> Pose:
    """The same pose in NumPy, with right angles made exact."""
    return exact_pose(np.asarray(T.rotation), np.asarray(T.translation))
