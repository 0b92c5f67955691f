"""Robot arms: published figures, any MJCF or URDF arm, kinematics and dynamics in JAX.

In: the name of an arm, or a file with the name of its end effector. Out: `Arm`, and functions of it
and of one joint state; `over_states` runs them over many.
"""

from mjx_inertia.robots.arm import Arm as Arm
from mjx_inertia.robots.blocks import over_states as over_states
from mjx_inertia.robots.dynamics import (
    bias_force as bias_force,
    coriolis_matrix as coriolis_matrix,
    forward_dynamics as forward_dynamics,
    gravity_torque as gravity_torque,
    inverse_dynamics as inverse_dynamics,
    mass_matrix as mass_matrix,
)
from mjx_inertia.robots.kinematics import (
    hand_jacobian as hand_jacobian,
    hand_pose as hand_pose,
    jacobian_rate_product as jacobian_rate_product,
    link_poses as link_poses,
)
from mjx_inertia.robots.load import load_arm as load_arm
from mjx_inertia.robots.mjcf import ArmLooks as ArmLooks, arm_mjcf as arm_mjcf, arm_spec as arm_spec
from mjx_inertia.robots.published import baxter as baxter, lwa4d as lwa4d
