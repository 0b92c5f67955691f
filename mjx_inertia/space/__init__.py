"""A free-floating robot with two arms that carries a captured object: thesis chapter 7 and beyond.

In: a robot (planar as in the thesis, or any free-floating MJCF tree with two hands), an object with
known inertia, where it is and where it shall go. Out: dynamics, trajectories, what they cost the
object, the base and the hands, as a problem for `search`; replay in MuJoCo, animations.
"""

from mjx_inertia.space import planar_dynamics as planar_dynamics
from mjx_inertia.space.animation import save_animation as save_animation
from mjx_inertia.space.arms_on_base import servicer as servicer, with_arms as with_arms
from mjx_inertia.space.default_manoeuvres import (
    AS_PRINTED as AS_PRINTED,
    planar_manoeuvre as planar_manoeuvre,
    servicer_manoeuvre as servicer_manoeuvre,
)
from mjx_inertia.space.figures import (
    fronts_figure as fronts_figure,
    parallel_figure as parallel_figure,
    path_figure as path_figure,
    progress_figure as progress_figure,
)
from mjx_inertia.space.instant import Node as Node
from mjx_inertia.space.manoeuvre import (
    Course as Course,
    CourseStatus as CourseStatus,
    Manoeuvre as Manoeuvre,
    base_at as base_at,
    course as course,
)
from mjx_inertia.space.manoeuvre_path import path as path
from mjx_inertia.space.manoeuvre_planning import (
    ManoeuvreSettings as ManoeuvreSettings,
    end_configuration as end_configuration,
    plan_manoeuvre as plan_manoeuvre,
)
from mjx_inertia.space.mujoco_replay import disagreement as disagreement, replay as replay
from mjx_inertia.space.objectives import (
    BASE_DRIFT as BASE_DRIFT,
    HANDS as HANDS,
    OBJECTIVES as OBJECTIVES,
    THESIS as THESIS,
    WRENCH as WRENCH,
    costs as costs,
    problem as problem,
)
from mjx_inertia.space.planar_model import (
    PlanarSettings as PlanarSettings,
    planar_robot as planar_robot,
)
from mjx_inertia.space.trajectory import BOUND as BOUND
