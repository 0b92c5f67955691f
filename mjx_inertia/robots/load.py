"""Any robot of an MJCF or URDF file, by path and the names of its hands.

In: a file. Out: `Robot`. `mjcf_file.py` and `urdf_file.py` read the file as a tree of links; here
the joints that belong to the robot are chosen. Links that are fixed join those that they are fixed
to. Joints that are left out (fingers, a second arm further out) are held at their reference
position, and what they carry joins the link that they hang on.
"""

import dataclasses
from pathlib import Path

import jax
import numpy as np

from mjx_inertia.files import read_xml
from mjx_inertia.robots.link_tree import (
    LinkTree,
    TreeJoint,
    ancestors_of,
    carried_by,
    held_pose,
    named_frame,
    owners,
    pose_at_zero,
    tidy_pose,
)
from mjx_inertia.robots.mjcf_file import read_mjcf_links
from mjx_inertia.robots.rigid_links import stacked_links, stacked_poses
from mjx_inertia.robots.robot import BASE, Robot
from mjx_inertia.robots.urdf_file import read_urdf_links
from mjx_inertia.spatial import Pose

_KINDS = ("revolute", "prismatic")
_PARALLEL = 1.0 - 1e-9  # cosine of two axes that are one
_WORLD = -1  # owner of a link that no joint moves


def load_robot(
    path: str | Path,
    end_effector: str | tuple[str, ...],
    base: str | None = None,
    T_hand: Pose | None = None,
    planar: bool = False,
    ignore_couplings: bool = False,
) -> Robot:
    """The robot whose hands are bodies, links or sites of a file.

    The base is fixed if `base` names it, or if a single hand hangs on no base that floats. Then the
    joints between base and hands are the robot's; `Robot.note` names those that are held (at
    MuJoCo's `qpos0`, zero in URDF). The world is that of the file: the root link of a URDF, with
    gravity along its -z.

    A base that floats is the body with a free joint (`floating` in URDF), or with two slides along
    x and y and a hinge about z, which makes a planar robot; `base="world"` (MJCF) takes these as
    three joints of a robot on a fixed base. All joints behind it are the
    robot's, its frame is the world's, and gravity is left out. Sizes for looks and clearance are
    not read: `robot.replace(radius=..., base_size=...)` sets them.

    Friction and springs are left out. A URDF's meshes are not needed.

    Args:
      path: of an MJCF or a URDF file.
      end_effector: name of a body or site (MJCF) or of a link (URDF); a tuple of several hands.
      base: name of the link or body from which on joints belong to a robot on a fixed base; all of
        them if None. Joints before it are held.
      T_hand: the hands' frames in those of the end effectors; the same frames if None.
      planar: take a base with a free joint as one that moves in its plane z = 0 only.
      ignore_couplings: take joints that `mimic` others (URDF) or that an equality binds (MJCF) as
        independent, as the mass matrices of Pinocchio and MuJoCo do; `Robot.note` names them.

    Raises:
      ValueError: the file is not XML of either kind, a name is not in it, no joint moves a hand, a
        joint is ball, planar or coupled, several bases float or none of a robot with several
        hands, a planar robot has joints out of its plane, or a moving link has no mass; each by its
        name.
      FileNotFoundError: there is no such file.
    """
    tree = _uncoupled(_read(Path(path))) if ignore_couplings else _read(Path(path))
    names = (end_effector,) if isinstance(end_effector, str) else tuple(end_effector)
    if len(set(names)) < max(len(names), 1):
        raise ValueError(f"`end_effector` is {names}: name each hand once")
    ends = [named_frame(tree, "end_effector", name) for name in names]
    root, flat = _WORLD, False
    if floats := base is None and (len(names) > 1 or _hangs_on_floating_base(tree, ends[0][0])):
        root, flat = _floating_base(tree)
        below = [i for i in range(len(tree.links)) if root in ancestors_of(tree, i)]
        moving = [i for i in below if i != root and tree.links[i].joint is not None]
    else:
        moving = _between(tree, names, [link for link, _ in ends], base)
    robot = _robot(tree, names, ends, moving, root, T_hand or Pose.identity())
    bodies = (robot.T_parent_joint, robot.T_link_hand, robot.links, robot.base, robot.armature)
    if not all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(bodies)):
        raise ValueError(f"{tree.path}: a position, mass or inertia is not a finite number")
    if not np.all(robot.lower <= robot.upper):  # NaN compares with nothing
        raise ValueError(f"{tree.path}: a joint's limits {robot.lower}, {robot.upper} are no range")
    if planar and not floats:
        raise ValueError(f"{tree.path}: `planar` is of a base that floats, and this one is fixed")
    if planar or flat:
        _check_planar(tree, robot)
    return robot.replace(planar=planar or flat)


