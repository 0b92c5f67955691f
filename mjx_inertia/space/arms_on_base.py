"""Space robots made of arms on a base, and a servicing satellite with two Schunk LWA4D.

In: inertia of a base, two arms on fixed bases, where they are mounted. Out: `Robot`. The satellite
and the object it captures are of our making: a bus of a small servicer's size and mass, an object
that no plane of symmetry makes easy.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.robots import BASE, Robot, lwa4d
from mjx_inertia.robots.mjcf import SIDES
from mjx_inertia.robots.rigid_links import (
    cuboid_parameters,
    merge_links,
    pose,
    stacked_links,
    stacked_poses,
)
from mjx_inertia.robots.robot import joint_names
from mjx_inertia.space.capture import Capture
from mjx_inertia.spatial import InertialParameters, Pose, inertial_float64

_BUS_MASS, _BUS_EDGE = 150.0, 1.0  # kg, m
_SHOULDER_Y = 0.35  # m
_HALF_WIDTH = 0.25  # m: of the captured object, from its frame to each hand
# both arms, elbows outward, near holding the captured object 0.7 m in front of the bus
SERVICER_READY = np.tile([0.0, 0.74, 0.0, -1.57, 0.0, -0.74, 0.0], 2)
SERVICER_READY[[0, 7]] = -1.57, 1.57
# one joint of the left arm leads too: the matrix of the six that follow then stays regular
SERVICER_LEADING = (0, 1, 2, 3, 4, 5, 6, 11)


def with_arms(
    base: InertialParameters,
    base_size: tuple[float, float, float],
    arms: tuple[Robot, Robot],
    mounts: tuple[Pose, Pose],
    name: str = "",
) -> Robot:
    """A base with two arms: joints of the first, `right_...`, then of the second, `left_...`.

    Args:
      base: inertia of the base in its frame.
      base_size: edges of its box, m.
      arms: of any robots; their payloads are part of their last links, their gravity is ignored.
      mounts: T_base_world of each arm: its world in the base.
      name: of the robot.
    """
    poses, links, parents, hands, names = [], [], [], [], []
    for side, arm, mount in zip(SIDES, arms, mounts, strict=True):
        first = len(parents)
        T_base_arm = mount @ arm.T_world_base
        for i, before in enumerate(arm.parents):
            T = arm.T_parent_joint[i]
            poses.append(T_base_arm @ T if before == BASE else T)
        links += _links(arm)
        parents += [before if before == BASE else first + before for before in arm.parents]
        hands.append(first + arm.hands[0])
        names += [f"{side}_{joint}" for joint in joint_names(arm)]

    def both(field: str) -> Float[ndarray, "n ..."]:
        return np.concatenate([np.asarray(getattr(arm, field)) for arm in arms])

    return Robot(
        base=base,
        T_parent_joint=stacked_poses(poses),
        axis=both("axis"),
        links=stacked_links(links),
        armature=both("armature"),
        lower=both("lower"),
        upper=both("upper"),
        velocity_limit=both("velocity_limit"),
        torque_limit=both("torque_limit"),
        T_link_hand=stacked_poses([arm.T_link_hand[0] for arm in arms]),
        T_world_base=Pose.identity(),
        gravity=np.zeros(3),
        parents=tuple(parents),
        hands=tuple(hands),
        prismatic=arms[0].prismatic + arms[1].prismatic,
        base_size=base_size,
        name=name,
        joint_names=tuple(names),
    )


def servicer() -> Robot:
    """A cube of 1 m and 150 kg with two LWA4D on its front, which looks along x; z is up.

    The link inertias of the LWA4D are estimates, see `robots.lwa4d`.
    """
    edges = _BUS_EDGE, _BUS_EDGE, _BUS_EDGE
    bus = cuboid_parameters(_BUS_MASS, edges, (0.0, 0.0, 0.0))
    arm = lwa4d()
    # an arm stands along z of its world: that is x of the bus
    mounts = [
        pose((_BUS_EDGE / 2.0, side * _SHOULDER_Y, 0.0), (0.0, np.pi / 2.0, 0.0))
        for side in (-1.0, 1.0)
    ]
    return with_arms(bus, edges, (arm, arm), (mounts[0], mounts[1]), "servicer")


def servicer_capture() -> Capture:
    """An object of 12 kg in the servicer's hands: 0.5 m between them, along y of its frame.

    Its CoM lies beside the line between the hands; its principal axes are those of no hand.
    """
    inertia = np.array([[0.62, 0.05, -0.04], [0.05, 0.48, 0.07], [-0.04, 0.07, 0.71]])
    # a hand's z points into the object: along y for the right hand, against it for the left
    turns = [pose((0.0, 0.0, 0.0), (angle, 0.0, 0.0)) for angle in (-np.pi / 2.0, np.pi / 2.0)]
    T_obj_hand = [
        Pose(turn.rotation, np.array([0.0, side * _HALF_WIDTH, 0.0]))
        for turn, side in zip(turns, (-1.0, 1.0), strict=True)
    ]
    return Capture(
        inertial=inertial_float64(12.0, (0.06, 0.03, -0.05), inertia),
        T_hand_obj=stacked_poses([T.inverse() for T in T_obj_hand]),
        radius=0.3,
    )


def _links(arm: Robot) -> list[InertialParameters]:
    links = [
        InertialParameters(arm.links.mass[i], arm.links.com[i], arm.links.inertia[i])
        for i in range(arm.dof)
    ]
    if arm.payload is not None:
        links[arm.hands[0]] = merge_links([links[arm.hands[0]], arm.payload])
    return links
