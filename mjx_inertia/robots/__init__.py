"""Robots: published figures, any MJCF or URDF file, kinematics and dynamics in JAX.

In: the name of an arm, or a file with the names of its hands. Out: `Robot`, a tree of joints on a
base that is fixed or free, and functions of it and of one joint state; `over_states` runs them over
many.
"""

from mjx_inertia.robots.blocks import over_states as over_states
from mjx_inertia.robots.dynamics import (
    forward_dynamics as forward_dynamics,
    gravity_torque as gravity_torque,
    hand_jacobian as hand_jacobian,
    hand_pose as hand_pose,
    inverse_dynamics as inverse_dynamics,
    link_poses as link_poses,
    mass_matrix as mass_matrix,
)
from mjx_inertia.robots.load import load_robot as load_robot
from mjx_inertia.robots.mjcf import robot_spec as robot_spec
from mjx_inertia.robots.published import baxter as baxter, lwa4d as lwa4d
from mjx_inertia.robots.robot import BASE as BASE, Robot as Robot, with_payload as with_payload