def _read(path: Path) -> LinkTree:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected an MJCF or URDF file")
    root = read_xml(path)
    if root.tag not in ("robot", "mujoco"):
        raise ValueError(
            f"{path}: the root element is <{root.tag}>; expected <robot> (URDF) or <mujoco> (MJCF)"
        )
    return read_urdf_links(path, root) if root.tag == "robot" else read_mjcf_links(path, root)


def _uncoupled(tree: LinkTree) -> LinkTree:
    """The tree without equalities and `mimic`; a note names the joints."""
    names = [link.joint.name for link in tree.links if link.joint and link.joint.coupled]
    links = [
        dataclasses.replace(link, joint=dataclasses.replace(link.joint, coupled=""))
        if link.joint
        else link
        for link in tree.links
    ]
    remarks = [f"coupled in the file, independent here: {', '.join(names)}"] if names else []
    return dataclasses.replace(tree, links=links, remarks=(*tree.remarks, *remarks))


def _robot(
    tree: LinkTree,
    names: tuple[str, ...],
    ends: list[tuple[int, Pose]],
    moving: list[int],
    root: int,
    T_hand: Pose,
) -> Robot:
    """The robot of some joints.

    Args:
      tree: the file.
      names: of the hands.
      ends: links of the hands, and their frames in them.
      moving: links that the robot's joints move, each after those before it.
      root: link of a base that floats; `_WORLD` if the base is fixed.
      T_hand: the hands' frames in those of the end effectors.
    """
    free = root != _WORLD
    joints = [_checked(tree, i) for i in moving]
    owner = owners(tree, [root, *moving])
    for name, (link, _) in zip(names, ends, strict=True):
        if owner[link] not in moving:
            raise ValueError(
                f"{tree.path}: no joint moves {name!r}; choose a frame that one of the robot's "
                "joints moves"
            )
    number = {link: k for k, link in enumerate(moving)} | {root: BASE}
    # the base is what the first joint hangs on, unless other joints hang elsewhere
    befores = [owner[tree.links[i].parent] for i in moving]
    first = tree.links[moving[0]].parent if befores.count(root) == 1 and not free else root
    placed = [
        pose_at_zero(tree, i, first if before == root else before)
        for i, before in zip(moving, befores, strict=True)
    ]
    hands = [tidy_pose(held_pose(tree, link, owner[link]) @ T_end @ T_hand) for link, T_end in ends]
    return Robot(
        T_parent_joint=stacked_poses(placed),
        axis=np.array([j.axis for j in joints]),
        links=stacked_links([carried_by(tree, i, owner) for i in moving]),
        armature=np.array([j.armature for j in joints]),
        lower=np.array([j.lower for j in joints]),
        upper=np.array([j.upper for j in joints]),
        velocity_limit=np.array([j.velocity for j in joints]),
        torque_limit=np.array([j.torque for j in joints]),
        T_link_hand=stacked_poses(hands),
        T_world_base=Pose.identity() if free else held_pose(tree, first),
        gravity=np.zeros(3) if free else tree.gravity,
        base=carried_by(tree, root, owner) if free else None,
        parents=tuple(number[before] for before in befores),
        hands=tuple(number[owner[link]] for link, _ in ends),
        prismatic=tuple(j.kind == "prismatic" for j in joints),
        radius=0.1 if free else 0.05,
        name=tree.name,
        joint_names=tuple(j.name for j in joints),
        note=_note(tree, owner, moving),
    )


