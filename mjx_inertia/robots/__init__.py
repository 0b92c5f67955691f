"""Robot arms: published figures, any MJCF or URDF arm, kinematics and dynamics in JAX.

In: the name of an arm, or a file with the name of its end effector. Out: `Arm`, and functions of it
and of one joint state; `over_states` runs them over many.
"""

from mjx_inertia.robots.arm import Arm
from mjx_inertia.robots.blocks import over_states
from mjx_inertia.robots.dynamics import (
    bias_force,
    coriolis_matrix,
    forward_dynamics,
    gravity_torque,
    inverse_dynamics,
    mass_matrix,
)
from mjx_inertia.robots.kinematics import (
    hand_jacobian,
    hand_pose,
    jacobian_rate_product,
    link_poses,
)
from mjx_inertia.robots.load import load_arm
from mjx_inertia.robots.mjcf import ArmLooks, arm_mjcf, arm_spec
from mjx_inertia.robots.published import baxter, lwa4d

__all__ = [
    "Arm",
    "ArmLooks",
    "arm_mjcf",
    "arm_spec",
    "baxter",
    "bias_force",
    "coriolis_matrix",
    "forward_dynamics",
    "gravity_torque",
    "hand_jacobian",
    "hand_pose",
    "inverse_dynamics",
    "jacobian_rate_product",
    "link_poses",
    "load_arm",
    "lwa4d",
    "mass_matrix",
    "over_states",
]
