"""What a robot is: a tree of joints and links with hands, on a base that is fixed or free.

In: figures of a robot. Out: `Robot`, one pytree that kinematics and dynamics read. A link's frame
is that of the joint which moves it. A program that closes over a robot
(`jax.jit(partial(mass_matrix, robot))`) leaves out every product with a zero of its geometry, so a
planar robot costs what a planar formula costs; one that takes the robot as an argument can
differentiate in every figure of it, and costs about twice the operations.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Float

from mjx_inertia.robots.rigid_links import merge_links, transform_parameters
from mjx_inertia.spatial import AnyArray, InertialParameters, Pose, combine

BASE = -1  # as parent of a link
PLANAR_AXES = (0, 1, 5)  # of a twist (linear, angular): x, y and the turn about z
ALL_AXES = (0, 1, 2, 3, 4, 5)


@struct.dataclass
class Robot:
    """A tree of n joints with h hands."""

    # n poses of the joints, each in the link before (the base for the first), at joint position
    # zero
    T_parent_joint: Pose
    axis: Float[AnyArray, "n 3"]  # unit vectors in the joints' frames
    links: InertialParameters  # n links, each in its own frame; fixed bodies are merged
    # inertia of the drives as the joints feel it, kg m² (kg where prismatic)
    armature: Float[AnyArray, " n"]
    lower: Float[AnyArray, " n"]  # least joint positions, rad (m)
    upper: Float[AnyArray, " n"]  # greatest joint positions, rad (m)
    # greatest joint speeds, rad/s (m/s); infinite where none is known
    velocity_limit: Float[AnyArray, " n"]
    # greatest joint torques, N m (N); infinite where none is known
    torque_limit: Float[AnyArray, " n"]
    T_link_hand: Pose  # h poses: the hands in the links that carry them
    # a fixed base in the world; a free base is its own world, and this is the identity
    T_world_base: Pose
    gravity: Float[AnyArray, "3"]  # acceleration of free fall, m/s², in world axes; zero if free
    # inertia of a free base in its frame; None: the base is fixed
    base: InertialParameters | None = None
    # what the first hand holds, in the frame of its link; see `with_payload`
    payload: InertialParameters | None = None
    # index of the link before each, `BASE` for the base; each less than the link's own
    parents: tuple[int, ...] = struct.field(pytree_node=False, kw_only=True)
    # indices of the links that carry the hands
    hands: tuple[int, ...] = struct.field(pytree_node=False, kw_only=True)
    prismatic: tuple[bool, ...] = struct.field(pytree_node=False, kw_only=True)  # which slide
    # a free base that moves in its plane z = 0 only; all joints turn about z
    planar: bool = struct.field(pytree_node=False, default=False)
    # of the links' capsules, m, which looks and clearance take
    radius: float = struct.field(pytree_node=False, default=0.05)
    # edges of a free base's box, m, for the same
    base_size: tuple[float, float, float] = struct.field(pytree_node=False, default=(1.0, 1.0, 1.0))
    name: str = struct.field(pytree_node=False, default="")  # of the robot
    joint_names: tuple[str, ...] = struct.field(pytree_node=False, default=())  # n names
    # what a reader of the figures must know, for example what is an estimate
    note: str = struct.field(pytree_node=False, default="")

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.prismatic)

    @property
    def axes(self) -> tuple[int, ...]:
        """Entries of a twist of the base, or of a link, that can differ from zero."""
        return PLANAR_AXES if self.planar else ALL_AXES


def with_payload(robot: Robot, payload: InertialParameters, T_hand_obj: Pose) -> Robot:
    """The robot whose first hand holds an object, together with what it held before.

    What is known while a program is traced stays known.

    Args:
      robot: the robot.
      payload: of the object, in the object's frame.
      T_hand_obj: the object in the hand.
    """
    payload, T_hand_obj, T_link_hand = jax.tree.map(
        _known, (payload, T_hand_obj, robot.T_link_hand[0])
    )
    held = transform_parameters(payload, T_link_hand @ T_hand_obj)
    if robot.payload is not None:
        held = _joined(robot.payload, held)
    return robot.replace(payload=held)


def _joined(a: InertialParameters, b: InertialParameters) -> InertialParameters:
    """Two bodies in one frame as one; in NumPy, so that zeros stay known, unless traced."""
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves((a, b))):
        return combine(jax.tree.map(lambda *leaves: jnp.stack(leaves), a, b))
    return merge_links([a, b])


def joint_names(robot: Robot) -> tuple[str, ...]:
    """Names of the joints: those of the robot, or `joint_1` and so on."""
    return robot.joint_names or tuple(f"joint_{i + 1}" for i in range(robot.dof))


def check_joints(robot: Robot, **vectors: Float[AnyArray, "..."]) -> None:
    """Raises ValueError, naming the argument, unless each vector has one entry for each joint."""
    for name, vector in vectors.items():
        if vector.shape != (robot.dof,):
            raise ValueError(
                f"`{name}` has shape {vector.shape}, but {robot.name or 'the robot'} has "
                f"{robot.dof} joints: give ({robot.dof},), and vmap over further axes"
            )


def check_free_base(robot: Robot) -> None:
    """Raises ValueError for a robot whose base is fixed."""
    if robot.base is None:
        raise ValueError(
            f"`robot` {robot.name} has a fixed base; take the functions of `mjx_inertia.robots`, "
            "such as `inverse_dynamics`"
        )


def _known(x: Any) -> Any:
    return x if isinstance(x, jax.core.Tracer) else np.asarray(x, np.float64)
