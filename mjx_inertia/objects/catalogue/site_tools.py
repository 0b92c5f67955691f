"""Tools of the building site: cordless drill, tape measure, spirit level.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ABS,
    ALUMINIUM,
    BARE_STEEL,
    DARK,
    RED,
    RUBBER,
    STEEL,
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
    soften,
    sweep,
)
from mjx_inertia.objects.model import Part


@catalogue_object(
    "Tools",
    "densities x sizes of an 18 V drill with a 2 Ah pack, a class of 1.5 to 1.9 kg",
    friction=ABS.friction,
)
def drill(
    height: float = 0.215,  # from the table to the top of the housing
    housing_diameter: float = 0.062,  # of the motor's housing
    bit_length: float = 0.06,  # outside the chuck
    battery_height: float = 0.045,
    housing_density: float = 650.0,  # mean of a shell of ABS with switch, wires and air
    motor_density: float = 5500.0,  # mean of copper, steel and magnets
    battery_density: float = 1300.0,  # mean of a pack with five cells
) -> tuple[Part, ...]:
    """A cordless drill with a twist bit, standing on its battery.

    Chuck and gears have 0.55 and 0.5 of the density of steel: they are partly plastic and air.
    """
    radius = 0.5 * housing_diameter
    axis = height - radius
    back = [(0.0, -0.082), (0.6, -0.082), (0.86, -0.076), (0.97, -0.06), (1.0, -0.03)]
    housing = _along_x([*back, (1.0, 0.02), (0.9, 0.045), (0.0, 0.045)], radius, axis)
    gears = _along_x([(0.0, 0.045), (0.88, 0.045), (0.84, 0.066), (0.0, 0.066)], radius, axis)
    motor = rod((-0.062, 0.0, axis), (-0.008, 0.0, axis), 0.68 * radius)
    bit = _twist_bit(bit_length).rotate((0.0, 90.0, 0.0)).translate((0.117, 0.0, axis))
    # the grip leans back from the motor to the foot, into which the battery slides
    bends = [(-0.014, axis - 0.3 * radius), (-0.018, axis - radius), (-0.026, 0.09)]
    path = [*bends, (-0.03, battery_height + 0.012)]
    broad = [(1.1, 1.05), (0.95, 1.0), (0.95, 0.95), (1.15, 1.1)]
    housing += sweep(rectangle(0.042, 0.034, 0.016), path, broad)
    housing += block(0.09, 0.062, 0.02, 0.006).translate((-0.012, 0.0, battery_height))
    finger = axis - 1.55 * radius
    trigger = rod((0.012, -0.009, finger), (0.012, 0.009, finger), 0.012)
    trigger += block(0.03, 0.018, 0.024, 0.003).translate((0.0, 0.0, axis - 2.0 * radius))
    battery = block(0.115, 0.075, battery_height - 0.004, 0.006)
    battery += block(0.085, 0.056, 0.01).translate((0.0, 0.0, battery_height - 0.01))
    return assemble(
        Piece(motor, motor_density, DARK),
        Piece(bit, STEEL.density, BARE_STEEL),
        Piece(_chuck(radius, axis), 0.55 * STEEL.density, DARK),
        Piece(gears, 0.5 * STEEL.density, (0.35, 0.36, 0.38)),
        Piece(housing, housing_density, (0.0, 0.45, 0.48)),
        Piece(trigger, ABS.density, RED),
        Piece(battery.translate((-0.005, 0.0, 0.0)), battery_density, DARK),
    )


def _chuck(radius: float, axis: float) -> Manifold:
    """A keyless chuck with grooves around it."""
    jaws = [(0.0, 0.066), (0.62, 0.066), (0.7, 0.07), (0.7, 0.098), (0.42, 0.116), (0.25, 0.117)]
    chuck = _along_x([*jaws, (0.0, 0.117)], radius, 0.0)
    groove = rod((0.076, 0.0, 0.75 * radius), (0.094, 0.0, 0.75 * radius), 0.002, -1.0, 8)
    for angle in np.arange(0.0, 360.0, 30.0):
        chuck -= groove.rotate((float(angle), 0.0, 0.0))
    return chuck.translate((0.0, 0.0, axis))


def _twist_bit(length: float) -> Manifold:
    """A 6 mm bit with two helical flutes and a point, upwards."""
    flute = CrossSection.circle(0.0017, 12).translate((0.0027, 0.0))
    section = CrossSection.circle(0.003, 20) - flute - flute.rotate(180.0)
    return Manifold.extrude(section, length, 24, 540.0) ^ Manifold.cylinder(length, length, 0.0, 20)


def _along_x(profile: list[tuple[float, float]], radius: float, axis: float) -> Manifold:
    """Turned about an axis along x at the height `axis`; profile in radii and x, m."""
    solid = lathe(np.asarray(profile) * (radius, 1.0))
    return solid.rotate((0.0, 90.0, 0.0)).translate((0.0, 0.0, axis))


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
