"""What the thesis' experiments name, beside the prisms of `primitives`.

In: sizes (m), densities (kg/m³), positions of sliding weights (m). Out: parts at rest. Of the six
objects of Table 3.2 the thesis gives mass and I_zz alone; sizes are ours, chosen so that both are
met (`TABLE_3_2`), at densities of real materials.
"""

import itertools

import numpy as np
import shapely
import trimesh
from manifold3d import Manifold

from mjx_inertia.objects.catalogue.assembly import prism_part, turned_part
from mjx_inertia.objects.catalogue.recipe import ABS, ALUMINIUM, CARDBOARD, STEEL, catalogue_object
from mjx_inertia.objects.catalogue.shaping import (
    block,
    equal_area_factor,
    equal_area_ring,
    outline,
    plate,
    rod,
)
from mjx_inertia.objects.manifolds import from_manifold
from mjx_inertia.objects.model import Part, moved, on_table, turned

# Mass (kg) and I_zz about the CoM (kg m²) of the six novel objects, thesis Table 3.2.
TABLE_3_2: dict[str, tuple[float, float]] = {
    "elliptic_prism": (1.0, 80.982e-4),
    "hexagonal_prism": (1.0, 41.700e-4),
    "triangular_prism": (1.0, 41.214e-4),
    "saucepan": (0.8, 70.381e-4),
    "tank": (0.5, 13.947e-4),
    "rock": (2.5, 77.723e-4),
}

_PHENOLIC = 1350.0  # kg/m³, of black pan handles
_GRANITE = 2650.0
_TABLE = "mass and I_zz from table 3.2 of the thesis; "
_STEEL_GREY = (0.45, 0.47, 0.50)
_BRIGHT = (0.78, 0.79, 0.81)
_BLACK = (0.13, 0.13, 0.14)
_OLIVE = (0.36, 0.40, 0.22)
_DARK_OLIVE = (0.22, 0.25, 0.14)


@catalogue_object("Home", _TABLE + "aluminium 3 mm thick with a phenolic handle", mass=0.8)
def saucepan(
    radius: float = 0.09,
    height: float = 0.085,
    wall: float = 0.003,
    base: float = 0.005,
    handle_length: float = 0.148,
    metal_density: float = ALUMINIUM.density,
    handle_density: float = _PHENOLIC,
) -> tuple[Part, ...]:
    """An aluminium pan of 18 cm with a long black handle along +x."""
    round_off = 0.006
    arc = np.linspace(-0.5 * np.pi, 0.0, 7)
    corner = np.stack([np.cos(arc), np.sin(arc)], axis=-1)
    outer = [radius - round_off, round_off] + round_off * corner
    inner = [radius - round_off, base + round_off - wall] + (round_off - wall) * corner[::-1]
    rim = np.array([[radius, height], [radius - wall, height]])
    profile = np.concatenate([[[0.0, 0.0]], outer, rim, inner, [[0.0, base]]])
    pan = turned_part(profile, density=metal_density, color=_BRIGHT)
    middle = height - 0.022  # of the handle where it begins
    bracket = block(0.04, 0.022, 0.012).translate((radius + 0.012, 0.0, middle - 0.006))
    bracket -= plate(outline(equal_area_ring(radius)), height)
    start = radius + 0.032
    path = [(0.0, 0.0), (0.35, 0.006), (0.75, 0.016), (1.0, 0.020)]
    stations = [(start + t * handle_length, middle + rise) for t, rise in path]
    widths = [(0.010, 0.008), (0.014, 0.009), (0.015, 0.009), (0.010, 0.007)]
    handle = _loft(stations, widths, handle_density)
    return (pan, Part(from_manifold(bracket), metal_density, _STEEL_GREY), handle)


