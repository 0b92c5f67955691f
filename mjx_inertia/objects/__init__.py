"""Shapes with their true inertia: primitives, prisms on an outline, published objects."""

from mjx_inertia.objects.convex_pieces import area_error, convex_pieces
from mjx_inertia.objects.mcube import load_mcube_objects
from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.outline import (
    OutlineContact,
    PlanarIntegrals,
    closest_on_outline,
    friction_radius,
    planar_integrals,
)
from mjx_inertia.objects.prism import cube, cuboid, prism

__all__ = [
    "ObjectModel",
    "OutlineContact",
    "PlanarIntegrals",
    "area_error",
    "closest_on_outline",
    "convex_pieces",
    "cube",
    "cuboid",
    "friction_radius",
    "load_mcube_objects",
    "planar_integrals",
    "prism",
]
