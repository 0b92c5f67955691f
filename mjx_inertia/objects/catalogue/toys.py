"""Toys that are neither animal nor vehicle: ball, dumbbell, brick, spinning top, stacking rings.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

import numpy as np
import trimesh
from manifold3d import CrossSection, Manifold, OpType

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ABS,
    BARE_STEEL,
    BARE_WOOD,
    BLACK,
    BLUE,
    RED,
    RUBBER,
    STEEL,
    VINYL,
    WHITE,
    WOOD,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    arc,
    block,
    lathe,
    plate,
    rod,
    spline,
)
from mjx_inertia.objects.model import Part

_BEECH = "turned and sawn beech, 700 kg/m³"
PALETTE = (
    (0.85, 0.1, 0.1),
    (0.95, 0.5, 0.05),
    (0.97, 0.85, 0.1),
    (0.15, 0.6, 0.2),
    (0.1, 0.35, 0.8),
    (0.5, 0.2, 0.65),
)


@catalogue_object(
    "Toys",
    "a football: cover and bladder of 2.7 mm at 1100 kg/m³, within the 0.41 to 0.45 kg and "
    "68 to 70 cm around of the Laws of the Game",
    friction=RUBBER.friction,
)
def ball(
    diameter: float = 0.22,
    wall: float = 0.0027,  # of cover and bladder together
    density: float = 1100.0,  # mean of cover and bladder
) -> tuple[Part, ...]:
    """A football with twelve black pentagons."""
    radius = 0.5 * diameter
    shell = Manifold.sphere(radius, 48) - Manifold.sphere(radius - wall, 48)
    corners = trimesh.creation.icosahedron().vertices
    edge = np.min(np.linalg.norm(corners[1:] - corners[0], axis=1))
    panels = []
    for corner in corners:
        gap = np.linalg.norm(corners - corner, axis=1)
        near = corners[(gap > 0.0) & (gap < 1.1 * edge)]
        rim = (2.0 * corner + near) / 3.0  # the truncated icosahedron
        panels.append(Manifold.hull_points(np.vstack([0.5 * rim, 1.5 * rim]) * radius))
    black, white = shell.split(Manifold.batch_boolean(panels, OpType.Add))
    return assemble(Piece(black, density, BLACK), Piece(white, density, WHITE))


@catalogue_object(
    "Toys",
    "cast iron, 7200 kg/m³, and steel at the sizes of a 2 kg dumbbell",
    friction=VINYL.friction,
)
def dumbbell(
    length: float = 0.19,
    head_width: float = 0.0595,  # across the flats
    head_length: float = 0.038,
    handle_diameter: float = 0.026,  # the largest
    head_density: float = 7200.0,  # of cast iron
    handle_density: float = STEEL.density,
) -> tuple[Part, ...]:
    """A dumbbell with hexagonal heads, lying on them."""
    hexagon = CrossSection.circle(head_width / np.sqrt(3.0), 6).rotate(30.0)
    head = plate(hexagon, head_length, 0.006).rotate((0.0, 90.0, 0.0))
    heads = head.translate((0.5 * length - head_length, 0.0, 0.0))
    heads += head.translate((-0.5 * length, 0.0, 0.0))
    free, big = length - 2.0 * head_length, 0.5 * handle_diameter
    swell = spline([(0.8, -0.5), (0.86, -0.4), (1.0, 0.0), (0.86, 0.4), (0.8, 0.5)], 24)
    swell = swell * (big, free)
    grip = lathe(np.vstack([[(0.0, -0.5 * free)], swell, [(0.0, 0.5 * free)]]), 32)
    return assemble(
        Piece(heads, head_density, BLUE),
        Piece(grip.rotate((0.0, 90.0, 0.0)), handle_density, BARE_STEEL),
    )


@catalogue_object(
    "Toys",
    "ABS, 1050 kg/m³, in the proportions of a brick of 4 x 2 studs, 16 mm apart",
    friction=ABS.friction,
)
def building_brick(
    pitch: float = 0.016,  # between studs; studs and walls scale with it
    columns: int = 4,  # studs along x
    rows: int = 2,  # studs along y
    height: float = 0.0192,  # without the studs
    density: float = ABS.density,
) -> tuple[Part, ...]:
    """A hollow building brick with studs on top and tubes inside."""
    wall, roof, gap = 0.15 * pitch, 0.125 * pitch, 0.0125 * pitch
    x, y = columns * pitch - 2.0 * gap, rows * pitch - 2.0 * gap
    brick = block(x, y, height) - block(x - 2.0 * wall, y - 2.0 * wall, height - roof)
    stud = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.285, 0.225), (0.0, 0.225)]
    knob = lathe(np.array(stud) * pitch, 24)
    tube = CrossSection.circle(0.407 * pitch, 24) - CrossSection.circle(0.3 * pitch, 24)
    leg = plate(tube, height - 0.5 * roof)
    for i in range(columns):
        for j in range(rows):
            u, v = (i - 0.5 * (columns - 1)) * pitch, (j - 0.5 * (rows - 1)) * pitch
            brick += knob.translate((u, v, height))
            if i and j:
                brick += leg.translate((u - 0.5 * pitch, v - 0.5 * pitch, 0.0))
    return assemble(Piece(brick, density, RED))


@catalogue_object("Toys", _BEECH, friction=WOOD.friction)
def spinning_top(
    diameter: float = 0.07,
    height: float = 0.075,  # from the tip to the end of the stem
    density: float = WOOD.density,
) -> tuple[Part, ...]:
    """A turned wooden top with coloured rings, leaning on its rim."""
    belly = spline([(0.06, 0.015), (0.16, 0.06), (0.55, 0.2), (0.94, 0.36), (1.0, 0.42)], 16)
    above = spline([(0.96, 0.47), (0.6, 0.53), (0.2, 0.6), (0.11, 0.72), (0.1, 0.9)], 14)
    end = [(0.14, 0.94), (0.14, 0.98), (0.1, 1.0), (0.0, 1.0)]
    profile = np.vstack([[(0.0, 0.0)], belly, above, end]) * (0.5 * diameter, height)
    body = lathe(profile)
    rings = []
    for level in (0.62, 0.52, 0.44, 0.38, 0.28, 0.16):
        above_it, body = body.split_by_plane((0.0, 0.0, 1.0), level * height)
        rings.append(above_it)
    colors = (BARE_WOOD, PALETTE[0], PALETTE[2], PALETTE[4], PALETTE[3], PALETTE[0])
    return assemble(
        *(Piece(ring, density, color) for ring, color in zip(rings, colors, strict=True)),
        Piece(body, density, BARE_WOOD),
    )


@catalogue_object("Toys", _BEECH, friction=WOOD.friction)
def stacking_rings(
    base_diameter: float = 0.12,  # of the base plate and, nearly, of the lowest ring
    ring_height: float = 0.022,
    count: int = 5,  # rings
    post_diameter: float = 0.018,
    density: float = WOOD.density,
) -> tuple[Part, ...]:
    """Wooden rings of falling size on a post with a ball on top."""
    base_height, post = 0.014, 0.5 * post_diameter
    base = plate(CrossSection.circle(0.5 * base_diameter, 48), base_height, 0.004)
    top = base_height + count * ring_height
    knob = 1.35 * post
    stand = base + rod((0.0, 0.0, 0.0), (0.0, 0.0, top + knob), post, -1.0, 32)
    crown = Manifold.sphere(knob, 32).translate((0.0, 0.0, top + 0.95 * knob))
    crown = crown.trim_by_plane((0.0, 0.0, 1.0), top)
    pieces = [Piece(stand, density, BARE_WOOD), Piece(crown, density, PALETTE[0])]
    for index in range(count):
        outer = 0.48 * base_diameter * (1.0 - 0.62 * index / count)
        half = 0.5 * ring_height
        rim = arc((outer - half, half), half, -80.0, 80.0, 10)
        ring = lathe([(post, 0.0), *rim, (post, ring_height)], 36)
        lift = base_height + index * ring_height
        color = PALETTE[(5 - index) % len(PALETTE)]
        pieces.append(Piece(ring.translate((0.0, 0.0, lift)), density, color))
    return assemble(*pieces)
