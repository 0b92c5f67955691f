"""An arm that holds an object: candidate grasps, how well they hold, and which to choose."""

from mjx_inertia.grasping.augmented import (
    OperationalDynamics,
    effective_mass,
    object_inertia,
    operational_dynamics,
    operational_inertia,
    with_payload,
)
from mjx_inertia.grasping.contact_model import (
    SoftFinger,
    antipodal_margin,
    grasp_map,
    is_force_closure,
)
from mjx_inertia.grasping.evaluate import GraspCosts, evaluate_grasps, grasp_costs
from mjx_inertia.grasping.grasp import Contacts, Grasp, grasps_at
from mjx_inertia.grasping.gripper import BAXTER_GRIPPER, PARALLEL_JAW_80MM, Gripper
from mjx_inertia.grasping.hand_clearance import GraspFit, grasp_fit
from mjx_inertia.grasping.holding import greatest_gripping_force, object_motion
from mjx_inertia.grasping.inverse_kinematics import ReachSettings, conditioning, reach
from mjx_inertia.grasping.jaw_force import ObjectMotion, gripping_force, holding_wrench
from mjx_inertia.grasping.metrics import (
    METRICS,
    AlongPath,
    signals_along_path,
    twist_manipulability,
    velocity_manipulability,
)
from mjx_inertia.grasping.motion import GraspMotion, GraspStatus, plan_motion
from mjx_inertia.grasping.payload_belief import (
    PayloadBelief,
    belief_of_push,
    belief_of_ten_numbers,
    draw_payloads,
    payloads_at,
)
from mjx_inertia.grasping.ranking import CRITERIA, GraspRanking, hands_of, rank_grasps
from mjx_inertia.grasping.sampler import GraspSample, SamplerSettings, grasps_along, sample_grasps
from mjx_inertia.grasping.task_path import (
    TASKS,
    Move,
    ObjectPath,
    Task,
    object_path,
    object_pose_at,
    quintic,
)
from mjx_inertia.grasping.two_soft_fingers import least_normal_force, least_squeeze
from mjx_inertia.grasping.uncertainty import (
    Regret,
    UncertainCost,
    ellipsoid_radius,
    linear_cost,
    regret,
    sampled_cost,
)
from mjx_inertia.grasping.wrench_space import (
    WrenchHull,
    epsilon_quality,
    wrench_ellipsoid_volume,
    wrench_hull,
)

__all__ = [
    "BAXTER_GRIPPER",
    "CRITERIA",
    "METRICS",
    "PARALLEL_JAW_80MM",
    "TASKS",
    "AlongPath",
    "Contacts",
    "Grasp",
    "GraspCosts",
    "GraspFit",
    "GraspMotion",
    "GraspRanking",
    "GraspSample",
    "GraspStatus",
    "Gripper",
    "Move",
    "ObjectMotion",
    "ObjectPath",
    "OperationalDynamics",
    "PayloadBelief",
    "ReachSettings",
    "Regret",
    "SamplerSettings",
    "SoftFinger",
    "Task",
    "UncertainCost",
    "WrenchHull",
    "antipodal_margin",
    "belief_of_push",
    "belief_of_ten_numbers",
    "conditioning",
    "draw_payloads",
    "effective_mass",
    "ellipsoid_radius",
    "epsilon_quality",
    "evaluate_grasps",
    "grasp_costs",
    "grasp_fit",
    "grasp_map",
    "grasps_along",
    "grasps_at",
    "greatest_gripping_force",
    "gripping_force",
    "hands_of",
    "holding_wrench",
    "is_force_closure",
    "least_normal_force",
    "least_squeeze",
    "linear_cost",
    "object_inertia",
    "object_motion",
    "object_path",
    "object_pose_at",
    "operational_dynamics",
    "operational_inertia",
    "payloads_at",
    "plan_motion",
    "quintic",
    "rank_grasps",
    "reach",
    "regret",
    "sample_grasps",
    "sampled_cost",
    "signals_along_path",
    "twist_manipulability",
    "velocity_manipulability",
    "with_payload",
    "wrench_ellipsoid_volume",
    "wrench_hull",
]
