"""Pushing: flat and elongated things for the table, on their largest face.

In: sizes (m) and densities (kg/m³). Out: parts that lie on the table. The plain shapes are sawn
from boards of beech, 700 kg/m³, or medium-density fibreboard, 750 kg/m³ (Ashby, Materials Selection
in Mechanical Design, appendix A), as thick as boards are sold: 18 to 40 mm.
"""

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from mjx_inertia.objects.catalogue.assembly import prism_part, turned_part
from mjx_inertia.objects.catalogue.primitives import BLUE, GREEN, METAL, NATURAL, RED, YELLOW
from mjx_inertia.objects.catalogue.recipe import RUBBER, STEEL, WOOD, catalogue_object
from mjx_inertia.objects.catalogue.shaping import block, equal_area_ring
from mjx_inertia.objects.manifolds import from_manifold
from mjx_inertia.objects.model import Part, moved, on_table, turned

_BEECH = WOOD.density
_FIBREBOARD = 750.0
_BRICK = 1800.0  # fired clay
_TYRE = (0.12, 0.12, 0.13)
_BEECH_BOARD = "volume x 700 kg/m³ of beech (Ashby)"
_FIBRE_BOARD = "volume x 750 kg/m³ of medium-density fibreboard (Ashby)"


@catalogue_object("Pushing", _BEECH_BOARD)
def bar(
    length: float = 0.3, width: float = 0.045, height: float = 0.022, density: float = _BEECH
) -> tuple[Part, ...]:
    """A planed batten."""
    return (Part(from_manifold(block(length, width, height)), density, NATURAL),)


@catalogue_object("Pushing", _BEECH_BOARD)
def l_shape(
    x: float = 0.22,
    y: float = 0.16,
    width: float = 0.05,
    height: float = 0.03,
    density: float = _BEECH,
) -> tuple[Part, ...]:
    """Two legs of lengths `x` and `y` at a right angle."""
    area = shapely.union(_from_corner(x, width), _from_corner(width, y))
    return _board(area, height, density, BLUE)


@catalogue_object("Pushing", _BEECH_BOARD)
def t_shape(
    bar_length: float = 0.2,
    stem_length: float = 0.15,
    width: float = 0.05,
    height: float = 0.03,
    density: float = _BEECH,
) -> tuple[Part, ...]:
    """A bar with a stem amid its side: 5 cm squares, four along the bar and three down the stem."""
    across = translate(_from_corner(bar_length, width), -0.5 * bar_length, 0.0)
    stem = translate(_from_corner(width, stem_length), -0.5 * width, -stem_length)
    return _board(shapely.union(across, stem), height, density, RED)


@catalogue_object("Pushing", _BEECH_BOARD)
def cross(
    length: float = 0.22,
    breadth: float = 0.22,
    width: float = 0.06,
    height: float = 0.03,
    density: float = _BEECH,
) -> tuple[Part, ...]:
    """Two bars that halve each other."""
    bars = [(length, width), (width, breadth)]
    area = shapely.union_all([shapely.box(-x / 2, -y / 2, x / 2, y / 2) for x, y in bars])
    return _board(area, height, density, GREEN)


@catalogue_object("Pushing", _BEECH_BOARD)
def trapezium(
    base: float = 0.24,
    top: float = 0.14,
    depth: float = 0.11,
    height: float = 0.03,
    density: float = _BEECH,
) -> tuple[Part, ...]:
    """A symmetric trapezium."""
    ring = [(-base / 2, 0.0), (base / 2, 0.0), (top / 2, depth), (-top / 2, depth)]
    return _board(shapely.Polygon(ring), height, density, YELLOW)


@catalogue_object("Pushing", _FIBRE_BOARD)
def u_shape(
    length: float = 0.18,
    breadth: float = 0.15,
    width: float = 0.04,
    height: float = 0.03,
    density: float = _FIBREBOARD,
) -> tuple[Part, ...]:
    """A yoke that is open towards +y."""
    inside = translate(_from_corner(length - 2 * width, breadth), width, width)
    return _board(_from_corner(length, breadth).difference(inside), height, density, RED)


@catalogue_object("Pushing", _FIBRE_BOARD)
def z_shape(
    edge: float = 0.07, height: float = 0.03, density: float = _FIBREBOARD
) -> tuple[Part, ...]:
    """Four squares in two rows that overlap by one."""
    low, high = _from_corner(2 * edge, edge), _from_corner(2 * edge, edge)
    area = shapely.union(translate(low, edge, 0.0), translate(high, 0.0, edge))
    return _board(area, height, density, BLUE)


@catalogue_object("Pushing", _FIBRE_BOARD)
def half_disc(
    radius: float = 0.11, height: float = 0.03, density: float = _FIBREBOARD
) -> tuple[Part, ...]:
    """Half a round table top for dolls: as flat and round as a protractor."""
    angle = np.linspace(0.0, np.pi, 49)
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return _board(shapely.Polygon(ring), height, density, NATURAL)


@catalogue_object("Pushing", _BEECH_BOARD)
def boomerang(
    span: float = 0.3,
    width: float = 0.055,
    height: float = 0.009,
    angle_deg: float = 110.0,
    density: float = _BEECH,
) -> tuple[Part, ...]:
    """Two blades that meet at `angle_deg`: 30 cm from tip to tip, of 9 mm plywood."""
    half = np.radians(0.5 * angle_deg)
    reach = 0.5 * span / np.sin(half) - 0.5 * width
    spine = [(-reach * np.sin(half), reach * np.cos(half)), (0.0, 0.0)]
    spine.append((-spine[0][0], spine[0][1]))
    area = shapely.LineString(spine).buffer(0.5 * width, quad_segs=10)
    smooth = area.buffer(0.3 * width, quad_segs=10).buffer(-0.3 * width, quad_segs=10)
    return _board(smooth.simplify(1e-4), height, density, YELLOW)


