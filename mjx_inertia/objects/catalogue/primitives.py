"""Primitives: shapes to combine, with the three of the thesis' Table 3.2 among them.

In: sizes (m) and a density (kg/m³). Out: parts, upright on the table where that is stable and lying
where not. Unless said otherwise they are turned or sawn from beech, 700 kg/m³ at 12 % moisture
(Ashby, Materials Selection in Mechanical Design, appendix A), of a size that one hand can hold.
"""

import numpy as np
import trimesh
from manifold3d import Manifold

from mjx_inertia.objects.catalogue.assembly import prism_part, turned_part
from mjx_inertia.objects.catalogue.recipe import ALUMINIUM, WOOD, catalogue_object
from mjx_inertia.objects.catalogue.shaping import block, equal_area_ring
from mjx_inertia.objects.manifolds import from_manifold
from mjx_inertia.objects.model import Part, on_table, transformed, turned

_BEECH = WOOD.density
_FOAM = 27.0  # expanded polystyrene, of the thesis' cuboid: 0.4 kg in 0.015 m³
_SOLID_BEECH = "volume x 700 kg/m³ of beech (Ashby); no object of the thesis"
_TABLE_3_2 = "mass and I_zz from table 3.2 of the thesis; the height is such that it is "
_FINE = 96  # facets around what is mostly round

NATURAL = (0.87, 0.72, 0.53)
RED = (0.78, 0.22, 0.18)
GREEN = (0.25, 0.55, 0.30)
BLUE = (0.20, 0.40, 0.70)
YELLOW = (0.93, 0.75, 0.20)
METAL = (0.75, 0.77, 0.80)


@catalogue_object("Primitives", _SOLID_BEECH)
def sphere(radius: float = 0.05, density: float = _BEECH) -> tuple[Part, ...]:
    """A ball of 10 cm across."""
    return ellipsoid.build(radius, radius, radius, density, RED)


@catalogue_object("Primitives", _SOLID_BEECH)
def cube(edge: float = 0.1, density: float = _BEECH) -> tuple[Part, ...]:
    """Edges of 10 cm: the smallest of the cubes that the thesis pushes."""
    return (Part(from_manifold(block(edge, edge, edge)), density, NATURAL),)


@catalogue_object(
    "Primitives", "sizes and mass from chapter 6 of the thesis: polystyrene foam", mass=0.4
)
def cuboid(
    x: float = 0.5, y: float = 0.15, z: float = 0.2, density: float = _FOAM
) -> tuple[Part, ...]:
    """The cuboid of the thesis' chapter 6, uniform."""
    return (Part(from_manifold(block(x, y, z)), density, BLUE),)


@catalogue_object("Primitives", _SOLID_BEECH)
def cylinder(
    radius: float = 0.04, height: float = 0.12, density: float = _BEECH
) -> tuple[Part, ...]:
    """An upright cylinder, as wide as a can."""
    ring = equal_area_ring(radius, sections=_FINE)
    return (prism_part(ring, height, density=density, color=GREEN),)


@catalogue_object("Primitives", _SOLID_BEECH)
def cone(radius: float = 0.05, height: float = 0.12, density: float = _BEECH) -> tuple[Part, ...]:
    """An upright cone on its base."""
    profile = np.array([[0.0, 0.0], [radius, 0.0], [0.0, height]])
    return (turned_part(profile, density=density, color=YELLOW, sections=_FINE),)


@catalogue_object("Primitives", _SOLID_BEECH)
def ellipsoid(
    semi_x: float = 0.08,
    semi_y: float = 0.055,
    semi_z: float = 0.04,
    density: float = _BEECH,
    color: tuple[float, float, float] = BLUE,
) -> tuple[Part, ...]:
    """An ellipsoid on its flattest side, half axes along x, y and z."""
    semi_axes = (semi_x, semi_y, semi_z)
    mesh, coarse = _ellipsoid_mesh(semi_axes, 3), _ellipsoid_mesh(semi_axes, 2)
    return on_table(Part(mesh, density, color, (coarse.vertices,)))


@catalogue_object("Primitives", _TABLE_3_2 + "beech (710 kg/m³)", mass=1.0)
def elliptic_prism(
    semi_x: float = 0.15, semi_y: float = 0.0995, height: float = 0.03, density: float = _BEECH
) -> tuple[Part, ...]:
    """The ellipse of table 3.2: I_zz = m (a² + b²) / 4 asks for a² + b² = 0.0324 m²."""
    ring = equal_area_ring(semi_x, semi_y, _FINE)
    return (prism_part(ring, height, density=density, color=NATURAL),)


