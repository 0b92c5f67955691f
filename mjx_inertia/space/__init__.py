"""A free-floating robot with two arms that carries a captured object: thesis chapter 7 and beyond.

In: a robot (planar as in the thesis, or any free-floating MJCF tree with two hands), an object with
known inertia, where it is and where it shall go. Out: dynamics, trajectories, what they cost the
object, the base and the hands, as a problem for `search`; replay in MuJoCo, animations.
"""

from mjx_inertia.space import planar_dynamics
from mjx_inertia.space.animation import save_animation
from mjx_inertia.space.arms_on_base import servicer, servicer_capture, with_arms
from mjx_inertia.space.closure import close_chain, closed_chain_motion, closure_error
from mjx_inertia.space.collision_distance import clearance
from mjx_inertia.space.default_manoeuvres import (
    AS_PRINTED,
    planar_manoeuvre,
    planar_pose,
    servicer_manoeuvre,
)
from mjx_inertia.space.dynamics import (
    floating_base_forward_dynamics,
    floating_base_inverse_dynamics,
    generalized_jacobian,
    hand_jacobians,
    inertias,
    momentum_map,
    reduced_forces,
    reduced_inertia,
    velocity_forces,
)
from mjx_inertia.space.figures import fronts_figure, parallel_figure, path_figure, progress_figure
from mjx_inertia.space.instant import Node, node
from mjx_inertia.space.load import load_space_robot
from mjx_inertia.space.load_sharing import (
    distribute_wrench,
    dual_arm_grasp_map,
    hand_wrenches,
    shared_load_torques,
)
from mjx_inertia.space.manoeuvre import Course, CourseStatus, Manoeuvre, base_at, course
from mjx_inertia.space.manoeuvre_path import Path, path
from mjx_inertia.space.manoeuvre_planning import (
    ManoeuvreSettings,
    end_configuration,
    plan_manoeuvre,
)
from mjx_inertia.space.mjcf import space_mjcf, space_spec
from mjx_inertia.space.mujoco_replay import Replay, ReplaySettings, replay
from mjx_inertia.space.object_space_dynamics import (
    ObjectDynamics,
    object_dynamics,
    object_to_joints,
)
from mjx_inertia.space.objectives import (
    BASE_DRIFT,
    HANDS,
    OBJECTIVES,
    THESIS,
    WRENCH,
    costs,
    problem,
    violation,
    with_base_rotation,
    with_object_at_target,
)
from mjx_inertia.space.planar_model import PlanarSettings, planar_capture, planar_robot
from mjx_inertia.space.replay_error import Disagreement, disagreement
from mjx_inertia.space.robot import BASE, Capture, SpaceRobot
from mjx_inertia.space.trajectory import BOUND, JointMotion, joint_motion

__all__ = [
    "AS_PRINTED",
    "BASE",
    "BASE_DRIFT",
    "BOUND",
    "HANDS",
    "OBJECTIVES",
    "THESIS",
    "WRENCH",
    "Capture",
    "Course",
    "CourseStatus",
    "Disagreement",
    "JointMotion",
    "Manoeuvre",
    "ManoeuvreSettings",
    "Node",
    "ObjectDynamics",
    "Path",
    "PlanarSettings",
    "Replay",
    "ReplaySettings",
    "SpaceRobot",
    "base_at",
    "clearance",
    "close_chain",
    "closed_chain_motion",
    "closure_error",
    "costs",
    "course",
    "disagreement",
    "distribute_wrench",
    "dual_arm_grasp_map",
    "end_configuration",
    "floating_base_forward_dynamics",
    "floating_base_inverse_dynamics",
    "fronts_figure",
    "generalized_jacobian",
    "hand_jacobians",
    "hand_wrenches",
    "inertias",
    "joint_motion",
    "load_space_robot",
    "momentum_map",
    "node",
    "object_dynamics",
    "object_to_joints",
    "parallel_figure",
    "path",
    "path_figure",
    "plan_manoeuvre",
    "planar_capture",
    "planar_dynamics",
    "planar_manoeuvre",
    "planar_pose",
    "planar_robot",
    "problem",
    "progress_figure",
    "reduced_forces",
    "reduced_inertia",
    "replay",
    "save_animation",
    "servicer",
    "servicer_capture",
    "servicer_manoeuvre",
    "shared_load_torques",
    "space_mjcf",
    "space_spec",
    "velocity_forces",
    "violation",
    "with_arms",
    "with_base_rotation",
    "with_object_at_target",
]