@catalogue_object("Pushing", _BEECH_BOARD)
def cutting_board(
    length: float = 0.3,
    width: float = 0.2,
    height: float = 0.018,
    handle_length: float = 0.11,
    handle_width: float = 0.055,
    density: float = _BEECH,
) -> tuple[Part, ...]:
    """A kitchen board of beech with a handle, and a hole in it to hang it up."""
    plate = shapely.box(-length / 2, -width / 2, length / 2, width / 2).buffer(-0.02).buffer(0.02)
    grip = shapely.LineString([(0.0, 0.0), (length / 2 + handle_length - handle_width / 2, 0.0)])
    whole = shapely.union(plate, grip.buffer(0.5 * handle_width, quad_segs=8))
    whole = whole.buffer(0.015).buffer(-0.015).simplify(1e-4)
    hole = shapely.Point(length / 2 + handle_length - handle_width / 2, 0.0)
    area = whole.difference(hole.buffer(0.011, quad_segs=6))
    return _board(area, height, density, NATURAL)


@catalogue_object(
    "Pushing", "volume x 1800 kg/m³, the middle of fired clay's 1600 to 2000", friction=0.55
)
def clay_brick(
    length: float = 0.215, width: float = 0.1025, height: float = 0.065, density: float = _BRICK
) -> tuple[Part, ...]:
    """A solid brick of the British standard size, with three holes through it."""
    area = shapely.box(-length / 2, -width / 2, length / 2, width / 2)
    for x in (-0.3 * length, 0.0, 0.3 * length):
        area = area.difference(shapely.Point(x, 0.0).buffer(0.17 * width, quad_segs=6))
    return _board(area, height, density, (0.65, 0.31, 0.22))


@catalogue_object("Pushing", "volumes x densities of beech, rubber and plastic (Ashby)")
def car_on_wheels(
    length: float = 0.22,
    width: float = 0.085,
    wheel_radius: float = 0.024,
    wheel_width: float = 0.018,
    density: float = _BEECH,
) -> tuple[Part, ...]:
    """A saloon cut from a plank, on four wheels with rubber tyres that stand out at its sides."""
    side = np.array(
        [
            [0.00, 0.30], [0.00, 0.70], [0.03, 0.80], [0.20, 0.84], [0.30, 1.38], [0.62, 1.38],
            [0.76, 0.86], [0.97, 0.78], [1.00, 0.60], [1.00, 0.30],
        ]
    )  # fmt: skip
    scale = [length, 2.2 * wheel_radius]
    plank = prism_part(side * scale - [0.5 * length, 0.0], width, density=density, color=RED)
    body = moved(turned(plank, 90.0, (1.0, 0.0, 0.0)), (0.0, 0.5 * width, 0.0))
    parts = [body, *_windows(side * scale - [0.5 * length, 0.0], width)]
    for x in (-0.3 * length, 0.3 * length):
        for out in (-1.0, 1.0):
            wheel = _wheel(wheel_radius, wheel_width)
            place = (x, out * 0.5 * width, wheel_radius)
            parts += [moved(turned(part, -90.0 * out, (1.0, 0.0, 0.0)), place) for part in wheel]
    return on_table(*parts)


def _wheel(radius: float, width: float) -> list[Part]:
    """Tyre and hub about the z axis, outwards from z = 0."""
    rim, soft = 0.62 * radius, 0.12 * radius
    tread = [(radius, soft), (radius, width - soft), (radius - soft, width), (rim, width)]
    profile = np.array([(rim, 0.0), (radius - soft, 0.0), *tread])
    tyre = turned_part(profile, density=RUBBER.density, color=_TYRE)
    ring = equal_area_ring(rim)
    hub = prism_part(ring, 0.9 * width, density=STEEL.density / 6.0, color=METAL)
    return [tyre, hub]


def _windows(side: np.ndarray, width: float) -> list[Part]:
    """Thin panes on both sides below the roof."""
    sill, lintel = 0.71 * side[4, 1], 0.95 * side[4, 1]  # m above the table
    rear, front = side[3:5], side[5:7]
    ring = np.array(
        [
            (np.interp(z, *post[order].T[::-1]) + inset, z)
            for post, order, inset, heights in (
                (rear, [0, 1], 0.006, (lintel, sill)),
                (front, [1, 0], -0.006, (sill, lintel)),
            )
            for z in heights
        ]
    )
    pane = prism_part(ring, 0.001, density=1200.0, color=(0.75, 0.87, 0.95))
    upright = turned(pane, 90.0, (1.0, 0.0, 0.0))
    return [moved(upright, (0.0, y, 0.0)) for y in (-0.5 * width, 0.5 * width + 0.001)]


def _from_corner(x: float, y: float) -> shapely.Polygon:
    return shapely.box(0.0, 0.0, x, y)


def _board(
    area: BaseGeometry, height: float, density: float, color: tuple[float, float, float]
) -> tuple[Part, ...]:
    """A board with its centroid on the z axis."""
    centred = translate(area, -area.centroid.x, -area.centroid.y)
    return (prism_part(centred, height, density=density, color=color),)