def _between(
    tree: LinkTree, names: tuple[str, ...], ends: list[int], base: str | None
) -> list[int]:
    """Links that joints between a fixed base and the hands move."""
    start = _WORLD if base is None else named_frame(tree, "base", base)[0]
    moving: set[int] = set()
    for name, end in zip(names, ends, strict=True):
        path = ancestors_of(tree, end)
        if start != _WORLD and start not in path:
            raise ValueError(
                f"{tree.path}: `base` {base!r} is not before {name!r} on its path; "
                f"before it are {', '.join(tree.links[k].name for k in reversed(path))}"
            )
        path = path[: path.index(start)] if start != _WORLD else path
        own = [k for k in path if tree.links[k].joint is not None]
        if not own:
            raise ValueError(f"{tree.path}: no joint moves {name!r}; choose another frame")
        moving.update(own)
    return sorted(moving)


def _hangs_on_floating_base(tree: LinkTree, link: int) -> bool:
    path = ancestors_of(tree, link)
    joints = [tree.links[i].joint for i in path]
    return any(joint is not None and joint.kind == "free" for joint in joints) or any(
        _ends_planar_base(tree, i) for i in path
    )


def _floating_base(tree: LinkTree) -> tuple[int, bool]:
    """The link of the base, and whether it moves in a plane only."""
    free = [i for i, link in enumerate(tree.links) if link.joint and link.joint.kind == "free"]
    flat = [i for i in range(2, len(tree.links)) if _ends_planar_base(tree, i)]
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
            "and y and a hinge about z, or name a fixed `base`"
        )
    for i in roots:
        joint = tree.links[i].joint
        assert joint is not None
        if joint.coupled:
            raise ValueError(
                f"{tree.path}: the base {tree.links[i].name!r} is bound by {joint.coupled}; take "
                "it out of the file, or name a fixed `base`"
            )
    return roots[0], bool(flat)


def _ends_planar_base(tree: LinkTree, i: int) -> bool:
    """Whether a link is behind two slides and a hinge across both of a body on the world."""
    chain = [tree.links[k] for k in (i - 2, i - 1, i)]
    in_line = chain[1].parent == i - 2 and chain[2].parent == i - 1
    if not in_line or len({link.name for link in chain}) > 1:
        return False
    if any(tree.links[k].joint is not None for k in ancestors_of(tree, chain[0].parent)):
        return False
    joints = [link.joint for link in chain if link.joint is not None]
    slides = [j.axis for j in joints if j.kind == "prismatic"]
    hinges = [j.axis for j in joints if j.kind == "revolute"]
    if len(slides) != 2 or len(hinges) != 1:
        return False
    normal = np.cross(slides[0], slides[1])
    return bool(min(abs(normal[2]), abs(hinges[0][2])) > _PARALLEL)


def _checked(tree: LinkTree, i: int) -> TreeJoint:
    joint = tree.links[i].joint
    assert joint is not None
    if joint.kind not in _KINDS:
        raise ValueError(
            f"{tree.path}: joint {joint.name!r} is {joint.kind}, and a robot has revolute and "
            "prismatic joints; write a ball joint as three hinges, or give a `base` behind it"
        )
    if joint.coupled or joint.shared_armature:
        remedy = ", or pass `ignore_couplings=True`" if not joint.shared_armature else ""
        by = joint.shared_armature or joint.coupled
        raise ValueError(
            f"{tree.path}: joint {joint.name!r} is coupled to others by {by}, and all joints of a "
            f"robot are independent; take the coupling out of the file{remedy}"
        )
    return joint


def _check_planar(tree: LinkTree, robot: Robot) -> None:
    turns: list[np.ndarray] = []
    for i, parent in enumerate(robot.parents):
        before = np.eye(3) if parent == BASE else turns[parent]
        turns.append(before @ robot.T_parent_joint.rotation[i])
        axis = turns[i] @ robot.axis[i]
        leaves = abs(axis[2]) if robot.prismatic[i] else np.hypot(axis[0], axis[1])
        if leaves > 1e-9:
            raise ValueError(
                f"{tree.path}: joint {robot.joint_names[i]!r} moves its link out of the plane "
                "z = 0 of the base, and the robot is planar; give the base a free joint and leave "
                "`planar` False, or name a fixed `base`, such as 'world'"
            )


def _note(tree: LinkTree, owner: list[int], moving: list[int]) -> str:
    held = [
        entry.joint.name
        for k, entry in enumerate(tree.links)
        if entry.joint is not None and owner[k] in moving and k not in moving
    ]
    remarks = [f"held at their reference position: {', '.join(held)}"] if held else []
    return "; ".join([f"From {tree.path}", *remarks, *tree.remarks]) + "."
