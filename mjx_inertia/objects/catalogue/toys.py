"""Toys that do not drive: ball, dumbbell, brick, spinning top, stacking rings, animal figures.

In: sizes (m) and densities (kg/m³). Out: parts at rest; animals look along +x.
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
    PLUSH,
    PVC,
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
    ellipsoid_manifold,
    lathe,
    limb,
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


_FIGURE = "solid PVC, 1300 kg/m³, as small animal figures are"


@catalogue_object("Toys", "soft PVC, 1200 kg/m³, walls of 2 mm, hollow", friction=VINYL.friction)
def duck(
    length: float = 0.1,  # from beak to tail; the figure scales with it
    wall: float = 0.002,
    density: float = VINYL.density,
) -> tuple[Part, ...]:
    """A bath duck, hollow, on its flattened belly."""
    scale = length / 0.1125
    thin = wall / scale
    feathers = _duck_body(0.0) - _duck_body(thin).trim_by_plane((0.0, 0.0, 1.0), thin)
    beak = ellipsoid_manifold((0.046, 0.0, 0.062), (0.016, 0.013, 0.0035), 24)
    beak += ellipsoid_manifold((0.043, 0.0, 0.0575), (0.012, 0.0105, 0.003), 24)
    whites, pupils = Manifold(), Manifold()
    for side in (-1.0, 1.0):
        whites += ellipsoid_manifold((0.0335, side * 0.0125, 0.0705), (0.0055, 0.0055, 0.0065), 20)
        pupils += ellipsoid_manifold((0.0372, side * 0.0148, 0.071), (0.0028, 0.0028, 0.0036), 16)
    shallow, deep = _duck_body(0.3 * thin), _duck_body(0.6 * thin)  # how far eyes and beak go in
    return assemble(
        Piece(pupils - shallow, density, BLACK),
        Piece(whites - deep, density, WHITE),
        Piece(beak - deep, density, (0.95, 0.42, 0.05)),
        Piece(feathers, density, (0.98, 0.82, 0.1)),
        scale=scale,
    )


def _duck_body(inset: float) -> Manifold:
    """Body, head, tail and wings, each shrunk by `inset`, m; cut flat at z = 0."""
    body = ellipsoid_manifold((0.0, 0.0, 0.022), (0.042 - inset, 0.033 - inset, 0.027 - inset))
    head = ellipsoid_manifold((0.022, 0.0, 0.065), (0.0225 - inset, 0.021 - inset, 0.021 - inset))
    neck = limb([(0.014, 0.0, 0.035), (0.02, 0.0, 0.055)], [0.021 - inset, 0.017 - inset], 32)
    tail = limb([(-0.024, 0.0, 0.03), (-0.046, 0.0, 0.047)], [0.018 - inset, 0.0045 - inset])
    wings = Manifold()
    for side in (-1.0, 1.0):
        wing = ellipsoid_manifold(
            (0.0, 0.0, 0.0), (0.024 - inset, 0.007 - inset, 0.013 - inset), 24
        )
        wing += ellipsoid_manifold(
            (-0.016, 0.0, 0.005), (0.014 - inset, 0.005 - inset, 0.008 - inset), 24
        )
        wings += wing.rotate((0.0, 8.0, 0.0)).translate((-0.008, side * 0.0305, 0.03))
    return (body + head + neck + tail + wings).trim_by_plane((0.0, 0.0, 1.0), 0.0)


@catalogue_object("Toys", _FIGURE, friction=PVC.friction)
def dog(
    length: float = 0.13,  # from nose to tail; the figure scales with it
    density: float = PVC.density,
) -> tuple[Part, ...]:
    """A standing dog with a collar, solid."""
    coat = limb(
        [(0.024, 0.0, 0.054), (-0.004, 0.0, 0.054), (-0.034, 0.0, 0.053)],
        [0.018, 0.0155, 0.0155],
        28,
    )
    coat += limb([(0.03, 0.0, 0.06), (0.043, 0.0, 0.086)], [0.014, 0.0115], 24)
    coat += ellipsoid_manifold((0.05, 0.0, 0.094), (0.0175, 0.0155, 0.0155))
    coat += limb(
        [(-0.044, 0.0, 0.06), (-0.058, 0.0, 0.074), (-0.062, 0.0, 0.09)], [0.005, 0.0045, 0.003]
    )
    for side in (-1.0, 1.0):
        y = side * 0.0105
        coat += limb(
            [(0.028, y, 0.048), (0.028, y, 0.024), (0.027, y, 0.004)], [0.0095, 0.006, 0.0055]
        )
        coat += ellipsoid_manifold((0.031, y, 0.004), (0.0085, 0.006, 0.005), 20)
        coat += limb(
            [(-0.038, y, 0.048), (-0.034, y, 0.03), (-0.042, y, 0.018), (-0.04, y, 0.004)],
            [0.0125, 0.0085, 0.0055, 0.0055],
        )
        coat += ellipsoid_manifold((-0.037, y, 0.004), (0.0085, 0.006, 0.005), 20)
    coat = coat.trim_by_plane((0.0, 0.0, 1.0), 0.0)
    muzzle = limb([(0.058, 0.0, 0.089), (0.0725, 0.0, 0.0865)], [0.0095, 0.0075], 24)
    dark = ellipsoid_manifold((0.0795, 0.0, 0.0895), (0.0035, 0.0042, 0.0032), 16)
    ears = Manifold()
    for side in (-1.0, 1.0):
        ear = limb([(0.0, 0.0, 0.0), (0.001, 0.0, -0.014)], [0.0065, 0.0085]).scale((1.0, 0.4, 1.0))
        ears += ear.rotate((side * 14.0, -6.0, 0.0)).translate((0.044, side * 0.0155, 0.102))
        dark += ellipsoid_manifold((0.0632, side * 0.0078, 0.0995), (0.0022, 0.0022, 0.0026), 12)
    band = lathe([(0.0, -0.003), (0.0145, -0.003), (0.0145, 0.003), (0.0, 0.003)], 32)
    band = band.rotate((0.0, 26.0, 0.0)).translate((0.038, 0.0, 0.0765))
    return assemble(
        Piece(dark, density, BLACK),
        Piece(ears, density, (0.3, 0.16, 0.07)),
        Piece(muzzle, density, (0.93, 0.85, 0.7)),
        Piece(band, density, RED),
        Piece(coat, density, (0.68, 0.43, 0.2)),
        scale=length / 0.147,
    )


@catalogue_object("Toys", _FIGURE, friction=PVC.friction)
def elephant(
    length: float = 0.15,  # from trunk to tail; the figure scales with it
    density: float = PVC.density,
) -> tuple[Part, ...]:
    """A standing elephant with raised trunk and tusks, solid."""
    hide = ellipsoid_manifold((-0.008, 0.0, 0.062), (0.047, 0.034, 0.034), 32)
    hide += ellipsoid_manifold((0.04, 0.0, 0.078), (0.024, 0.022, 0.025))
    way = [(0.056, 0.0, 0.074), (0.068, 0.0, 0.056), (0.078, 0.0, 0.046), (0.091, 0.0, 0.046)]
    hide += limb(
        [*way, (0.099, 0.0, 0.056), (0.099, 0.0, 0.067)],
        [0.0125, 0.0095, 0.0078, 0.0066, 0.0058, 0.0052],
    )
    hide += limb(
        [(-0.052, 0.0, 0.07), (-0.06, 0.0, 0.052), (-0.061, 0.0, 0.042)], [0.0032, 0.0024, 0.0036]
    )
    nails, tusks, eyes, ears = Manifold(), Manifold(), Manifold(), Manifold()
    for side in (-1.0, 1.0):
        for x in (0.02, -0.033):
            y = side * 0.0185
            hide += limb([(x, y, 0.05), (x, y, 0.0)], [0.0155, 0.0125], 24)
            for angle in np.radians([-50.0, 0.0, 50.0]):
                spot = (x + 0.0115 * np.cos(angle), y + 0.0115 * np.sin(angle), 0.0012)
                nails += ellipsoid_manifold(spot, (0.0028, 0.0035, 0.0045), 12)
        tusk = [
            (0.056, side * 0.0105, 0.067),
            (0.071, side * 0.0135, 0.059),
            (0.082, side * 0.0135, 0.063),
        ]
        tusks += limb(tusk, [0.0036, 0.003, 0.0012], 16)
        eyes += ellipsoid_manifold((0.0585, side * 0.0125, 0.086), (0.0026, 0.0026, 0.0028), 12)
        ear = ellipsoid_manifold((0.0, 0.0, 0.0), (0.0185, 0.0034, 0.0235), 32)
        ear += ellipsoid_manifold((-0.004, 0.0, -0.012), (0.013, 0.0032, 0.016), 28)
        ears += ear.rotate((0.0, 0.0, side * -38.0)).translate((0.027, side * 0.0285, 0.082))
    floor = (0.0, 0.0, 1.0)
    return assemble(
        Piece(eyes, density, BLACK),
        Piece(tusks, density, WHITE),
        Piece(nails.trim_by_plane(floor, 0.0), density, (0.9, 0.87, 0.78)),
        Piece(ears, density, (0.62, 0.56, 0.6)),
        Piece(hide.trim_by_plane(floor, 0.0), density, (0.5, 0.53, 0.58)),
        scale=length / 0.169,
    )


@catalogue_object(
    "Toys", "plush stuffed with polyester wadding, 90 kg/m³ in all", friction=PLUSH.friction
)
def teddy_bear(
    height: float = 0.25,  # the figure scales with it
    density: float = PLUSH.density,
) -> tuple[Part, ...]:
    """A sitting teddy bear with a bow tie, stuffed."""
    fur = ellipsoid_manifold((0.0, 0.0, 0.075), (0.06, 0.066, 0.078), 32)
    fur += ellipsoid_manifold((0.012, 0.0, 0.182), (0.056, 0.062, 0.054), 32)
    pads, eyes = Manifold(), Manifold()
    for side in (-1.0, 1.0):
        fur += limb([(0.02, side * 0.035, 0.031), (0.09, side * 0.07, 0.031)], [0.032, 0.03], 28)
        fur += limb([(0.0, side * 0.05, 0.122), (0.042, side * 0.092, 0.078)], [0.026, 0.024], 28)
        fur += ellipsoid_manifold((0.0, side * 0.048, 0.228), (0.014, 0.024, 0.024), 28)
        pads += ellipsoid_manifold((0.011, side * 0.049, 0.229), (0.0065, 0.0145, 0.0145), 24)
        sole = ellipsoid_manifold((0.0, 0.0, 0.0), (0.006, 0.019, 0.021), 24).rotate(
            (0.0, 0.0, side * 27.0)
        )
        pads += sole.translate((0.1155, side * 0.083, 0.032))
        eyes += ellipsoid_manifold((0.0615, side * 0.0205, 0.196), (0.006, 0.0065, 0.007), 16)
    muzzle = ellipsoid_manifold((0.06, 0.0, 0.17), (0.023, 0.027, 0.021), 32)
    belly = ellipsoid_manifold((0.02, 0.0, 0.078), (0.0445, 0.044, 0.054), 32)
    nose = ellipsoid_manifold((0.0805, 0.0, 0.179), (0.006, 0.01, 0.007), 20)
    tie = ellipsoid_manifold((0.066, 0.0, 0.133), (0.0085, 0.0095, 0.0095), 16)
    for side in (-1.0, 1.0):
        loop = limb([(0.0, 0.0, 0.0), (0.0, side * 0.026, 0.0)], [0.005, 0.0145], 20)
        tie += loop.scale((0.55, 1.0, 1.0)).translate((0.064, 0.0, 0.133))
    seat = block(1.0, 1.0, 1.0)
    return assemble(
        Piece(eyes + nose, density, BLACK),
        Piece(tie, density, RED),
        Piece(muzzle + pads + belly, density, (0.92, 0.8, 0.6)),
        Piece(fur ^ seat, density, (0.55, 0.34, 0.17)),
        scale=height / 0.252,
    )