@catalogue_object("Toys", _TABLE + "hollow plastic with full tracks", mass=0.5, friction=0.5)
def tank(
    length: float = 0.16,
    width: float = 0.1,
    height: float = 0.07,
    barrel_length: float = 0.075,
    density: float = 0.52 * ABS.density,
) -> tuple[Part, ...]:
    """A toy battle tank, its barrel along +x: hollow plastic on full tracks."""
    band, track = 0.2 * width, 0.5 * height
    ends = shapely.LineString([(track / 2 - length / 2, 0.0), (length / 2 - track / 2, 0.0)])
    around = np.asarray(ends.buffer(track / 2, quad_segs=8).exterior.coords)[:-1]
    lane = np.add(around, [0.0, track / 2])
    parts = []
    for side in (-1.0, 1.0):
        y = 0.5 * side * (width - band)
        parts.append(_along_y(lane, band, y, 2.0 * density, _BLACK))
        for x in np.linspace(-0.32, 0.32, 4) * length:
            ring = equal_area_ring(0.36 * track)
            wheel = prism_part(ring, 0.003, density=density, color=_DARK_OLIVE)
            out = turned(wheel, -90.0 * side, (1.0, 0.0, 0.0))
            parts.append(moved(out, (x, 0.5 * side * width, 0.5 * track)))
    belly = [(-0.46, 0.25), (0.40, 0.25), (0.46, 0.6), (0.46, 1.0), (-0.46, 1.0)]
    deck = [(-0.5, 1.0), (0.52, 1.0), (0.36, 1.32), (-0.46, 1.32)]
    inside = width - 2.0 * band
    parts.append(_along_y(np.array(belly) * [length, track], inside, 0.0, density, _OLIVE))
    parts.append(_along_y(np.array(deck) * [length, track], width, 0.0, density, _OLIVE))
    low, high = 1.32 * track, height
    ring = np.array([(0.2, -0.16), (0.2, 0.16), (0.06, 0.3), (-0.24, 0.3), (-0.32, 0.0)])
    ring = np.concatenate([ring, ring[3:1:-1] * [1.0, -1.0]]) * [length, width]
    corners = [np.c_[ring * s, np.full(len(ring), z)] for s, z in ((1.0, low), (0.8, high))]
    turret = Manifold.hull_points(np.concatenate(corners))
    hatch = prism_part(equal_area_ring(0.1 * width), 0.005, density=density, color=_OLIVE)
    middle = 0.5 * (low + high)
    breech, muzzle = (0.15 * length, 0.0, middle), (0.18 * length + barrel_length, 0.0, middle)
    gun = rod(breech, muzzle, 0.0042 * equal_area_factor(24), segments=24) - turret
    return (
        *parts,
        Part(from_manifold(turret), density, _DARK_OLIVE),
        moved(hatch, (-0.08 * length, 0.0, high)),
        Part(from_manifold(gun), density, _DARK_OLIVE),
    )


@catalogue_object("Pushing", _TABLE + "granite, 2650 kg/m³", mass=2.5, friction=0.6)
def rock(
    x: float = 0.202, y: float = 0.15, z: float = 0.0572, density: float = _GRANITE
) -> tuple[Part, ...]:
    """A flat field stone, rough but convex, that lies on a worn side; extents along the axes."""
    ball = trimesh.creation.icosphere(subdivisions=2).vertices
    waves = np.array([[2.3, 1.1, -1.7], [-1.9, 2.9, 0.8], [3.1, -2.2, 2.4], [-4.3, 3.7, 1.9]])
    bumps = np.sin(ball @ waves.T + [0.4, 1.7, 2.9, 5.1]) @ [0.09, 0.07, 0.06, 0.05]
    points = ball * (1.0 + bumps)[:, None]
    points[:, 2] = np.maximum(points[:, 2], -0.55)
    low, high = points.min(axis=0), points.max(axis=0)
    points = (points - [*(0.5 * (low + high))[:2], low[2]]) / (high - low) * [x, y, z]
    return (Part(from_manifold(Manifold.hull_points(points)), density, (0.50, 0.49, 0.47)),)


@catalogue_object("Home", "sizes and mass from §5.3.1 of the thesis", mass=0.34, friction=0.35)
def book(
    length: float = 0.22,
    width: float = 0.15,
    thickness: float = 0.015,
    board: float = 0.0022,
    page_density: float = 720.0,
    board_density: float = 5.0 * CARDBOARD.density,
) -> tuple[Part, ...]:
    """A bound book of 22 × 15 × 1.5 cm (§5.3.1), its spine along y on the side of -x."""
    inset = 0.003
    half = 0.5 * width
    spine = [(-half, 0.0), (half, 0.0), (half, board), (board - half, board)]
    over = [(board - half, thickness - board), (half, thickness - board), (half, thickness)]
    ring = np.array([*spine, *over, (-half, thickness)])
    cover = _along_y(ring, length, 0.0, board_density, (0.50, 0.12, 0.14))
    size = (width - board - inset, length - 2.0 * inset, thickness - 2.0 * board)
    pages = block(*size).translate((0.5 * (board - inset), 0.0, board))
    return (cover, Part(from_manifold(pages), page_density, (0.95, 0.93, 0.86)))


