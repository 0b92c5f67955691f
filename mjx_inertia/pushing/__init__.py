"""The MJX experiment: an object on a table, pushed by a tip."""

from mjx_inertia.pushing.batched_simulation import simulate
from mjx_inertia.pushing.mjx_step import differentiable_step
from mjx_inertia.pushing.motion import Motion, SampledMotion, StraightMotion
from mjx_inertia.pushing.parameters import (
    PushParameters,
    object_parameters,
    recompile,
    resting_height,
    with_parameters,
)
from mjx_inertia.pushing.plan_view import first_contact, plan_polygons, stack_polygons
from mjx_inertia.pushing.record import (
    PushRecord,
    PushStatus,
    first_samples,
    with_few_lengths,
)
from mjx_inertia.pushing.scene import Scene, build_scene, build_spec
from mjx_inertia.pushing.settings import SceneSettings
from mjx_inertia.pushing.setup import PushSetup, measured_motion

__all__ = [
    "Motion",
    "PushParameters",
    "PushRecord",
    "PushSetup",
    "PushStatus",
    "SampledMotion",
    "Scene",
    "SceneSettings",
    "StraightMotion",
    "build_scene",
    "build_spec",
    "differentiable_step",
    "first_contact",
    "first_samples",
    "measured_motion",
    "object_parameters",
    "plan_polygons",
    "recompile",
    "resting_height",
    "simulate",
    "stack_polygons",
    "with_few_lengths",
    "with_parameters",
]