@catalogue_object("Primitives", _TABLE_3_2 + "beech (700 kg/m³)", mass=1.0)
def hexagonal_prism(
    side: float = 0.1, height: float = 0.055, density: float = _BEECH
) -> tuple[Part, ...]:
    """The regular hexagon of table 3.2: I_zz = 5/12 m s² asks for s = 0.100 m."""
    return (prism_part(_regular(6, side), height, density=density, color=GREEN),)


@catalogue_object("Primitives", _TABLE_3_2 + "beech (700 kg/m³)", mass=1.0)
def triangular_prism(
    side: float = 0.2224, height: float = 0.0667, density: float = _BEECH
) -> tuple[Part, ...]:
    """The triangle of table 3.2, equilateral: I_zz = m s² / 12 asks for s = 0.2224 m."""
    radius = side / np.sqrt(3.0)
    return (prism_part(_regular(3, radius), height, density=density, color=RED),)


@catalogue_object("Primitives", _SOLID_BEECH)
def wedge(
    length: float = 0.15, width: float = 0.08, height: float = 0.06, density: float = _BEECH
) -> tuple[Part, ...]:
    """A right triangle along x, `width` wide: a door wedge, twice as large."""
    corners = [(0.0, 0.0), (length, 0.0), (0.0, height)]
    points = [[x - length / 3.0, y, z] for x, z in corners for y in (-0.5 * width, 0.5 * width)]
    return (Part(from_manifold(Manifold.hull_points(np.array(points))), density, YELLOW),)


@catalogue_object("Primitives", _SOLID_BEECH)
def torus(
    ring_radius: float = 0.06, bar_radius: float = 0.02, density: float = _BEECH
) -> tuple[Part, ...]:
    """A lying ring of round section: `ring_radius` from its axis to the middle of the bar."""
    profile = np.add(equal_area_ring(bar_radius, sections=32), [ring_radius, bar_radius])
    return on_table(turned_part(profile, density=density, color=RED, sections=_FINE))


@catalogue_object("Primitives", _SOLID_BEECH)
def capsule(radius: float = 0.03, length: float = 0.1, density: float = _BEECH) -> tuple[Part, ...]:
    """A lying cylinder along x with round ends; `length` without them."""
    arc = np.linspace(0.0, 0.5 * np.pi, 17)
    end = radius * np.stack([np.cos(arc), np.sin(arc)], axis=-1) + [0.0, 0.5 * length]
    end[-1, 0] = 0.0
    profile = np.concatenate([end, end[::-1] * [1.0, -1.0]])
    part = turned_part(profile, density=density, color=BLUE)
    # the facets along the ends take away volume, too: scaled to that of the true shape
    true = np.pi * radius**2 * (length + 4.0 / 3.0 * radius)
    scale = (true / part.mesh.volume) ** (1.0 / 3.0)
    whole = transformed(part, np.diag([scale, scale, scale, 1.0]))
    return on_table(turned(whole, 90.0, (0.0, 1.0, 0.0)))


@catalogue_object(
    "Primitives", "volume x 2700 kg/m³ of aluminium (Ashby)", friction=ALUMINIUM.friction
)
def tube(
    outer: float = 0.05, wall: float = 0.004, height: float = 0.12, density: float = 2700.0
) -> tuple[Part, ...]:
    """An upright length of aluminium tube, 2700 kg/m³."""
    inner = outer - wall
    profile = np.array([[inner, 0.0], [outer, 0.0], [outer, height], [inner, height]])
    return (turned_part(profile, density=density, color=METAL, sections=_FINE),)


def _ellipsoid_mesh(semi_axes: tuple[float, float, float], subdivisions: int) -> trimesh.Trimesh:
    """Facets about the origin that enclose the volume of the true shape."""
    ball = trimesh.creation.icosphere(subdivisions)
    grow = (4.0 / 3.0 * np.pi / ball.volume) ** (1.0 / 3.0)
    return trimesh.Trimesh(ball.vertices * grow * semi_axes, ball.faces, process=False)


def _regular(sides: int, radius: float) -> np.ndarray:
    """Corners of a regular polygon on a circle, one of them on the x axis."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
