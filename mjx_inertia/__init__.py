"""Inertial parameters of objects from robot pushes, in JAX.

`import mjx_inertia as mi` offers the names to start with: simulate a push and identify the body,
mass properties of meshes, the catalogue, files of objects and robots, grasps, manoeuvres in space.
Each is imported when it is first used. What composes with them lies in the packages.
"""

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjx_inertia.dataset.noise import SensorNoise as SensorNoise
    from mjx_inertia.dataset.push import simulate_push as simulate_push
    from mjx_inertia.dataset.recording import read_push as read_push
    from mjx_inertia.grasping import rank_grasps as rank_grasps, sample_grasps as sample_grasps
    from mjx_inertia.identification import identify as identify
    from mjx_inertia.objects import (
        cuboid as cuboid,
        export_objects as export_objects,
        import_object as import_object,
        load_catalogue as load_catalogue,
        mass_properties as mass_properties,
    )
    from mjx_inertia.robots import load_robot as load_robot
    from mjx_inertia.runtime import configure as configure
    from mjx_inertia.space import plan_manoeuvre as plan_manoeuvre
    from mjx_inertia.spatial import InertialParameters as InertialParameters

_PLACES = {
    "InertialParameters": "mjx_inertia.spatial.InertialParameters",
    "SensorNoise": "mjx_inertia.dataset.noise.SensorNoise",
    "configure": "mjx_inertia.runtime.configure",
    "cuboid": "mjx_inertia.objects.cuboid",
    "export_objects": "mjx_inertia.objects.export_objects",
    "identify": "mjx_inertia.identification.identify",
    "import_object": "mjx_inertia.objects.import_object",
    "load_catalogue": "mjx_inertia.objects.load_catalogue",
    "load_robot": "mjx_inertia.robots.load_robot",
    "mass_properties": "mjx_inertia.objects.mass_properties",
    "plan_manoeuvre": "mjx_inertia.space.plan_manoeuvre",
    "rank_grasps": "mjx_inertia.grasping.rank_grasps",
    "read_push": "mjx_inertia.dataset.recording.read_push",
    "sample_grasps": "mjx_inertia.grasping.sample_grasps",
    "simulate_push": "mjx_inertia.dataset.push.simulate_push",
}

# The command `python -m mjx_inertia.identify` is a package whose name is that of a function here.
# Once it is imported, later imports of it set no attribute of this module.
importlib.import_module("mjx_inertia.identify")
del globals()["identify"]


def __getattr__(name: str) -> Any:
    """Imports a name at its first use (PEP 562)."""
    if name not in _PLACES:
        text = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(text, name=name, obj=sys.modules[__name__])
    module, _, defined = _PLACES[name].rpartition(".")
    globals()[name] = getattr(importlib.import_module(module), defined)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted(_PLACES)
