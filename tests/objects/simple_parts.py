"""Boxes and round parts with volumes of the true shapes, for objects made in tests."""

import numpy as np
import trimesh

from mjx_inertia.objects import Part
from mjx_inertia.objects.catalogue.assembly import prism_part, turned_part
from mjx_inertia.objects.catalogue.shaping import equal_area_ring
from mjx_inertia.objects.model import moved

GREY = (0.6, 0.6, 0.6)


def box(size, base=(0.0, 0.0, 0.0), *, density=1.0, color=GREY):
    """`base` is the middle of the lower face."""
    mesh = trimesh.creation.box(size).apply_translation(np.add(base, [0.0, 0.0, 0.5 * size[2]]))
    return Part(mesh, density, color)


def extrusion(plan, height, *, density=1.0):
    return prism_part(plan, height, density=density, color=GREY)


def cylinder(radius, height, base=(0.0, 0.0, 0.0), *, density=1.0):
    ring = equal_area_ring(radius) + np.array(base[:2])
    return prism_part(ring, height, base[2], density=density, color=GREY)


def revolution(profile, *, density=1.0):
    return turned_part(np.array(profile), density=density, color=GREY)


def tube(outer, inner, height, base=(0.0, 0.0, 0.0), *, density=1.0):
    profile = [[inner, 0.0], [outer, 0.0], [outer, height], [inner, height]]
    return moved(revolution(profile, density=density), base)
