"""What a space robot is: a free-floating tree of links with two hands, and the object they hold.

In: figures of a robot. Out: `SpaceRobot` and `Capture`, pytrees that dynamics read. The base is a
link without a joint before it; every other link has one. A program that closes over a robot leaves
out every product with a zero of its geometry: a planar robot costs what a planar formula costs.
"""

from collections.abc import Sequence

import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.spatial import AnyArray, InertialParameters, Pose

BASE = -1  # as parent of a link
PLANAR_AXES = (0, 1, 5)  # of a twist (linear, angular): x, y and the turn about z
ALL_AXES = (0, 1, 2, 3, 4, 5)


@struct.dataclass
class SpaceRobot:
    """A free-floating tree of n joints with two hands."""

    base: InertialParameters  # inertia of the base in its frame
    T_parent_joint: Pose  # n poses of the joints, each in the link before, at joint position zero
    axis: Float[AnyArray, "n 3"]  # n unit vectors in the joints' frames
    links: InertialParameters  # n links, each in the frame of its joint
    # inertia of the drives as the joints feel it, kg m² (kg where prismatic)
    armature: Float[AnyArray, " n"]
    lower: Float[AnyArray, " n"]  # least joint positions, rad (m)
    upper: Float[AnyArray, " n"]  # greatest joint positions, rad (m)
    T_link_hand: Pose  # two poses: the hands in the links that carry them
    # index of the link before each, `BASE` for the base; each less than the link's own
    parents: tuple[int, ...] = struct.field(pytree_node=False)
    # indices of the two links that carry the hands
    hands: tuple[int, int] = struct.field(pytree_node=False)
    prismatic: tuple[bool, ...] = struct.field(pytree_node=False)  # which joints slide
    # moves in the plane z = 0 of the base only; all joints turn about z
    planar: bool = struct.field(pytree_node=False, default=False)
    # of the links' capsules, m, which looks and clearance take
    radius: float = struct.field(pytree_node=False, default=0.1)
    # edges of the base's box, m, for the same
    base_size: tuple[float, float, float] = struct.field(pytree_node=False, default=(1.0, 1.0, 1.0))
    name: str = struct.field(pytree_node=False, default="")  # of the robot
    joint_names: tuple[str, ...] = struct.field(pytree_node=False, default=())  # n names

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.prismatic)

    @property
    def axes(self) -> tuple[int, ...]:
        """Entries of a twist that can differ from zero."""
        return PLANAR_AXES if self.planar else ALL_AXES


@struct.dataclass
class Capture:
    """An object that both hands hold."""

    inertial: InertialParameters  # of the object, in its frame
    T_hand_obj: Pose  # two poses: the object in each hand
    # of a ball around it, m, for clearance
    radius: float = struct.field(pytree_node=False, default=0.4)


def pose_at_index(poses: Pose, k: int) -> Pose:
    """The k-th of several poses."""
    return Pose(poses.rotation[k], poses.translation[k])


def stacked_poses(poses: Sequence[Pose]) -> Pose:
    """Several poses as one with a leading axis."""
    rotation = np.stack([np.asarray(T.rotation) for T in poses])
    return Pose(rotation, np.stack([np.asarray(T.translation) for T in poses]))


def check_shape(robot: SpaceRobot, **vectors: Float[Array, "..."]) -> None:
    """Raises ValueError, naming the argument, unless each vector has one entry for each joint."""
    for name, vector in vectors.items():
        if vector.shape != (robot.dof,):
            raise ValueError(
                f"`{name}` has shape {vector.shape}, but {robot.name or 'the robot'} has "
                f"{robot.dof} joints: give ({robot.dof},), and vmap over further axes"
            )
