"""A free-floating robot with two arms that carries a captured object: thesis chapter 7 and beyond.

In: a robot (planar as in the thesis, or any free-floating MJCF tree with two hands), an object with
known inertia, where it is and where it shall go. Out: dynamics, trajectories, what they cost the
object, the base and the hands, as a problem for `search`; replay in MuJoCo, animations.
"""

from mjx_inertia.space import planar_dynamics as planar_dynamics
from mjx_inertia.space.animation import save_animation as save_animation
from mjx_inertia.space.arms_on_base import (
    servicer as servicer,
    servicer_capture as servicer_capture,
    with_arms as with_arms,
)
from mjx_inertia.space.capture import Capture as Capture, with_capture as with_capture
from mjx_inertia.space.closure import (
    close_chain as close_chain,
    closed_chain_motion as closed_chain_motion,
    closure_error as closure_error,
)
from mjx_inertia.space.collision_distance import clearance as clearance
from mjx_inertia.space.default_manoeuvres import (
    AS_PRINTED as AS_PRINTED,
    planar_manoeuvre as planar_manoeuvre,
    planar_pose as planar_pose,
    servicer_manoeuvre as servicer_manoeuvre,
)
from mjx_inertia.space.dual_arm import (
    ObjectDynamics as ObjectDynamics,
    distribute_wrench as distribute_wrench,
    dual_arm_grasp_map as dual_arm_grasp_map,
    hand_wrenches as hand_wrenches,
    object_dynamics as object_dynamics,
    object_to_joints as object_to_joints,
    shared_load_torques as shared_load_torques,
)
from mjx_inertia.space.dynamics import (
    floating_base_forward_dynamics as floating_base_forward_dynamics,
    floating_base_inverse_dynamics as floating_base_inverse_dynamics,
    generalized_jacobian as generalized_jacobian,
    hand_jacobians as hand_jacobians,
    inertias as inertias,
    momentum_map as momentum_map,
    reduced_forces as reduced_forces,
    reduced_inertia as reduced_inertia,
    velocity_forces as velocity_forces,
)
from mjx_inertia.space.figures import (
    fronts_figure as fronts_figure,
    parallel_figure as parallel_figure,
    path_figure as path_figure,
    progress_figure as progress_figure,
)
from mjx_inertia.space.instant import Node as Node, node as node
from mjx_inertia.space.manoeuvre import (
    Course as Course,
    CourseStatus as CourseStatus,
    Manoeuvre as Manoeuvre,
    base_at as base_at,
    course as course,
)
from mjx_inertia.space.manoeuvre_path import Path as Path, path as path
from mjx_inertia.space.manoeuvre_planning import (
    ManoeuvreSettings as ManoeuvreSettings,
    end_configuration as end_configuration,
    plan_manoeuvre as plan_manoeuvre,
)
from mjx_inertia.space.mjcf import capture_spec as capture_spec
from mjx_inertia.space.mujoco_replay import (
    Disagreement as Disagreement,
    Replay as Replay,
    ReplaySettings as ReplaySettings,
    disagreement as disagreement,
    replay as replay,
)
from mjx_inertia.space.objectives import (
    BASE_DRIFT as BASE_DRIFT,
    HANDS as HANDS,
    OBJECTIVES as OBJECTIVES,
    THESIS as THESIS,
    WRENCH as WRENCH,
    costs as costs,
    problem as problem,
    violation as violation,
    with_base_rotation as with_base_rotation,
    with_object_at_target as with_object_at_target,
)
from mjx_inertia.space.planar_model import (
    PlanarSettings as PlanarSettings,
    planar_capture as planar_capture,
    planar_robot as planar_robot,
)
from mjx_inertia.space.trajectory import (
    BOUND as BOUND,
    JointMotion as JointMotion,
    joint_motion as joint_motion,
)
