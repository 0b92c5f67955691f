"""An arm that holds an object: candidate grasps, how well they hold, and which to choose."""

from mjx_inertia.grasping.augmented import (
    OperationalDynamics as OperationalDynamics,
    effective_mass as effective_mass,
    object_inertia as object_inertia,
    operational_dynamics as operational_dynamics,
    operational_inertia as operational_inertia,
)
from mjx_inertia.grasping.contact_model import (
    SoftFinger as SoftFinger,
    antipodal_margin as antipodal_margin,
    grasp_map as grasp_map,
    is_force_closure as is_force_closure,
)
from mjx_inertia.grasping.evaluate import (
    GraspCosts as GraspCosts,
    evaluate_grasps as evaluate_grasps,
    grasp_costs as grasp_costs,
)
from mjx_inertia.grasping.grasp import Contacts as Contacts, Grasp as Grasp, grasps_at as grasps_at
from mjx_inertia.grasping.gripper import (
    BAXTER_GRIPPER as BAXTER_GRIPPER,
    PARALLEL_JAW_80MM as PARALLEL_JAW_80MM,
    Gripper as Gripper,
)
from mjx_inertia.grasping.hand_clearance import GraspFit as GraspFit, grasp_fit as grasp_fit
from mjx_inertia.grasping.holding import (
    greatest_gripping_force as greatest_gripping_force,
    object_motion as object_motion,
)
from mjx_inertia.grasping.inverse_kinematics import (
    ReachSettings as ReachSettings,
    conditioning as conditioning,
    reach as reach,
)
from mjx_inertia.grasping.jaw_force import (
    ObjectMotion as ObjectMotion,
    gripping_force as gripping_force,
    holding_wrench as holding_wrench,
)
from mjx_inertia.grasping.metrics import (
    METRICS as METRICS,
    AlongPath as AlongPath,
    signals_along_path as signals_along_path,
    twist_manipulability as twist_manipulability,
    velocity_manipulability as velocity_manipulability,
)
from mjx_inertia.grasping.motion import (
    GraspMotion as GraspMotion,
    GraspStatus as GraspStatus,
    plan_motion as plan_motion,
)
from mjx_inertia.grasping.payload_belief import (
    PayloadBelief as PayloadBelief,
    belief_of_push as belief_of_push,
    belief_of_ten_numbers as belief_of_ten_numbers,
    draw_payloads as draw_payloads,
    payloads_at as payloads_at,
)
from mjx_inertia.grasping.ranking import (
    CRITERIA as CRITERIA,
    GraspRanking as GraspRanking,
    hands_of as hands_of,
    rank_grasps as rank_grasps,
)
from mjx_inertia.grasping.sampler import (
    GraspSample as GraspSample,
    SamplerSettings as SamplerSettings,
    grasps_along as grasps_along,
    sample_grasps as sample_grasps,
)
from mjx_inertia.grasping.task_path import (
    TASKS as TASKS,
    Move as Move,
    ObjectPath as ObjectPath,
    Task as Task,
    object_path as object_path,
    object_pose_at as object_pose_at,
    quintic as quintic,
)
from mjx_inertia.grasping.two_soft_fingers import (
    least_normal_force as least_normal_force,
    least_squeeze as least_squeeze,
)
from mjx_inertia.grasping.uncertainty import (
    Regret as Regret,
    UncertainCost as UncertainCost,
    ellipsoid_radius as ellipsoid_radius,
    linear_cost as linear_cost,
    regret as regret,
    sampled_cost as sampled_cost,
)
from mjx_inertia.grasping.wrench_space import (
    WrenchHull as WrenchHull,
    epsilon_quality as epsilon_quality,
    wrench_ellipsoid_volume as wrench_ellipsoid_volume,
    wrench_hull as wrench_hull,
)
