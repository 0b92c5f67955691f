"""Tools of the carpenter: hammer, crowbar, wood saw, chisel, tape measure, spirit level.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ABS,
    ALUMINIUM,
    BARE_BRASS,
    BARE_STEEL,
    BARE_WOOD,
    BLACK,
    BRASS,
    CAST_STEEL,
    DARK,
    RED,
    RUBBER,
    STEEL,
    WOOD,
    WORKSHOP_TOOLS,
    YELLOW,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    ROUND,
    arc,
    block,
    lathe,
    outline,
    plate,
    rectangle,
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


@catalogue_object(
    "Tools",
    f"mass and extents of Measuring Tape, {WORKSHOP_TOOLS}; the inside as in a 5 m tape",
    mass=0.13627,
    friction=ABS.friction,
)
def tape_measure(
    width: float = 0.0529,  # of the case, along the tape
    height: float = 0.0609,  # of the case
    depth: float = 0.0241,  # of the case, across the tape
    wall: float = 0.002,  # of the case
    tape_length: float = 5.0,  # on the coil
    tape_section: float = 2.66e-6,  # width times thickness of the steel tape, m²
    case_density: float = ABS.density,
) -> tuple[Part, ...]:
    """A pocket tape measure, its tape drawn out a little; standing."""
    front = [(-0.5, 0.16), (-0.42, 0.04), (-0.3, 0.0), (0.5, 0.0), (0.5, 0.4)]
    back = arc((-0.05, 0.55), 0.45, 10.0, 165.0, 28)
    side = soften(outline(np.vstack([front, back]) * (width, height)), 0.003)
    case = plate(side, depth, 0.002)
    case -= plate(side.offset(-wall), depth - 2.0 * wall).translate((0.0, 0.0, wall))
    tape_width = depth - 2.0 * wall - 0.001
    tape_low = 0.5 * (depth - tape_width)
    core, x, y = 0.009, -0.03 * width, 0.5 * height
    outer = float(np.sqrt(core**2 + tape_length * tape_section / tape_width / np.pi))
    ring = CrossSection.circle(outer, ROUND) - CrossSection.circle(core, ROUND)
    coil = plate(ring, tape_width).translate((x, y, tape_low))
    spool = rod((x, y, 0.5 * wall), (x, y, depth - 0.5 * wall), core)
    # the drawn end leaves at the foot of the mouth and hooks down
    end = 0.5 * width + 0.03
    drawn = rectangle(0.04, 0.0006).translate((end - 0.02, 0.0045))
    hook = rectangle(0.0012, 0.0042).translate((end, 0.0027))
    lip = plate(drawn + hook, tape_width).translate((0.0, 0.0, tape_low))
    badge = rod((x, y, -0.0004), (x, y, depth + 0.0004), 0.3 * height, -1.0, ROUND)
    badge -= block(1.0, 1.0, depth)
    thumb = block(0.013, 0.011, 0.012, 0.002).translate((0.0, 0.0, -0.006))
    thumb = thumb.rotate((0.0, 90.0, 0.0)).translate((0.4 * width, 0.7 * height, 0.5 * depth))
    return assemble(
        Piece(coil, STEEL.density, BARE_STEEL),
        Piece(spool, case_density, DARK),
        Piece(lip, STEEL.density, (0.95, 0.85, 0.2)),
        Piece(case, case_density, YELLOW),
        Piece(thumb, case_density, RED),
        Piece(badge, RUBBER.density, DARK),
        turn_deg=(90.0, 0.0, 0.0),
    )


@catalogue_object(
    "Tools",
    "densities x sizes of a 400 mm level of 1.6 mm aluminium box section",
    friction=ALUMINIUM.friction,
)
def spirit_level(
    length: float = 0.4,  # with the end caps
    height: float = 0.05,
    depth: float = 0.022,
    wall: float = 0.0016,  # of the profile
    density: float = ALUMINIUM.density,  # of the profile
    vial_density: float = 1150.0,  # mean of acrylic and liquid
) -> tuple[Part, ...]:
    """A spirit level of aluminium box section with three vials, standing on its edge."""
    body, middle = length - 0.02, 0.5 * height
    profile = rectangle(depth, height, 0.0015)
    bore = rectangle(depth - 2.0 * wall, height - 2.0 * wall)
    tube = plate(profile - bore, body).rotate((90.0, 0.0, 90.0))
    tube = tube.translate((-0.5 * body, 0.0, middle))
    cap = plate(profile.offset(0.0008), 0.01).rotate((90.0, 0.0, 90.0))
    caps = cap.translate((0.5 * body, 0.0, middle))
    caps += cap.translate((-0.5 * length, 0.0, middle))
    # the vial for level lies in a notch of the upper edge, two more in round windows
    notch = height - 0.02
    tube -= block(0.05, depth + 0.01, 0.03).translate((0.0, 0.0, notch))
    frames = block(0.05, depth - 2.0 * wall, 0.006).translate((0.0, 0.0, notch))
    liquid, marks = _vial(1.0, 0.0, (0.0, 0.0, height - 0.0095))
    reach, window = (0.0, 0.5 * depth + 0.001, 0.0), 0.31 * height
    for x, turn in ((-0.36 * body, 90.0), (0.36 * body, 45.0)):
        there = (x, 0.0, middle)
        disc = rod(-np.array(reach), reach, window, -1.0, 32)
        hole = rod(-2.0 * np.array(reach), 2.0 * np.array(reach), 0.82 * window, -1.0, 32)
        tube -= disc.translate(there)
        frames += (disc - hole).translate(there)
        tilted, lines = _vial(0.5, turn, there)
        liquid, marks = liquid + tilted, marks + lines
    return assemble(
        Piece(marks, vial_density, DARK),
        Piece(liquid, vial_density, (0.72, 0.9, 0.2)),
        Piece(frames, ABS.density, DARK),
        Piece(caps, ABS.density, DARK),
        Piece(tube, density, (0.85, 0.15, 0.1)),
    )


def _vial(
    length: float, turn_deg: float, center: tuple[float, float, float]
) -> tuple[Manifold, Manifold]:
    """A glass tube and its two marks, of `length` times 48 mm, turned in the x-z plane."""
    tube = rod((-0.024, 0.0, 0.0), (0.024, 0.0, 0.0), 0.006, -1.0, 24)
    marks = Manifold()
    for x in (-0.007, 0.007):
        marks += rod((x, 0.0, 0.0), (x + 0.001, 0.0, 0.0), 0.00624, -1.0, 24)
    first, second = (
        solid.scale((length, 1.0, 1.0)).rotate((0.0, turn_deg, 0.0)).translate(center)
        for solid in (tube, marks)
    )
    return first, second
