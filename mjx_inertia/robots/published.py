"""Arms with published figures: Rethink Baxter and Schunk LWA4D.

In: which side, hand and set of inertias. Out: `Robot`, in double precision. The figures and their
sources are in `baxter.yaml` and `lwa4d.yaml`; what is an estimate is said in `Robot.note`.
"""

from importlib import resources
from typing import Any

import numpy as np
import yaml

from mjx_inertia.robots.rigid_links import (
    cuboid_parameters,
    link_parameters,
    merge_links,
    printed_pose,
    shift,
    stacked_links,
    stacked_poses,
    transform_parameters,
)
from mjx_inertia.robots.robot import BASE, Robot
from mjx_inertia.spatial import InertialParameters, Pose

_GRAVITY = (0.0, 0.0, -9.81)
_UPPER = ("mass", "com", "inertia")


def baxter(side: str = "left", hand: str = "electric_gripper") -> Robot:
    """One arm of a Rethink Baxter; the world is the robot's torso frame.

    Args:
      side: "left" or "right".
      hand: "electric_gripper": the hand's frame is `gripper` of the source, at the finger tips, z
        out of the palm and the fingers closing along y; the gripper's published mass of 0.36 kg is
        part of the last link. "bare": the frame of the flange, `hand` of the source.

    Raises:
      ValueError: another side or hand.
    """
    _one_of("side", side, ("left", "right"))
    _one_of("hand", hand, ("electric_gripper", "bare"))
    figures = _figures("baxter.yaml")
    flange = figures["flange"]
    T_link_flange = printed_pose(flange["xyz"], flange["rpy"])
    links = [_link(joint["link"]) for joint in figures["joints"]]
    carried, T_flange_hand = [_link(flange["link"])], Pose(np.eye(3), np.zeros(3))
    note = "s1: 50 N m, as in the source; the real arm's springs on s1 are not modelled."
    if hand == "electric_gripper":
        gripper = figures["electric_gripper"]
        bodies, T_flange_hand = _electric_gripper(gripper)
        carried += bodies
        note += " The gripper's mass is published; its CoM and tensor are those of simple solids."
    links[-1] = merge_links(
        [links[-1], *(transform_parameters(body, T_link_flange) for body in carried)]
    )
    mount = figures["mounts"][side]
    return _arm(
        figures["joints"],
        links,
        T_world_base=printed_pose(mount["xyz"], mount["rpy"]),
        T_link_hand=T_link_flange @ T_flange_hand,
        name=f"baxter_{side}",
        prefix=f"{side}_",
        note=note,
    )


def lwa4d(inertia: str = "mesh_estimate", hand: str = "flange") -> Robot:
    """A Schunk LWA4D with its base frame (`arm_base_link`) as the world.

    Its link inertias are *not published*: both sets are estimates (see `Robot.note`).

    Args:
      inertia: "mesh_estimate": link meshes of uniform density with the module masses of the
        source's history, 14.35 kg; "upstream_commented": cylinders and spheres from comments in the
        source, 11.95 kg.
      hand: "flange": the frame `arm_ee_link`, without mass. "parallel_jaw": a stand-in of 1.2 kg
        (a cuboid body and two fingers); the hand's frame is at the finger tips, 0.18 m from the
        flange, z out of the palm and the fingers closing along y.

    Raises:
      ValueError: another set or hand.
    """
    figures = _figures("lwa4d.yaml")
    _one_of("inertia", inertia, tuple(figures["inertias"]))
    _one_of("hand", hand, ("flange", "parallel_jaw"))
    T_link_hand = printed_pose(figures["flange"]["xyz"], figures["flange"]["rpy"])
    links = [_link(entry) for entry in figures["inertias"][inertia]]
    note = (
        "Link inertias are not published. "
        + {
            "mesh_estimate": "Here: our estimate from uniform link meshes and module masses.",
            "upstream_commented": "Here: guesses left as comments in the source, moved by us.",
        }[inertia]
    )
    if hand == "parallel_jaw":
        bodies, T_flange_hand = _parallel_jaw(figures["parallel_jaw"])
        links[-1] = merge_links(
            [links[-1], *(transform_parameters(body, T_link_hand) for body in bodies)]
        )
        T_link_hand = T_link_hand @ T_flange_hand
        note += " The parallel jaw is a stand-in of ours, not a product."
    return _arm(
        figures["joints"],
        links,
        T_world_base=Pose(np.eye(3), np.zeros(3)),
        T_link_hand=T_link_hand,
        name="lwa4d",
        prefix="",
        note=note,
    )


def _figures(name: str) -> Any:
    return yaml.safe_load(resources.files("mjx_inertia.robots").joinpath(name).read_text())


def _link(entry: dict[str, Any]) -> InertialParameters:
    return link_parameters(*(entry[key] for key in _UPPER))


def _one_of(argument: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ValueError(f"`{argument}` {value!r} is not known; give one of {', '.join(known)}")


def _electric_gripper(figures: dict[str, Any]) -> tuple[list[InertialParameters], Pose]:
    """Body and fingers in the flange, and the hand there."""
    base, finger = figures["base"], figures["finger"]
    fingers_z = base["z"] + figures["finger_joint_z"]
    body = cuboid_parameters(
        base["mass"], [*figures["body_footprint"], fingers_z], [0.0, 0.0, fingers_z / 2]
    )
    fingers = _fingers(finger, figures["finger_y"], fingers_z)
    return [body, *fingers], shift(np.array([0.0, 0.0, base["z"] + figures["tip_z"]]))


def _parallel_jaw(figures: dict[str, Any]) -> tuple[list[InertialParameters], Pose]:
    body, finger = figures["body"], figures["finger"]
    height = body["size"][2]
    solid = cuboid_parameters(body["mass"], body["size"], [0.0, 0.0, height / 2])
    tips = shift(np.array([0.0, 0.0, height + finger["length"]]))
    return [solid, *_fingers(finger, figures["finger_y"], height)], tips


def _fingers(finger: dict[str, float], y: float, z: float) -> list[InertialParameters]:
    """Two rods that begin at height z."""
    size, middle = [0.0, 0.0, finger["length"]], z + finger["length"] / 2
    return [
        cuboid_parameters(finger["mass"], size, [0.0, side * y, middle]) for side in (1.0, -1.0)
    ]


def _arm(
    joints: list[dict[str, Any]],
    links: list[InertialParameters],
    *,
    T_world_base: Pose,
    T_link_hand: Pose,
    name: str,
    prefix: str,
    note: str,
) -> Robot:
    def limit(key: str) -> np.ndarray:
        return np.array([joint["limits"][key] for joint in joints], np.float64)

    return Robot(
        T_world_base=T_world_base,
        T_parent_joint=stacked_poses(
            [printed_pose(joint["xyz"], joint["rpy"]) for joint in joints]
        ),
        axis=np.array([joint["axis"] for joint in joints], np.float64),
        links=stacked_links(links),
        armature=np.zeros(len(joints)),
        lower=limit("lower"),
        upper=limit("upper"),
        velocity_limit=limit("velocity"),
        torque_limit=limit("torque"),
        T_link_hand=stacked_poses([T_link_hand]),
        gravity=np.array(_GRAVITY),
        parents=(BASE, *range(len(joints) - 1)),
        hands=(len(joints) - 1,),
        prismatic=(False,) * len(joints),
        name=name,
        joint_names=tuple(prefix + joint["name"] for joint in joints),
        note=note,
    )