@catalogue_object("Primitives", "sizes and mass from §4.5.2 of the thesis", mass=0.3)
def disk_with_weights(
    radius: float = 0.15,
    height: float = 0.05,
    weight_radius: float = 0.05,
    weight_height: float = 0.03,
    weight_offset: float = 0.1,
    handle_radius: float = 0.02,
    handle_length: float = 0.2,
    weight_density_ratio: float = 5.0,
) -> tuple[Part, ...]:
    """The disk with four weights and a handle of §4.5.2, weights along x, two above and two below.

    Sizes and the total of 0.3 kg are the thesis'. It calls the weights heavy without saying how
    heavy: `weight_density_ratio` is their density over that of disk and handle, and puts 0.16 kg
    into the weights.
    """
    foam, heavy, red = 50.0, weight_density_ratio * 50.0, (0.75, 0.30, 0.20)
    top = weight_height + height
    area = equal_area_ring(radius)
    disk = prism_part(area, height, weight_height, density=foam, color=(0.35, 0.55, 0.75))
    area = equal_area_ring(handle_radius)
    handle = prism_part(area, handle_length, top, density=foam, color=_BLACK)
    area = equal_area_ring(weight_radius)
    weights = [
        prism_part(np.add(area, [x, 0.0]), weight_height, z, density=heavy, color=red)
        for x in (-weight_offset, weight_offset)
        for z in (0.0, top)
    ]
    return (disk, handle, *weights)


@catalogue_object("Primitives", "mass from §5.3.1 of the thesis, sizes our choice", mass=0.43)
def tensor_object(
    handle_ring: float = 0.08,
    x_plus: float = 0.08,
    x_minus: float = 0.08,
    y_plus: float = 0.08,
    y_minus: float = 0.08,
    arm_length: float = 0.15,
    arm_radius: float = 0.006,
    ring_radius: float = 0.0175,
    ring_width: float = 0.01,
) -> tuple[Part, ...]:
    """The tensor object of §5.3.1: five cylinders that cross, each with a ring that slides.

    The first five parameters are distances of the rings' middles from the crossing. The handle
    points up along z (the thesis' x axis) and the other four arms lie along ±x and ±y, borne by
    their rings. The total of 0.43 kg is the thesis'; plastic arms and steel rings of these sizes
    weigh as much within 1 %.

    Raises:
      ValueError: a ring off its arm.
    """
    hub = 0.008
    low, high = hub + 0.5 * ring_width, hub + arm_length - 0.5 * ring_width
    place = {
        "handle_ring": (handle_ring, 0.0, (0.0, 1.0, 0.0)),
        "x_plus": (x_plus, 90.0, (0.0, 1.0, 0.0)),
        "x_minus": (x_minus, -90.0, (0.0, 1.0, 0.0)),
        "y_plus": (y_plus, -90.0, (1.0, 0.0, 0.0)),
        "y_minus": (y_minus, 90.0, (1.0, 0.0, 0.0)),
    }
    edge = 0.2 * ring_width
    rim = [(ring_radius - edge, 0.0), (ring_radius, edge), (ring_radius, ring_width - edge)]
    bore = [(arm_radius, 0.0), *rim, (ring_radius - edge, ring_width), (arm_radius, ring_width)]
    cube = block(2 * hub, 2 * hub, 2 * hub).translate((0.0, 0.0, -hub))
    parts = [Part(from_manifold(cube), ABS.density, _BLACK)]
    for name, (distance, angle, axis) in place.items():
        if not low <= distance <= high:
            raise ValueError(
                f"{name}: {distance} m is off the arm; choose from {low:.4g} to {high:.4g} m"
            )
        area = equal_area_ring(arm_radius)
        arm = prism_part(area, arm_length, hub, density=ABS.density, color=_BRIGHT)
        color = (0.15, 0.30, 0.75) if name == "handle_ring" else _BLACK
        ring = turned_part(np.array(bore), density=STEEL.density, color=color)
        lifted = moved(ring, (0.0, 0.0, distance - 0.5 * ring_width))
        parts += [turned(arm, angle, axis), turned(lifted, angle, axis)]
    return on_table(*parts)


def _along_y(
    ring: np.ndarray, width: float, y: float, density: float, color: tuple[float, float, float]
) -> Part:
    """An outline in x and z made `width` thick about the given y."""
    flat = prism_part(ring, width, density=density, color=color)
    return moved(turned(flat, 90.0, (1.0, 0.0, 0.0)), (0.0, y + 0.5 * width, 0.0))


def _loft(
    stations: list[tuple[float, float]], widths: list[tuple[float, float]], density: float
) -> Part:
    """A handle of elliptic section, black, through points in x and z of half widths in y and z."""
    place, half = np.array(stations), np.array(widths)
    section = equal_area_ring(1.0, sections=24)

    def carried(vertices: np.ndarray) -> np.ndarray:
        ring = np.rint(vertices[:, 2]).astype(int)
        across = place[ring, 1] + vertices[:, 1] * half[ring, 1]
        return np.column_stack([place[ring, 0], vertices[:, 0] * half[ring, 0], across])

    # section by section; from one to the next it is convex
    steps = len(stations) - 1
    solid = Manifold.extrude(outline(section), steps, steps - 1).warp_batch(carried)
    rings = [carried(np.c_[section, np.full(24, i)]) for i in range(steps + 1)]
    pieces = tuple(np.concatenate(pair) for pair in itertools.pairwise(rings))
    return Part(from_manifold(solid), density, _BLACK, pieces)
