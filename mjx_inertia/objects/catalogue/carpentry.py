"""Tools of the carpenter: hammer, crowbar, wood saw, chisel.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ALUMINIUM,
    BARE_BRASS,
    BARE_STEEL,
    BARE_WOOD,
    BLACK,
    BRASS,
    CAST_STEEL,
    DARK,
    RUBBER,
    STEEL,
    WOOD,
    WORKSHOP_TOOLS,
    YELLOW,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    ROUND,
    lathe,
    outline,
    plate,
    rod,
    slab,
    soften,
    spline,
    sweep,
)
from mjx_inertia.objects.model import Part


@catalogue_object(
    "Tools",
    f"mass, extents and materials of Hammer, {WORKSHOP_TOOLS}",
    mass=0.6897,
    friction=RUBBER.friction,
)
def hammer(
    length: float = 0.3115,  # from the top of the head to the end of the grip
    head_length: float = 0.124,  # from the face to the tip of the claw
    head_width: float = 0.028,  # of cheek and claw
    shaft_diameter: float = 0.018,
    head_density: float = CAST_STEEL.density,
    shaft_density: float = ALUMINIUM.density,
    grip_density: float = RUBBER.density,
) -> tuple[Part, ...]:
    """A claw hammer, lying on its side."""
    size = head_length / 0.124
    back = spline([(0.016, 0.0125), (-0.014, 0.0135), (-0.038, 0.009), (-0.062, -0.021)], 20)
    front = spline([(-0.0600, -0.0225), (-0.046, -0.009), (-0.032, -0.003), (-0.014, -0.013)], 14)
    claw = slab(outline(np.vstack([back, front, [(0.016, -0.013)]]) * size), head_width, 0.001)
    notch = slab(outline(np.array([(-0.026, 0.0), (-0.07, 0.006), (-0.07, -0.006)]) * size), 0.2)
    claw -= notch.rotate((90.0, 0.0, 0.0))
    face = [(0.0, 0.01), (0.0115, 0.01), (0.0105, 0.028), (0.0105, 0.032), (0.0145, 0.042)]
    face += [(0.0145, 0.0605), (0.013, 0.062), (0.0, 0.062)]
    head = claw + lathe(np.array(face) * size).rotate((0.0, 90.0, 0.0))
    foot = 0.0135 * size - length
    shaft = rod((0.0, 0.012 * size, 0.0), (0.0, foot + 0.01, 0.0), 0.5 * shaft_diameter)
    reach = 0.42 * length
    waist = [(0.0165, 0.0), (0.0175, 0.04), (0.0145, 0.2), (0.016, 0.5), (0.0135, 0.85)]
    grip = spline([*waist, (0.0125, 1.0)], 24) * (1.0, reach)
    handle = lathe(np.vstack([[(0.0, 0.0)], grip, [(0.0, reach)]])).scale((1.0, 0.85, 1.0))
    for groove in np.arange(0.3, 0.75, 0.075) * reach:
        ring = lathe(
            [(0.0142, groove), (0.03, groove), (0.03, groove + 0.002), (0.0142, groove + 0.002)]
        )
        handle -= ring.scale((1.0, 0.82, 1.0))
    handle = handle.rotate((-90.0, 0.0, 0.0)).translate((0.0, foot, 0.0))
    return assemble(
        Piece(shaft, shaft_density, YELLOW),
        Piece(head, head_density, DARK),
        Piece(handle, grip_density, BLACK),
    )


@catalogue_object(
    "Tools",
    "density of steel x size of a 600 mm wrecking bar of 18 mm hexagonal steel",
    friction=STEEL.friction,
)
def crowbar(
    length: float = 0.6,  # from the chisel's edge to the top of the goose neck
    across_flats: float = 0.018,  # width of the bar
    density: float = STEEL.density,
) -> tuple[Part, ...]:
    """A hexagonal bar with a claw on a goose neck and a chisel at the other end, lying flat."""
    bend = 2.2 * across_flats
    turn = np.radians(np.linspace(180.0, 20.0, 17))
    neck = np.stack([bend * (1.0 + np.cos(turn)), length - bend * (1.0 - np.sin(turn))], axis=1)
    tip = neck[-1] + np.outer([1.0, 1.8, 2.8], across_flats * np.array([0.64, -0.94]))
    heel = np.array([(-0.7, 0.0), (-0.35, 1.3), (-0.1, 2.6), (0.0, 4.5)]) * across_flats
    path = np.vstack([heel, neck, tip])
    scale = np.ones_like(path)
    scale[:3] = [(0.12, 1.5), (0.5, 1.35), (0.8, 1.15)]
    scale[-3:] = [(0.8, 1.15), (0.55, 1.35), (0.12, 1.5)]
    bar = sweep(CrossSection.circle(across_flats / np.sqrt(3.0), 6), path, scale)
    wedge = across_flats * np.array([(0.0, 0.0), (2.6, 0.42), (2.6, -0.42)])
    way = tip[2] - neck[-1]
    heading = float(np.degrees(np.arctan2(-way[1], way[0])))
    start = neck[-1] + 0.35 * way
    notch = slab(outline(wedge), 0.1).rotate((0.0, heading, 0.0))
    bar -= notch.translate((start[0], 0.0, start[1]))
    return assemble(Piece(bar, density, (0.15, 0.25, 0.5)), turn_deg=(90.0, 0.0, 0.0))


@catalogue_object(
    "Tools",
    "densities x sizes of a 450 mm hand saw with a 0.9 mm blade and a beech handle",
    friction=WOOD.friction,
)
def wood_saw(
    blade_length: float = 0.45,  # from the heel to the toe
    # at the heel; 0.4 of it at the toe. The handle's outline scales with it
    blade_height: float = 0.11,
    blade_thickness: float = 0.0009,
    tooth_pitch: float = 0.006,
    handle_thickness: float = 0.022,
    blade_density: float = STEEL.density,
    handle_density: float = WOOD.density,
) -> tuple[Part, ...]:
    """A hand saw, lying on the side of its handle and the toe of its blade."""
    count = round(blade_length / tooth_pitch)
    along = np.linspace(0.0, blade_length, count, endpoint=False)
    teeth = np.column_stack([np.repeat(along, 2), np.tile([0.0, 0.8 * tooth_pitch], count)])
    teeth[1::2, 0] += 0.25 * blade_length / count
    toe = [(blade_length, 0.1 * blade_height), (blade_length - 0.008, 0.4 * blade_height)]
    heel = [(0.03, blade_height), (0.012, 0.3 * blade_height), (0.0, 0.15 * blade_height)]
    blade = slab(outline([*teeth, *toe, *heel]), blade_thickness)
    around = [(0.048, 0.022), (0.056, 0.06), (0.045, 0.112), (-0.02, 0.126), (-0.07, 0.148)]
    around += [(-0.09, 0.135), (-0.074, 0.105), (-0.076, 0.05), (-0.1, 0.012), (-0.088, -0.01)]
    around += [(-0.03, 0.006), (0.01, 0.012)]
    hole = [(-0.008, 0.032), (0.004, 0.096), (-0.02, 0.1), (-0.046, 0.106), (-0.05, 0.05)]
    hole += [(-0.044, 0.03)]
    size = blade_height / 0.11
    grip = soften(outline(np.array(around) * size), 0.008)
    grip -= soften(outline(np.array(hole) * size), 0.0085)
    handle = slab(grip.simplify(2e-4), handle_thickness, 0.006)
    proud = 0.5 * handle_thickness + 0.0005
    screws = Manifold()
    for x, y in np.array([(0.03, 0.04), (0.036, 0.068), (0.028, 0.096)]) * size:
        screws += rod((x, y, -proud), (x, y, proud), 0.0055)
    return assemble(
        Piece(screws, BRASS.density, BARE_BRASS),
        Piece(blade, blade_density, BARE_STEEL),
        Piece(handle, handle_density, (0.62, 0.38, 0.2)),
    )


@catalogue_object(
    "Tools",
    "densities x sizes of a 25 mm bevel-edge chisel with a wooden handle",
    friction=WOOD.friction,
)
def chisel(
    blade_width: float = 0.025,
    blade_length: float = 0.13,  # from the edge to the ferrule
    blade_thickness: float = 0.004,
    handle_length: float = 0.13,  # with ferrule and striking ring
    handle_diameter: float = 0.032,  # the largest
    blade_density: float = STEEL.density,  # of the blade and the striking ring
    handle_density: float = WOOD.density,
) -> tuple[Part, ...]:
    """A bevel-edge wood chisel with a turned handle, lying on its side."""
    half, wide = 0.5 * blade_thickness, 0.5 * blade_width
    lower = [(-wide, 0.0), (-wide, -half), (wide, -half), (wide, 0.0)]
    section = outline([*lower, (0.65 * wide, half), (-0.65 * wide, half)])
    flat, root = 0.72 * blade_length, blade_length - 0.014
    blade = plate(section, flat)  # from the edge, z = 0, up
    bevel = outline([(-half, 0.0), (half, 0.0), (half, 5.0 * half)])
    blade -= slab(bevel, 0.2).rotate((90.0, 0.0, 90.0))
    shoulder = plate(section.scale((0.97, 0.97)), 0.001).translate((0.0, 0.0, flat - 0.002))
    stem = Manifold.cylinder(0.004, 0.005, -1.0, 20).translate((0.0, 0.0, root))
    blade += Manifold.batch_hull([shoulder, stem])
    bolster = lathe([(0.0, 0.0), (0.0055, 0.0), (0.009, 0.01), (0.009, 0.014), (0.0, 0.014)])
    blade += bolster.translate((0.0, 0.0, root))
    blade += rod((0.0, 0.0, root + 0.008), (0.0, 0.0, blade_length + 0.04), 0.0045)
    big = 0.5 * handle_diameter
    swell = [(0.65, 0.0), (0.66, 0.14), (0.95, 0.42), (0.97, 0.7), (0.74, 0.9), (0.72, 1.0)]
    profile = spline(np.array(swell) * (big, handle_length), 28)
    handle = lathe(np.vstack([[(0.0, 0.0)], profile, [(0.0, handle_length)]]))
    ferrule = Manifold.cylinder(0.12 * handle_length, 0.72 * big, 0.74 * big, ROUND)
    ring = Manifold.cylinder(0.06 * handle_length, 0.84 * big, 0.84 * big, ROUND)
    ring = ring.translate((0.0, 0.0, 0.92 * handle_length))
    there = (0.0, 0.0, blade_length)
    return assemble(
        Piece(blade, blade_density, BARE_STEEL),
        Piece(ferrule.translate(there), BRASS.density, BARE_BRASS),
        Piece(ring.translate(there), blade_density, DARK),
        Piece(handle.translate(there), handle_density, BARE_WOOD),
        turn_deg=(90.0, 0.0, 90.0),
    )
