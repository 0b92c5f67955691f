"""An arm that holds an object: candidate grasps, how well they hold, and which to choose."""

from mjx_inertia.grasping.contact_model import SoftFinger as SoftFinger
from mjx_inertia.grasping.grasp import (
    BAXTER_GRIPPER as BAXTER_GRIPPER,
    PARALLEL_JAW_80MM as PARALLEL_JAW_80MM,
    Contacts as Contacts,
)
from mjx_inertia.grasping.holding import greatest_gripping_force as greatest_gripping_force
from mjx_inertia.grasping.inverse_kinematics import ReachSettings as ReachSettings
from mjx_inertia.grasping.metrics import (
    METRICS as METRICS,
    signals_along_path as signals_along_path,
)
from mjx_inertia.grasping.motion import (
    GraspMotion as GraspMotion,
    GraspStatus as GraspStatus,
    plan_motion as plan_motion,
)
from mjx_inertia.grasping.ranking import (
    CRITERIA as CRITERIA,
    EPSILON as EPSILON,
    GraspCosts as GraspCosts,
    evaluate_grasps as evaluate_grasps,
    grasp_costs as grasp_costs,
    hands_of as hands_of,
    rank_grasps as rank_grasps,
)
from mjx_inertia.grasping.sampler import (
    SamplerSettings as SamplerSettings,
    sample_grasps as sample_grasps,
)
from mjx_inertia.grasping.task_path import (
    TASKS as TASKS,
    Move as Move,
    Task as Task,
    object_path as object_path,
)
from mjx_inertia.grasping.uncertainty import (
    PayloadBelief as PayloadBelief,
    belief_of_push as belief_of_push,
    belief_of_ten_numbers as belief_of_ten_numbers,
    draw_payloads as draw_payloads,
    linear_cost as linear_cost,
    regret as regret,
    sampled_cost as sampled_cost,
)
