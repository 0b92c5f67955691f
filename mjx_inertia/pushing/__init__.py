"""The MJX experiment: an object on a table, pushed by a tip."""

from mjx_inertia.pushing.batched_simulation import simulate as simulate
from mjx_inertia.pushing.contact_solver import differentiable_step as differentiable_step
from mjx_inertia.pushing.parameters import (
    PushParameters as PushParameters,
    object_parameters as object_parameters,
    recompile as recompile,
    resting_height as resting_height,
)
from mjx_inertia.pushing.plan_view import (
    first_contact as first_contact,
    plan_polygons as plan_polygons,
    stack_polygons as stack_polygons,
)
from mjx_inertia.pushing.record import (
    PushRecord as PushRecord,
    PushSetup as PushSetup,
    PushStatus as PushStatus,
    StraightMotion as StraightMotion,
    first_samples as first_samples,
    measured_motion as measured_motion,
    with_few_lengths as with_few_lengths,
    with_samples as with_samples,
)
from mjx_inertia.pushing.scene import (
    Scene as Scene,
    build_scene as build_scene,
    build_spec as build_spec,
)
from mjx_inertia.pushing.settings import SceneSettings as SceneSettings
