"""Things about the house: kettle, vase, lamp, cardboard box, alarm clock, phone, remote control.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

import numpy as np
from jaxtyping import Float
from manifold3d import CrossSection, Manifold, OpType
from numpy import ndarray

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ABS,
    ALUMINIUM,
    BARE_BRASS,
    BARE_STEEL,
    BLACK,
    BLUE,
    BRASS,
    CARDBOARD,
    CERAMIC,
    FABRIC,
    GLASS,
    RED,
    RUBBER,
    STAINLESS,
    STEEL,
    WHITE,
    WOOD,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    arc,
    block,
    core,
    lathe,
    limb,
    plate,
    rectangle,
    rod,
    spline,
    sweep,
    vessel,
)
from mjx_inertia.objects.model import Part


@catalogue_object(
    "Home",
    "stainless steel, 7900 kg/m³, 0.9 mm thick, with resin grips",
    friction=STAINLESS.friction,
)
def kettle(
    diameter: float = 0.2,  # of the body
    height: float = 0.115,  # of the body to the opening
    handle_height: float = 0.24,  # from the table to the top of the handle
    wall: float = 0.0009,
    density: float = STAINLESS.density,
    grip_density: float = 1400.0,  # of grip and knob (phenolic resin)
) -> tuple[Part, ...]:
    """A stove-top kettle with spout, lid and bail handle; empty."""
    radius = 0.5 * diameter
    shape = [(0.97, 0.08), (1.0, 0.25), (0.93, 0.6), (0.74, 0.87), (0.5, 0.985), (0.42, 1.0)]
    curve = np.vstack([[(0.0, 0.0), (0.9, 0.0)], spline(shape, 14)]) * (radius, height)
    inner = core(curve, 0.5 * wall)
    way = spline([(0.72, 0.42), (1.12, 0.72), (1.32, 1.02), (1.62, 1.22)], 12) * (radius, height)
    taper = np.linspace(1.0, 0.5, len(way))
    bore = taper - wall / (0.24 * radius)
    disc = CrossSection.circle(0.24 * radius, 28)
    spout = sweep(disc, way, np.stack([taper, taper], axis=1)) - inner
    hollow = sweep(disc, _drawn_out(way), np.stack([bore, bore], axis=1))
    lid, knob = _lid(0.42 * radius, wall)
    rise = handle_height - 0.0095
    side = np.array([(-0.8, 0.8 * height), (-0.86, 0.7 * rise), (-0.6, 0.93 * rise), (0.0, rise)])
    bow = spline(np.vstack([side, side[2::-1] * (-1.0, 1.0)]) * (radius, 1.0), 25)
    strap = sweep(CrossSection.circle(1.0, 16).scale((0.003, 0.008)), bow) - inner
    grip = sweep(CrossSection.circle(1.0, 20).scale((0.0095, 0.013)), bow[7:18])
    top = (0.0, 0.0, height + 0.0002)
    return assemble(
        Piece(grip + knob.translate(top), grip_density, BLACK),
        Piece(strap, density, BARE_STEEL),
        Piece(lid.translate(top), density, BARE_STEEL),
        Piece(vessel(curve, wall) + spout - hollow, density, RED),
    )


def _lid(opening: float, wall: float) -> tuple[Manifold, Manifold]:
    """A hollow lid that rests on a rim of the radius `opening` at z = 0, and its knob."""
    edge = opening + 0.004
    low = [(0.0, -wall), (opening - 2.0 * wall, -wall), (edge, 0.0), (edge, 0.0012)]
    lid = lathe([*low, (0.6 * opening, 0.008), (0.0, 0.011)])
    under = [(0.0, -1.0), (0.9 * opening, -1.0), (0.9 * opening, 0.0009), (0.55 * opening, 0.007)]
    lid -= lathe([*under, (0.0, 0.01)])
    foot = [(0.0, 0.01), (0.007, 0.01), (0.007, 0.02), (0.015, 0.026), (0.016, 0.032)]
    return lid, lathe([*foot, (0.011, 0.038), (0.0, 0.04)], 32)


def _drawn_out(way: Float[ndarray, "n 2"]) -> Float[ndarray, "n 2"]:
    """The same curve, its ends drawn out by a twentieth of a step, to cut through both ends."""
    ends = way.copy()
    ends[0] -= 0.05 * (way[1] - way[0])
    ends[-1] += 0.05 * (way[-1] - way[-2])
    return ends


@catalogue_object(
    "Home",
    "stoneware, 2400 kg/m³, at the usual wall thickness of a 26 cm vase",
    friction=CERAMIC.friction,
)
def vase(
    height: float = 0.26,
    diameter: float = 0.15,  # of the belly
    wall: float = 0.005,
    density: float = CERAMIC.density,
) -> tuple[Part, ...]:
    """A bellied flower vase with a flared lip and two bands of glaze."""
    shape = [(0.52, 0.0), (0.6, 0.06), (1.0, 0.4), (0.72, 0.66), (0.4, 0.82), (0.46, 0.93)]
    curve = spline(np.array([*shape, (0.68, 0.99)]) * (0.5 * diameter, height), 26)
    rest = vessel(np.vstack([[(0.0, 0.0)], curve]), wall)
    bands: tuple[list[Manifold], list[Manifold]] = ([], [])
    for index, level in enumerate((0.86, 0.8, 0.46, 0.34, 0.08)):
        above, rest = rest.split_by_plane((0.0, 0.0, 1.0), level * height)
        bands[index % 2].append(above)
    glazed, plain = bands
    return assemble(
        Piece(Manifold.compose(glazed), density, BLUE),
        Piece(Manifold.compose([*plain, rest]), density, WHITE),
    )


@catalogue_object(
    "Home",
    "beech, brass, glass and a fabric shade of 0.5 kg/m² at the sizes of a bedside lamp",
    friction=WOOD.friction,
)
def lamp(
    height: float = 0.42,
    shade_diameter: float = 0.26,  # of its lower rim; 0.62 of it above
    shade_height: float = 0.17,
    shade_wall: float = 0.0012,
    base_diameter: float = 0.13,
    base_density: float = WOOD.density,
    shade_density: float = FABRIC.density,
) -> tuple[Part, ...]:
    """A bedside lamp: turned wooden base, brass socket, bulb and a fabric shade on three spokes."""
    low = height - shade_height
    radius, top = 0.5 * shade_diameter, 0.31 * shade_diameter
    rim = [(radius, low), (top, height), (top - shade_wall, height), (radius - shade_wall, low)]
    shade = lathe(rim, 64)
    shape = [(1.0, 0.02), (1.0, 0.08), (0.4, 0.14), (0.3, 0.22), (0.62, 0.45), (0.55, 0.65)]
    turned = spline(np.array([*shape, (0.2, 0.86), (0.2, 1.0)]) * (0.5 * base_diameter, low), 40)
    base = lathe(np.vstack([[(0.0, 0.0), (0.48 * base_diameter, 0.0)], turned, [(0.0, low)]]))
    socket = rod((0.0, 0.0, low - 0.01), (0.0, 0.0, low + 0.05), 0.014, -1.0, 32)
    spokes, hub = Manifold(), height - 0.25 * shade_height
    reach = radius + (top - radius) * 0.75 - 0.5 * shade_wall  # the middle of the shade's wall
    for angle in np.radians([90.0, 210.0, 330.0]):
        end = (reach * np.cos(angle), reach * np.sin(angle), hub)
        spokes += rod((0.0, 0.0, low + 0.04), end, 0.0016, -1.0, 10)
    pear = spline([(0.011, 0.05), (0.013, 0.06), (0.029, 0.085), (0.026, 0.105), (0.0, 0.117)], 16)
    bulb = lathe(np.vstack([[(0.0, 0.05)], pear]), 32)
    bulb -= bulb.scale((0.95, 0.95, 0.98)).translate((0.0, 0.0, 0.001))  # 0.7 to 1.4 mm of glass
    bulb = bulb.translate((0.0, 0.0, low))
    return assemble(
        Piece(shade, shade_density, (0.95, 0.88, 0.7)),
        Piece(socket + (spokes - bulb.hull()), BRASS.density, BARE_BRASS),
        Piece(bulb, GLASS.density, (1.0, 0.95, 0.6)),
        Piece(base, base_density, (0.45, 0.26, 0.14)),
    )


@catalogue_object(
    "Home",
    "corrugated board of 0.6 kg/m² at the size of a 30 x 22 x 16 cm parcel",
    friction=CARDBOARD.friction,
)
def cardboard_box(
    length: float = 0.3,  # along x
    width: float = 0.22,  # along y; a flap is as long as half of it
    height: float = 0.16,  # without the flaps
    wall: float = 0.004,
    density: float = CARDBOARD.density,
) -> tuple[Part, ...]:
    """A box of corrugated board with its four flaps open; empty."""
    box = block(length, width, height)
    box -= block(length - 2.0 * wall, width - 2.0 * wall, height).translate((0.0, 0.0, wall))
    flap = 0.5 * width
    for turn, reach, across, droop in (
        (0.0, length, width, -18.0),
        (90.0, width, length, 25.0),
        (180.0, length, width, -18.0),
        (270.0, width, length, 25.0),
    ):
        sheet = block(flap, across, wall).translate((0.5 * flap, 0.0, -0.5 * wall))
        hinge = (0.5 * reach - 0.5 * wall, 0.0, height - 0.25 * wall)
        box += sheet.rotate((0.0, droop, 0.0)).translate(hinge).rotate((0.0, 0.0, turn))
    return assemble(Piece(box, density, (0.72, 0.54, 0.34)))


@catalogue_object(
    "Home",
    "case and bells of 0.8 and 1 mm steel, brass works, at the size of a twin-bell clock",
    friction=STEEL.friction,
)
def alarm_clock(
    diameter: float = 0.1,  # of the case
    depth: float = 0.05,
    wall: float = 0.0008,  # of the steel case; 1.2 times that for the bells
    density: float = STEEL.density,  # of case and bells
    movement_density: float = 2000.0,  # mean of the brass works and air
) -> tuple[Part, ...]:
    """A wind-up alarm clock with two bells, standing on its two feet."""
    # drawn lying on its back: z towards the reader, y up
    radius, middle = 0.5 * diameter, 0.5 * depth
    case = vessel([(0.0, 0.0), (0.9 * radius, 0.0), (radius, 0.006), (radius, depth)], wall, 64)
    bezel = [
        (0.9 * radius, depth - 0.004),
        (radius + 0.002, depth - 0.004),
        (radius + 0.002, depth),
    ]
    case += lathe([*bezel, (0.94 * radius, depth), (0.9 * radius, depth - 0.002)], 64)
    dial = Manifold.cylinder(0.001, radius - wall, -1.0, 64).translate((0.0, 0.0, depth - 0.005))
    works = Manifold.cylinder(depth - 0.005 - wall, 0.55 * radius, -1.0, 32)
    dome = vessel(arc((0.0, 0.0), 0.42 * radius, -90.0, -2.0, 8), 1.2 * wall, 32)
    dome = dome.rotate((90.0, 0.0, 0.0)).translate((0.0, 1.12 * radius, middle))
    bells, fittings = Manifold(), Manifold()
    for turn in (-36.0, 36.0):
        bells += dome.rotate((0.0, 0.0, turn))
        post = rod((0.0, 0.97 * radius, middle), (0.0, 1.62 * radius, middle), 0.0025, -1.0, 12)
        fittings += post.rotate((0.0, 0.0, turn))
        leg = rod((0.0, -0.97 * radius, middle), (0.0, -1.5 * radius, middle), 0.0045, 0.011, 24)
        fittings += leg.rotate((0.0, 0.0, turn)).trim_by_plane((0.0, 1.0, 0.0), -1.1 * radius)
    fittings += rod((0.0, 0.97 * radius, middle), (0.0, 1.38 * radius, middle), 0.002, -1.0, 12)
    fittings += rod((-0.007, 1.38 * radius, middle), (0.007, 1.38 * radius, middle), 0.005)
    side = np.array([(0.95, 1.3), (0.8, 1.65), (0.42, 1.9), (0.0, 1.98)])
    bow = spline(np.vstack([side, side[2::-1] * (-1.0, 1.0)]) * radius, 15)
    fittings += limb(np.column_stack([bow, np.full(15, middle)]), 0.0022, 8)
    return assemble(
        Piece(_marks_and_hands(radius).translate((0.0, 0.0, depth - 0.004)), ABS.density, BLACK),
        Piece(dial, ABS.density, WHITE),
        Piece(fittings, density, BARE_STEEL),
        Piece(bells, density, BARE_BRASS),
        Piece(works.translate((0.0, 0.0, wall)), movement_density, BARE_STEEL),
        Piece(case, density, (0.1, 0.45, 0.45)),
        turn_deg=(90.0, 0.0, 0.0),
    )


def _marks_and_hands(radius: float) -> Manifold:
    """Twelve marks and two hands on the plane z = 0, ten to two or so."""
    marks = Manifold.cylinder(0.002, 0.06 * radius, -1.0, 20)
    for hour in range(12):
        length = 0.14 if hour % 3 == 0 else 0.08
        mark = block(0.05 * radius, length * radius, 0.0006).translate((0.0, 0.74 * radius, 0.0))
        marks += mark.rotate((0.0, 0.0, 30.0 * hour))
    for turn, length, width in ((55.0, 0.5, 0.07), (-60.0, 0.66, 0.05)):
        hand = block(width * radius, length * radius, 0.001)
        marks += hand.translate((0.0, 0.42 * length * radius, 0.0)).rotate((0.0, 0.0, turn))
    return marks


_GREY = (0.65, 0.66, 0.68)


@catalogue_object(
    "Home",
    "glass, aluminium and battery at the sizes of a 6.1 inch phone, 0.17 to 0.18 kg",
    friction=GLASS.friction,
)
def phone(
    height: float = 0.147,
    width: float = 0.0715,
    thickness: float = 0.0078,  # without the cameras
    glass_thickness: float = 0.0008,  # of the screen and of the back
    frame_density: float = ALUMINIUM.density,
    inside_density: float = 1900.0,  # mean of battery, boards and air
    glass_density: float = GLASS.density,
) -> tuple[Part, ...]:
    """A smartphone, lying on its screen with the cameras up."""
    outer = rectangle(height, width, 0.13 * width)
    inner, pane = outer.offset(-0.0022), outer.offset(-0.0006)
    frame_height = thickness - 2.0 * glass_thickness
    frame = plate(outer - inner, frame_height)
    for x, length, side in ((0.2, 0.012, 1.0), (0.09, 0.012, 1.0), (0.15, 0.018, -1.0)):
        key = block(length, 0.003, 0.0028).translate((0.0, 0.0, 0.5 * frame_height - 0.0014))
        frame += key.translate((x * height, side * (0.5 * width - 0.001), 0.0))
    filling = plate(inner, frame_height)
    side = 0.5 * width
    corner = (0.5 * (height - side) - 0.004, 0.5 * (width - side) - 0.004, thickness)
    light, lenses, rims, bump = (solid.translate(corner) for solid in _cameras(side))
    logo = Manifold.cylinder(0.0004, 0.1 * width, -1.0, 32)
    rims += logo.translate((-0.02 * height, 0.0, thickness - 0.0003))
    screen = plate(pane, glass_thickness, 0.4 * glass_thickness)
    back = plate(pane, glass_thickness).translate((0.0, 0.0, thickness - glass_thickness))
    return assemble(
        Piece(light, glass_density, (0.95, 0.93, 0.75)),
        Piece(lenses, glass_density, BLACK),
        Piece(rims, frame_density, (0.75, 0.77, 0.8)),
        Piece(bump, glass_density, (0.13, 0.22, 0.34)),
        Piece(screen, glass_density, BLACK),
        Piece(frame.translate((0.0, 0.0, glass_thickness)), frame_density, (0.55, 0.62, 0.7)),
        Piece(filling.translate((0.0, 0.0, glass_thickness)), inside_density, BLACK),
        Piece(back, glass_density, (0.2, 0.32, 0.48)),
    )


def _cameras(side: float) -> tuple[Manifold, Manifold, Manifold, Manifold]:
    """Flash, lenses, their rims and the raised square of the width `side` on the plane z = 0."""
    bump = plate(rectangle(side, side, 0.25 * side), 0.0022)
    rims, lenses = Manifold(), Manifold()
    for u, v in ((0.21, 0.21), (-0.21, 0.21), (0.0, -0.21)):
        x, y = u * side, v * side
        rims += rod((x, y, 0.0012), (x, y, 0.0034), 0.2 * side, -1.0, 32)
        lenses += rod((x, y, 0.0024), (x, y, 0.0036), 0.15 * side, -1.0, 32)
    x, y = -0.28 * side, -0.2 * side
    return rod((x, y, 0.0014), (x, y, 0.0024), 0.08 * side), lenses, rims, bump


@catalogue_object(
    "Home",
    "ABS case of 2 mm, rubber keys, circuit board and two AAA cells of 11.5 g",
    friction=ABS.friction,
)
def remote_control(
    length: float = 0.175,
    width: float = 0.046,
    thickness: float = 0.02,  # without the keys
    wall: float = 0.002,  # of the case
    case_density: float = ABS.density,
    key_density: float = RUBBER.density,
    cell_density: float = 2900.0,  # of an alkaline cell (11.5 g in 10.5 by 44.5 mm)
) -> tuple[Part, ...]:
    """A television's remote control with its two AAA cells, keys up."""
    area = rectangle(length, width, 0.3 * width)
    inside = plate(area.offset(-wall), thickness - 2.0 * wall)
    case = plate(area, thickness, 0.004) - inside.translate((0.0, 0.0, wall))
    cell = rod((-0.0222, 0.0, 0.0), (0.0222, 0.0, 0.0), 0.00525, -1.0, 24)
    cells = cell.translate((-0.24 * length, 0.0065, wall + 0.00525))
    cells += cell.translate((-0.24 * length, -0.0065, wall + 0.00525))
    board = block(0.9 * length, 0.75 * width, 0.0016).translate((0.0, 0.0, thickness - 0.006))
    grid, top, proud = 0.29 * width, 0.5 * length, wall + 0.0016
    bed = (top, 0.0, thickness - wall)
    rows = [0.025 + 0.0105 * i for i in range(4)] + [0.127 + 0.0105 * i for i in range(3)]
    discs = [
        CrossSection.circle(0.0038, 16).translate((-row, grid * column))
        for row in rows
        for column in (-1, 0, 1)
    ]
    pad = CrossSection.circle(0.36 * width, 40) - CrossSection.circle(0.17 * width, 32)
    pad += CrossSection.circle(0.13 * width, 32)
    plain = CrossSection.batch_boolean([*discs, pad.translate((-0.0895, 0.0))], OpType.Add)
    power = CrossSection.circle(0.0042, 16).translate((-0.0115, grid))
    bar = rectangle(0.0045, 0.0075, 0.0012)
    colors = ((0.8, 0.1, 0.1), (0.1, 0.6, 0.2), (0.9, 0.8, 0.1), (0.1, 0.3, 0.8))
    bars = [bar.translate((-0.1145, (k - 1.5) * 0.0095)) for k in range(4)]
    keys = zip([power, plain, *bars], [RED, _GREY, *colors], strict=True)
    return assemble(
        Piece(cells, cell_density, (0.7, 0.6, 0.3)),
        Piece(board, 1850.0, (0.1, 0.4, 0.2)),  # glass fibre in epoxy
        *(Piece(plate(key, proud).translate(bed), key_density, color) for key, color in keys),
        Piece(case, case_density, BLACK),
    )
