"""Tools that turn or hold: wrenches, Allen key, screwdriver, pliers, C-clamp, drill.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ABS,
    BARE_BRASS,
    BARE_STEEL,
    BLUE,
    BRASS,
    CAST_STEEL,
    DARK,
    PVC,
    RED,
    STAINLESS,
    STEEL,
    VINYL,
    WORKSHOP_TOOLS,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    arc,
    block,
    lathe,
    limb,
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
    f"mass, length and materials of Adjustable Wrench, {WORKSHOP_TOOLS}; thinner and narrower",
    mass=0.71895,
    friction=CAST_STEEL.friction,
)
def adjustable_wrench(
    length: float = 0.3038,  # overall; the outline scales with it
    opening: float = 0.014,  # between the jaws
    head_thickness: float = 0.0143,  # of body and jaws
    handle_thickness: float = 0.0078,
    density: float = CAST_STEEL.density,  # of body and jaw
    spindle_density: float = BRASS.density,  # of the thumbwheel
) -> tuple[Part, ...]:
    """A wrench with a sliding lower jaw and a thumbwheel, lying flat."""
    size = length / 0.3023
    # in the frame of the mouth: it opens towards +x, the fixed jaw is above y = 0
    fixed = [(0.010, 0.0), (0.042, 0.0), (0.0435, 0.007), (0.034, 0.02), (0.012, 0.0265)]
    body = [(-0.018, 0.0225), (-0.042, 0.008), (-0.056, -0.004), (-0.05, -0.021), (-0.026, -0.036)]
    body += [(-0.006, -0.041), (0.006, -0.041), (0.010, -0.035)]
    head = slab(
        soften(outline(np.array(fixed + body) * size), 0.003 * size), head_thickness, 0.002 * size
    )
    # the thumbwheel in its window, and the jaw whose stem slides in the body
    pitch, radius = 0.0034 * size, 0.008 * size
    ribs = np.arange(0.0, 0.0165 * size, 0.5 * pitch)
    rim = np.column_stack([np.where(np.arange(len(ribs)) % 2, radius, 0.86 * radius), ribs])
    wheel = lathe([(0.0, 0.0), *rim, (0.0, ribs[-1])], 24)
    wheel += rod((0.0, 0.0, -0.002 * size), (0.0, 0.0, 0.019 * size), 0.0025 * size)
    window = block(0.0145 * size, 0.1, ribs[-1] + 5e-4).translate((0.0, 0.0, -2.5e-4))
    place = (-0.0145 * size, -0.027 * size, 0.0)
    wheel, window = (part.rotate((-90.0, 0.0, 0.0)).translate(place) for part in (wheel, window))
    reach = [(0.0105, 0.0), (0.041, 0.0), (0.0425, -0.006), (0.034, -0.018), (0.0105, -0.0255)]
    jaw = slab(
        soften(outline(np.array(reach) * size), 0.0025 * size), head_thickness, 0.0015 * size
    )
    stem = slab(rectangle(0.016 * size, 0.024 * size), 0.55 * head_thickness)
    slide = jaw + stem.translate((0.006 * size, -0.0135 * size, 0.0))
    return assemble(
        Piece(wheel, spindle_density, BARE_BRASS),
        Piece(slide.translate((0.0, -opening, 0.0)), density, (0.55, 0.57, 0.6)),
        Piece(head + _handle(size, handle_thickness) - window, density, BARE_STEEL),
        turn_deg=(0.0, 0.0, -15.0),
    )


def _handle(size: float, thickness: float) -> Manifold:
    """The adjustable wrench's, with its eye and its sunk panels, in the frame of the mouth."""
    tail = np.array([(0.0, 0.0095), (-0.212, 0.0132), (-0.212, -0.0132), (0.0, -0.0095)])
    eye = (-0.212 * size, 0.0)
    area = outline(tail * size) + CrossSection.circle(0.0132 * size, 40).translate(eye)
    area -= CrossSection.circle(0.0072 * size, 32).translate(eye)
    panel = rectangle(0.12 * size, 0.0125 * size, 0.006 * size).translate((-0.125 * size, 0.0))
    sunk = slab(panel, thickness)
    handle = slab(area, thickness, 0.0025 * size)
    handle -= sunk.translate((0.0, 0.0, -0.8 * thickness))
    handle -= sunk.translate((0.0, 0.0, 0.8 * thickness))
    return handle.rotate((0.0, 0.0, 15.0)).translate((-0.032 * size, -0.01 * size, 0.0))


