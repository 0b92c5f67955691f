"""What an arm is: a serial chain of joints and links with a hand at its end.

In: figures of a robot. Out: `Arm`, one pytree that kinematics and dynamics read. A link's frame is
that of the joint which moves it. A program that closes over an arm (`jax.jit(partial(mass_matrix,
arm))`) leaves out every product with a zero of its geometry; one that takes it as an argument can
differentiate in every figure of it, and costs about twice the operations.
"""

from flax import struct
from jaxtyping import Float

from mjx_inertia.spatial import AnyArray, InertialParameters, Pose


@struct.dataclass
class Arm:
    """A serial chain of n joints."""

    T_world_base: Pose  # the base in the world
    # n poses of the joints, each in the link before (the base for the first), at joint position
    # zero
    T_parent_joint: Pose
    axis: Float[AnyArray, "n 3"]  # unit vectors in the joint's frame
    links: InertialParameters  # n links, each in its own frame; fixed bodies are merged
    # inertia of the drive as the joint feels it, kg m² (kg where prismatic)
    armature: Float[AnyArray, " n"]
    lower: Float[AnyArray, " n"]  # least joint position, rad (m)
    upper: Float[AnyArray, " n"]  # greatest joint position, rad (m)
    # greatest joint speed, rad/s (m/s); infinite where none is known
    velocity_limit: Float[AnyArray, " n"]
    # greatest joint torque, N m (N); infinite where none is known
    torque_limit: Float[AnyArray, " n"]
    T_link_hand: Pose  # the hand in the last link
    gravity: Float[AnyArray, "3"]  # acceleration of free fall, m/s², in world axes
    # what the hand holds, in the frame of the last link; see `grasping.with_payload`
    payload: InertialParameters | None = None
    prismatic: tuple[bool, ...] = struct.field(pytree_node=False, default=())  # which joints slide
    name: str = struct.field(pytree_node=False, default="")  # of the robot
    joint_names: tuple[str, ...] = struct.field(pytree_node=False, default=())  # n names
    # what a reader of figures of this arm must know, for example what is an estimate
    note: str = struct.field(pytree_node=False, default="")

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.prismatic)


def check_joints(arm: Arm, **vectors: Float[AnyArray, "..."]) -> None:
    """Raises ValueError, naming the argument, unless each vector has one entry for each joint."""
    for name, vector in vectors.items():
        if vector.shape != (arm.dof,):
            raise ValueError(
                f"`{name}` has shape {vector.shape}, but {arm.name or 'the arm'} has {arm.dof} "
                f"joints: give ({arm.dof},), and vmap over further axes"
            )
