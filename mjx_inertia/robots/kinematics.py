"""Where the links and the hand of an arm are, and how they move.

In: an `Arm` and joint positions (rad; m where prismatic). Out: poses in the world, the hand's
Jacobian and the part of its acceleration that velocities cause. A hand's twist is (linear, angular)
in *world* axes, linear of the hand's origin or of another point of it.
"""

from jaxtyping import Array, Float

from mjx_inertia.robots.arm import Arm, check_joints
from mjx_inertia.robots.chain import unstack
from mjx_inertia.robots.recursions import (
    hand_frame,
    hand_point,
    jacobian_columns,
    jacobian_rate_twist,
    link_frames,
)
from mjx_inertia.spatial import Pose
from mjx_inertia.spatial.components import stacked


def link_poses(arm: Arm, q: Float[Array, " n"]) -> Pose:
    """Poses of the n links in the world."""
    check_joints(arm, q=q)
    frames = link_frames(arm, unstack(q))
    rotation = stacked([f.rotation for f in frames], q.dtype)
    return Pose(rotation, stacked([f.origin for f in frames], q.dtype))


def hand_pose(arm: Arm, q: Float[Array, " n"]) -> Pose:
    """`T_world_hand`."""
    check_joints(arm, q=q)
    hand = hand_frame(arm, link_frames(arm, unstack(q))[-1])
    return Pose(stacked(hand.rotation, q.dtype), stacked(hand.origin, q.dtype))


def hand_jacobian(
    arm: Arm, q: Float[Array, " n"], point: Float[Array, "3"] | None = None
) -> Float[Array, "6 n"]:
    """Twist of the hand in world axes for unit joint velocities.

    Args:
      arm: the arm.
      q: joint positions.
      point: of the hand whose velocity is meant, m, in the hand's frame; its origin if None.
    """
    check_joints(arm, q=q)
    frames = link_frames(arm, unstack(q))
    columns = jacobian_columns(arm, frames, hand_point(arm, frames[-1], point))
    rows = zip(*((*linear, *angular) for linear, angular in columns), strict=True)
    return stacked(list(rows), q.dtype)


def jacobian_rate_product(
    arm: Arm,
    q: Float[Array, " n"],
    qd: Float[Array, " n"],
    point: Float[Array, "3"] | None = None,
) -> Float[Array, "6"]:
    """J̇ q̇: the hand's acceleration in world axes at zero joint acceleration.

    Args:
      arm: the arm.
      q: joint positions.
      qd: joint velocities.
      point: of the hand whose acceleration is meant, m, in the hand's frame; its origin if None.
    """
    check_joints(arm, q=q, qd=qd)
    frames = link_frames(arm, unstack(q))
    columns = jacobian_columns(arm, frames, hand_point(arm, frames[-1], point))
    linear, angular = jacobian_rate_twist(columns, unstack(qd))
    return stacked([*linear, *angular], q.dtype)