@catalogue_object(
    "Tools",
    "density of steel x proportions of a 19 mm combination spanner (DIN 3113)",
    friction=STEEL.friction,
)
def spanner(
    size: float = 0.019,  # across the flats of the nut
    length: float = 0.235,  # overall
    thickness: float = 0.0075,  # of the open end; 0.75 of it for the shaft, 1.4 of it for the ring
    density: float = STEEL.density,
) -> tuple[Part, ...]:
    """A combination spanner: an open end, a ring with twelve points; lying flat."""
    far = length - 1.9 * size
    jaw = CrossSection.circle(1.12 * size, 48).scale((1.0, 0.95))
    mouth = rectangle(2.4 * size, size, 0.3 * size).translate((0.95 * size, 0.0))
    jaw = soften(jaw - mouth, 0.08 * size).rotate(165.0)
    wide, narrow, root = 0.42 * size, 0.34 * size, 0.45 * size
    shaft = outline([(root, wide), (far, narrow), (far, -narrow), (root, -wide)])
    hexagon = CrossSection.circle(size / np.sqrt(3.0), 6)
    bore = slab(hexagon + hexagon.rotate(30.0), 0.1)
    ring = slab(CrossSection.circle(0.8 * size, 48), 1.4 * thickness, 0.11 * thickness)
    panel = rectangle(0.55 * far, 0.4 * size, 0.19 * size).translate((0.5 * far, 0.0))
    bar = slab(shaft, 0.75 * thickness, 0.15 * thickness)
    bar -= plate(panel, 0.1).translate((0.0, 0.0, 0.26 * thickness))
    solid = slab(jaw, thickness, 0.1 * thickness) + bar + ring.translate((far, 0.0, 0.0))
    return assemble(Piece(solid - bore.translate((far, 0.0, 0.0)), density, BARE_STEEL))


@catalogue_object(
    "Tools",
    f"mass, extents and material of Allen Key, {WORKSHOP_TOOLS}",
    mass=0.12808,
    friction=STEEL.friction,
)
def allen_key(
    across_flats: float = 0.00953,
    long_arm: float = 0.1826,  # from the outside of the bend to the end
    short_arm: float = 0.0492,  # likewise
    density: float = 7700.0,  # of alloy steel
) -> tuple[Part, ...]:
    """A hexagonal key, lying flat."""
    half, bend = 0.5 * across_flats, 1.3 * across_flats
    corner = arc((half + bend, half + bend), bend, 180.0, 270.0, 12)
    path = np.vstack([[(half, long_arm)], corner, [(short_arm, half)]])
    section = CrossSection.circle(across_flats / np.sqrt(3.0), 6).rotate(30.0)  # flats along y
    return assemble(Piece(sweep(section, path), density, DARK), turn_deg=(90.0, 0.0, 0.0))


