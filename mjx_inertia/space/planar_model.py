"""The planar robot of thesis Fig. 7.1 and Table 7.1: a square base with two arms of three joints.

In: settings, every figure with its unit. Out: `Robot`, `Capture`. The thesis does not give
shoulders, joint limits and poses (errata 29): those here put the shoulders on the face of the base
that looks at the object, elbows outward.
"""

import dataclasses

import numpy as np

from mjx_inertia.robots.robot import BASE, Robot
from mjx_inertia.space.capture import Capture
from mjx_inertia.spatial import Pose, inertial_float64


@dataclasses.dataclass(frozen=True)
class PlanarSettings:
    """Figures of the robot and its object."""

    base_mass: float = 300.0  # kg
    base_side: float = 2.0  # of the square, m
    link_mass: tuple[float, float, float] = (5.0, 4.0, 3.0)  # of the links of an arm, kg
    link_length: tuple[float, float, float] = (1.2, 1.1, 1.0)  # m; a link's mass lies in its middle
    link_radius: float = 0.2  # of the cylinders, m
    # "table" as printed, ½ m r², or "physical", m (3 r² + L²) / 12 (errata 28)
    link_inertia: str = "table"
    # of the right arm in the base, m; the left is its mirror image in x
    shoulder: tuple[float, float] = (0.5, 1.0)
    # least joint positions of the right arm, rad; the left arm's are mirrored
    lower: tuple[float, float, float] = (-3.0, -3.0, -3.0)
    # greatest joint positions of the right arm, rad
    upper: tuple[float, float, float] = (3.0, 3.0, 3.0)
    object_mass: float = 10.0  # kg
    object_radius: float = 0.4  # of the solid sphere, m; the hands hold it on both sides

    def __post_init__(self) -> None:
        """Raises ValueError for figures that no robot has."""
        if self.link_inertia not in ("table", "physical"):
            raise ValueError(
                f"`link_inertia` is {self.link_inertia!r}: expected 'table' or 'physical'"
            )
        for name in ("base_mass", "base_side", "link_radius", "object_mass", "object_radius"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ValueError(f"`{name}` is {getattr(self, name)}: expected more than zero")
        for name in ("link_mass", "link_length"):
            of_links = getattr(self, name)
            if len(of_links) != 3 or not 0.0 < min(of_links) <= max(of_links) < np.inf:
                raise ValueError(f"`{name}` is {of_links}: expected three, each more than zero")
        if not all(low < high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError(f"`lower` {self.lower} must lie below `upper` {self.upper}")


def planar_robot(settings: PlanarSettings | None = None) -> Robot:
    """The robot: joints 1r, 2r, 3r, 1l, 2l, 3l, each turning about z; the arms reach along +y.

    At joint position zero an arm is stretched out along y of the base; the right arm (x > 0) folds
    outward with positive joint 1 being negative turns, so that both arms have the same positions
    when they are mirror images.
    """
    s = settings or PlanarSettings()
    mass, length = np.tile(s.link_mass, 2), np.tile(s.link_length, 2)
    offsets = np.zeros((6, 3))
    for side in (0, 1):
        offsets[3 * side] = (s.shoulder[0] * (-1.0) ** side, s.shoulder[1], 0.0)
        offsets[3 * side + 1 : 3 * side + 3, 1] = s.link_length[:2]
    axis = np.zeros((6, 3))
    axis[:, 2] = np.repeat([-1.0, 1.0], 3)  # a positive joint 1 folds either arm outward
    axis[[1, 2, 4, 5], 2] *= -1.0  # and positive joints 2 and 3 fold it back
    com = np.zeros((6, 3))
    com[:, 1] = length / 2.0
    moment, base_moment = np.tile(link_moments(s), 2), s.base_mass * s.base_side**2 / 6.0
    hand = np.zeros((2, 3))
    hand[:, 1] = s.link_length[2]
    return Robot(
        base=inertial_float64(s.base_mass, np.zeros(3), base_moment * np.eye(3)),
        T_parent_joint=Pose(np.tile(np.eye(3), (6, 1, 1)), offsets),
        axis=axis,
        links=inertial_float64(mass, com, moment[:, None, None] * np.eye(3)),
        armature=np.zeros(6),
        lower=np.tile(s.lower, 2),
        upper=np.tile(s.upper, 2),
        velocity_limit=np.full(6, np.inf),
        torque_limit=np.full(6, np.inf),
        T_world_base=Pose.identity(),
        gravity=np.zeros(3),
        T_link_hand=Pose(np.tile(np.eye(3), (2, 1, 1)), hand),
        parents=(BASE, 0, 1, BASE, 3, 4),
        hands=(2, 5),
        prismatic=(False,) * 6,
        planar=True,
        radius=s.link_radius,
        base_size=(s.base_side, s.base_side, s.base_side),
        name="planar space robot",
        joint_names=("1r", "2r", "3r", "1l", "2l", "3l"),
    )


def planar_capture(settings: PlanarSettings | None = None) -> Capture:
    """The sphere between the hands, which point at each other along x of the object."""
    s = settings or PlanarSettings()
    # the right hand's y points along -x of the object, the left one's along +x
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    center = np.array([0.0, s.object_radius, 0.0])
    inertia = 0.4 * s.object_mass * s.object_radius**2
    return Capture(
        inertial=inertial_float64(s.object_mass, np.zeros(3), inertia * np.eye(3)),
        T_hand_obj=Pose(np.stack([quarter, quarter.T]), np.stack([center, center])),
        radius=s.object_radius,
    )


def link_moments(s: PlanarSettings) -> list[float]:
    """Moments of inertia (kg m²) about z through the middle of the links of one arm."""
    if s.link_inertia == "table":
        return [0.5 * mass * s.link_radius**2 for mass in s.link_mass]
    pairs = zip(s.link_mass, s.link_length, strict=True)
    return [mass * (3.0 * s.link_radius**2 + length**2) / 12.0 for mass, length in pairs]