@catalogue_object(
    "Tools",
    f"mass, extents and materials of Screwdriver, {WORKSHOP_TOOLS}",
    mass=0.03043,
    friction=PVC.friction,
)
def screwdriver(
    length: float = 0.1948,  # overall
    handle_length: float = 0.085,
    handle_diameter: float = 0.0169,  # over the ribs
    blade_diameter: float = 0.004,
    handle_density: float = PVC.density,
    blade_density: float = STAINLESS.density,
) -> tuple[Part, ...]:
    """A slotted screwdriver with a fluted handle, lying on it."""
    big, thin = 0.5 * handle_diameter, 0.5 * blade_diameter
    shape = [(0.0, 0.0), (0.62, 0.0), (0.86, 0.02), (0.98, 0.07), (1.0, 0.14), (1.0, 0.62)]
    shape += [(0.9, 0.70), (0.7, 0.76), (0.64, 0.82), (0.72, 0.90), (0.74, 0.95), (0.62, 1.0)]
    handle = lathe(np.array([*shape, (0.0, 1.0)]) * (big, handle_length))
    flute = Manifold.cylinder(0.66 * handle_length, 0.26 * big, -1.0, 16)
    flute += Manifold.sphere(0.26 * big, 16).translate((0.0, 0.0, 0.66 * handle_length))
    flute = flute.translate((1.08 * big, 0.0, 0.06 * handle_length))
    for angle in np.arange(0.0, 360.0, 60.0):
        handle -= flute.rotate((0.0, 0.0, float(angle)))
    handle, band = handle.split_by_plane((0.0, 0.0, 1.0), 0.05 * handle_length)
    root, flat = 0.75 * handle_length, length - 5.0 * blade_diameter
    shaft = Manifold.cylinder(flat - root, thin, -1.0, 24).translate((0.0, 0.0, root))
    neck = Manifold.cylinder(1e-4, thin, -1.0, 24).translate((0.0, 0.0, flat))
    edge = block(0.2 * blade_diameter, 2.5 * thin, 1e-4).translate((0.0, 0.0, length - 1e-4))
    return assemble(
        Piece(shaft + Manifold.batch_hull([neck, edge]), blade_density, BARE_STEEL),
        Piece(band, handle_density, DARK),
        Piece(handle, handle_density, RED),
        turn_deg=(0.0, 90.0, 0.0),
    )


@catalogue_object(
    "Tools",
    f"mass and extents of Pliers, {WORKSHOP_TOOLS}; vinyl grips added",
    mass=0.63318,
    friction=VINYL.friction,
)
def pliers(
    length: float = 0.2471,  # overall; the outline scales with it
    thickness: float = 0.019,  # of jaws and joint
    arm_width: float = 0.0105,  # of the bare arms, in the plane of the tool
    grip_wall: float = 0.0022,  # of the dipped grips
    density: float = STAINLESS.density,  # of the arms
    grip_density: float = VINYL.density,
) -> tuple[Part, ...]:
    """Combination pliers, closed, with dipped grips; lying flat."""
    size = length / 0.2483
    joint = 0.0165 * size
    shape = [(-0.004, 0.0003), (0.07, 0.0003), (0.07, 0.005), (0.052, 0.0105), (0.03, 0.015)]
    jaw = outline(np.array([*shape, (0.012, 0.016), (-0.004, 0.014)]) * size)
    teeth = CrossSection.circle(1.0, 24).scale((0.0085 * size, 0.0045 * size))
    teeth = teeth.translate((0.033 * size, 0.0))  # the grip for pipes, and what follows it
    for x in np.arange(0.045, 0.069, 0.0032):
        teeth += CrossSection.circle(0.0016 * size, 4).translate((float(x) * size, 0.0003 * size))
    bend = [(0.0, 0.0), (-0.018, -0.013), (-0.045, -0.0195), (-0.11, -0.0205), (-0.176, -0.0155)]
    way = spline(bend, 17) * size
    section = rectangle(arm_width, 0.62 * thickness, 0.003)
    arm = sweep(section, way).rotate((-90.0, 0.0, 0.0)) + slab(jaw, thickness, 0.0012)
    arm -= slab(teeth, 2.0 * thickness)
    # the two arms are the same, one turned over; at the joint each has half of the thickness
    arm -= Manifold.cylinder(thickness, joint, -1.0, 40)
    half = Manifold.cylinder(0.5 * thickness, joint, -1.0, 40)
    arm += half.translate((0.0, 0.0, -0.5 * thickness))
    pin = Manifold.cylinder(1.1 * thickness, 0.0062 * size, -1.0, 32, True)
    cover = rectangle(arm_width + 2.0 * grip_wall, 0.62 * thickness + 2.0 * grip_wall, 0.006)
    swell = np.interp(np.arange(13), [0, 1, 10, 12], [1.2, 1.0, 1.05, 1.0])
    sleeve = np.vstack([way[5:], way[-1] + 0.15 * (way[-1] - way[-2])])
    grip = sweep(cover, sleeve, np.stack([swell, swell], axis=1)).rotate((-90.0, 0.0, 0.0))
    over = (180.0, 0.0, 0.0)
    return assemble(
        Piece(pin, density, DARK),
        Piece(arm, density, BARE_STEEL),
        Piece(arm.rotate(over), density, BARE_STEEL),
        Piece(grip + grip.rotate(over), grip_density, RED),
    )


@catalogue_object(
    "Tools",
    f"mass, extents and materials of C Clamp, {WORKSHOP_TOOLS}; its bar turned into the plane",
    mass=0.59804,
    friction=CAST_STEEL.friction,
)
def c_clamp(
    height: float = 0.1576,  # from the underside of the frame to the top of the screw
    depth: float = 0.0785,  # from the back of the frame to the front of its arms
    frame_thickness: float = 0.0165,
    screw_diameter: float = 0.012,  # over the thread
    density: float = CAST_STEEL.density,  # of the frame
    screw_density: float = STAINLESS.density,
    bar_density: float = BRASS.density,  # of the sliding bar
) -> tuple[Part, ...]:
    """A C-clamp with a threaded screw, a swivel pad and a sliding bar, lying on its side."""
    top, front = 0.74 * height, depth - 0.014
    outer = [(0.0, 0.1), (0.0, 0.9), (0.12, 1.0), (1.0, 1.0), (1.0, 0.8), (0.45, 0.78)]
    outer += [(0.25, 0.7), (0.25, 0.28), (0.45, 0.16), (1.0, 0.13), (1.0, 0.0), (0.12, 0.0)]
    area = soften(outline(np.array(outer) * (depth, top)), 0.05 * top)
    sunk = plate(area.offset(-0.07 * depth), 1.0)
    frame = slab(area, frame_thickness, 0.002)
    frame -= sunk.translate((0.0, 0.0, 0.16 * frame_thickness))
    frame -= sunk.translate((0.0, 0.0, -0.16 * frame_thickness - 1.0))
    for low, high in ((0.0, 0.155), (0.76, 1.02)):  # anvil and boss
        ends = ((front, low * top, 0.0), (front, high * top, 0.0))
        frame += rod(*ends, 0.62 * frame_thickness)
    radius, pitch, low = 0.5 * screw_diameter, 0.004, 0.36 * top
    turns = np.arange(low, height - 0.02, 0.5 * pitch)
    flank = np.where(np.arange(len(turns)) % 2, radius, 0.8 * radius)
    thread = np.column_stack([flank, turns])
    head = [(1.25 * radius, turns[-1] + 0.001), (1.25 * radius, height), (0.0, height)]
    pad = np.array([(0.0, -0.012), (1.9, -0.012), (1.9, -0.007), (1.2, 0.0), (0.0, 0.0)])
    screw = lathe([(0.0, turns[0]), *thread, *head], 20)
    screw += lathe(pad * (radius, 1.0), 32).translate((0.0, 0.0, low))
    bar_height, reach = height - 0.009, 0.026
    bar = limb([(-reach, bar_height, 0.0), (reach, bar_height, 0.0)], 0.0036)
    for end in (-reach, reach):
        bar += Manifold.sphere(0.0058, 20).translate((end, bar_height, 0.0))
    return assemble(
        Piece(bar.translate((front + 0.006, 0.0, 0.0)), bar_density, BARE_BRASS),
        Piece(
            screw.rotate((-90.0, 0.0, 0.0)).translate((front, 0.0, 0.0)), screw_density, BARE_STEEL
        ),
        Piece(frame, density, BLUE),
    )


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
