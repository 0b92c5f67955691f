"""Toys that drive, sail and fly: car, locomotive, sailing boat, rocket.

In: sizes (m) and densities (kg/m³). Out: parts at rest that look along +x.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ABS,
    BARE_STEEL,
    BARE_WOOD,
    BLACK,
    BLUE,
    FABRIC,
    GREEN,
    RED,
    STEEL,
    WHITE,
    WOOD,
    YELLOW,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    ROUND,
    block,
    ellipsoid_manifold,
    lathe,
    outline,
    plate,
    rectangle,
    rod,
    side_view,
    soften,
    spline,
)
from mjx_inertia.objects.model import Part

_BEECH = "turned and sawn beech, 700 kg/m³"


@catalogue_object("Toys", f"{_BEECH}, on steel axles", friction=WOOD.friction)
def car(
    length: float = 0.125,  # of the body; the side view scales with it
    width: float = 0.056,  # over the wheels
    wheel_diameter: float = 0.026,
    body_density: float = WOOD.density,  # of body, windows and bumpers
    wheel_density: float = WOOD.density,
    axle_density: float = STEEL.density,
) -> tuple[Part, ...]:
    """A wooden toy car on four wheels."""
    size = length / 0.125
    low = [(-0.061, 0.012), (0.061, 0.012), (0.0625, 0.022), (0.056, 0.031), (0.026, 0.035)]
    low += [(-0.056, 0.036), (-0.0625, 0.027)]
    high = [(-0.046, 0.03), (0.03, 0.03), (0.012, 0.0545), (-0.03, 0.056)]
    body = side_view(
        soften(outline(np.array(low) * size), 0.004 * size), width - 0.004, 0.003 * size
    )
    roof = soften(outline(np.array(high) * size), 0.006 * size)
    pillar = rectangle(0.005 * size, 1.0).translate((-0.009 * size, 0.0))
    panes = side_view(roof.offset(-0.0058 * size) - pillar, 1.0)
    panes += block(1.0, 0.62 * width, 0.0135 * size).translate((0.0, 0.0, 0.0375 * size))
    panes = panes.trim_by_plane((0.0, 0.0, 1.0), 0.0372 * size)
    glass, cabin = side_view(roof, 0.84 * width, 0.0045 * size).split(panes)
    arches, wheels, hubs, axles = _running_gear(
        (-0.0365 * size, 0.037 * size), width, 0.5 * wheel_diameter
    )
    headlamps, rear_lamps = Manifold(), Manifold()
    for side in (-0.32, 0.32):
        y = side * width
        headlamps += ellipsoid_manifold(
            (0.0585 * size, y, 0.0255 * size), (0.0035, 0.005, 0.004), 16
        )
        rear_lamps += block(0.004, 0.011, 0.005).translate((-0.0605 * size, y, 0.026 * size))
    bumper = block(0.004, 0.8 * width, 0.005, 0.0018)
    bumpers = bumper.translate((0.062 * size, 0.0, 0.0135))
    bumpers += bumper.translate((-0.062 * size, 0.0, 0.0135))
    return assemble(
        Piece(axles, axle_density, BARE_STEEL),
        Piece(hubs, wheel_density, WHITE),
        Piece(wheels, wheel_density, BLACK),
        Piece(headlamps, body_density, (0.98, 0.92, 0.5)),
        Piece(rear_lamps, body_density, (0.95, 0.5, 0.1)),
        Piece(bumpers, body_density, BARE_STEEL),
        Piece(glass, body_density, (0.35, 0.55, 0.68)),
        Piece(cabin + (body - arches), body_density, RED),
    )


def _running_gear(
    axle_x: tuple[float, float], width: float, radius: float
) -> tuple[Manifold, Manifold, Manifold, Manifold]:
    """Room for the wheels in the body, wheels, their hubs, and axles at `axle_x`; all m."""
    arches, wheels, hubs, axles = Manifold(), Manifold(), Manifold(), Manifold()
    for x in axle_x:
        axles += rod((x, -0.5 * width, radius), (x, 0.5 * width, radius), 0.0016)
        for side in (-1.0, 1.0):
            face, back = (x, 0.5 * side * width, radius), (x, side * (0.5 * width - 0.009), radius)
            deep = (x, side * (0.5 * width - 0.0105), radius)
            hub = (x, side * (0.5 * width - 0.003), radius)
            arches += rod(face, deep, radius + 0.002, -1.0, ROUND)
            wheels += rod(face, back, radius, -1.0, ROUND)
            hubs += rod(face, hub, 0.5 * radius, -1.0, 32)
    return arches, wheels, hubs, axles


@catalogue_object("Toys", _BEECH, friction=WOOD.friction)
def locomotive(
    length: float = 0.17,  # the side view scales with it
    width: float = 0.06,
    density: float = WOOD.density,
) -> tuple[Part, ...]:
    """A wooden toy steam locomotive."""
    size = length / 0.172
    axis = 0.03 + 0.38 * width
    high = axis + 0.34 * width
    frame = block(0.14 * size, 0.8 * width, 0.012, 0.002).translate((-0.008 * size, 0.0, 0.018))
    boiler = rod((-0.03 * size, 0.0, axis), (0.052 * size, 0.0, axis), 0.38 * width, -1.0, ROUND)
    front = rod((0.05 * size, 0.0, axis), (0.062 * size, 0.0, axis), 0.41 * width, -1.0, ROUND)
    front += ellipsoid_manifold((0.062 * size, 0.0, axis), (0.005, 0.012, 0.012), 24)
    flare = [(0.0, 0.0), (0.0085, 0.0), (0.0085, 0.014), (0.0135, 0.03), (0.0135, 0.036)]
    front += lathe([*flare, (0.0, 0.036)], 32).translate((0.04 * size, 0.0, high))
    dome = Manifold.cylinder(0.01, 0.0105, -1.0, 28).translate((0.0, 0.0, -0.004))
    dome += ellipsoid_manifold((0.0, 0.0, 0.006), (0.0105, 0.0105, 0.0085), 28)
    brass = dome.translate((0.005 * size, 0.0, high))
    for x in (-0.012, 0.022):
        ends = ((x * size, 0.0, axis), ((x + 0.003) * size, 0.0, axis))
        brass += rod(*ends, 0.4 * width, -1.0, ROUND)
    tall = high - 0.016
    cab = block(0.05 * size, 0.88 * width, tall, 0.002)
    cab -= side_view(rectangle(0.024 * size, 0.022, 0.006).translate((0.0, 0.7 * tall)), 1.0)
    roof = plate(rectangle(0.064 * size, width, 0.006), 0.007, 0.003)
    place = (-0.053 * size, 0.0, 0.0295)
    ram = np.array(
        [(0.06, y, z) for y in (-0.36, 0.36) for z in (0.008, 0.0295)]
        + [(0.07, y, 0.0295) for y in (-0.2, 0.2)]
        + [(0.087, y, z) for y in (-0.03, 0.03) for z in (0.006, 0.011)]
    )
    wheels, spokes = _spoked_wheels(size, width)
    return assemble(
        Piece(spokes, density, YELLOW),
        Piece(wheels, density, RED),
        Piece(frame, density, BLACK),
        Piece(brass, density, YELLOW),
        Piece(front, density, BLACK),
        Piece(roof.translate((place[0], 0.0, place[2] + tall - 1e-4)), density, RED),
        Piece(cab.translate(place), density, BLUE),
        Piece(boiler, density, GREEN),
        Piece(Manifold.hull_points(ram * (size, width, 1.0)), density, YELLOW),
    )


def _spoked_wheels(size: float, width: float) -> tuple[Manifold, Manifold]:
    """Six wheels, and the spokes and hubs on them."""
    wheels, spokes, half = Manifold(), Manifold(), 0.5 * width
    for x, radius in ((-0.055 * size, 0.02), (-0.01 * size, 0.014), (0.033 * size, 0.014)):
        for side in (-1.0, 1.0):
            wheels += rod(
                (x, 0.8 * side * half, radius), (x, side * half, radius), radius, -1.0, ROUND
            )
            for angle in (0.0, 45.0, 90.0, 135.0):
                spoke = block(1.75 * radius, 0.0016, 0.0022).rotate((0.0, angle, 0.0))
                spokes += spoke.translate((x, side * (half + 0.0004), radius))
            ends = ((x, side * (half - 0.001), radius), (x, side * (half + 0.002), radius))
            spokes += rod(*ends, 0.3 * radius)
    return wheels, spokes


@catalogue_object("Toys", f"{_BEECH}, and fabric sails", friction=WOOD.friction)
def sailing_boat(
    length: float = 0.2,  # of the hull
    beam: float = 0.075,
    mast_height: float = 0.2,  # above the deck
    sail_thickness: float = 0.0012,
    hull_density: float = WOOD.density,  # of hull and mast
    sail_density: float = FABRIC.density,
) -> tuple[Part, ...]:
    """A toy sailing boat with two sails and a flag, on its flat bottom."""
    deck, step = 0.22 * length, 0.1 * length  # heights of the deck; x of the mast
    below, above = _hull(length, beam, deck)
    foot, top = deck + 0.022, deck + mast_height
    spars = rod((step, 0.0, 0.3 * deck), (step, 0.0, top), 0.0042, 0.003)
    spars += rod((step, 0.0, foot), (-0.42 * length, 0.0, foot), 0.003)
    bow, eye = (0.475 * length, 0.0, deck - 0.002), (step, 0.0, deck + 0.82 * mast_height)
    spars += rod(bow, eye, 0.001, -1.0, 10)
    belly = deck + 0.45 * mast_height
    leech = spline(
        [(-0.4 * length, foot + 0.002), (-0.2 * length, belly), (step, top - 0.05 * mast_height)],
        10,
    )
    main = outline([*leech, (step, foot + 0.002)])
    corner = (0.47 * length, deck + 0.004)
    jib = outline([(step + 0.008, deck + 0.02), corner, (step + 0.006, deck + 0.8 * mast_height)])
    flag = outline([(step, top - 0.001), (step - 0.03, top - 0.008), (step, top - 0.015)])
    return assemble(
        Piece(spars, hull_density, BARE_WOOD),
        Piece(side_view(main, sail_thickness), sail_density, WHITE),
        Piece(side_view(jib, sail_thickness), sail_density, (0.95, 0.55, 0.15)),
        Piece(side_view(flag, sail_thickness), sail_density, RED),
        Piece(above, hull_density, WHITE),
        Piece(below, hull_density, BLUE),
    )


def _hull(length: float, beam: float, deck: float) -> tuple[Manifold, Manifold]:
    """What is painted blue, below, and white, above, of a hull with a cockpit; all m."""
    edge = spline([(-0.5, 0.3), (-0.2, 0.48), (0.1, 0.46), (0.35, 0.24), (0.5, 0.0)], 14)
    rim = np.vstack([edge, edge[-2::-1] * (1.0, -1.0)]) * (length, beam)
    points = []
    for level, along, across in (
        (0.0, 0.62, 0.55),
        (0.35, 0.85, 0.85),
        (0.72, 0.95, 0.97),
        (1.0, 1.0, 1.0),
    ):
        ring = rim * (along, across) - (0.03 * length * (1.0 - along), 0.0)
        points.append(np.column_stack([ring, np.full(len(rim), level * deck)]))
    cockpit = plate(rectangle(0.26 * length, 0.5 * beam, 0.2 * beam), deck)
    hull = Manifold.hull_points(np.vstack(points))
    hull -= cockpit.translate((-0.25 * length, 0.0, 0.6 * deck))
    above, below = hull.split_by_plane((0.0, 0.0, 1.0), 0.62 * deck)
    return below, above


@catalogue_object("Toys", "ABS, 1050 kg/m³, walls of 2 mm", friction=ABS.friction)
def rocket(
    height: float = 0.24,
    diameter: float = 0.07,  # of the body
    wall: float = 0.002,
    fin_span: float = 0.05,  # how far the fins reach out of the body
    density: float = ABS.density,
) -> tuple[Part, ...]:
    """A toy rocket, hollow, standing on its four fins."""
    shape = [(0.55, 0.1), (0.8, 0.25), (1.0, 0.48), (0.86, 0.72), (0.45, 0.92), (0.0, 1.0)]
    side = spline(np.array(shape) * (0.5 * diameter, height), 26)
    area = CrossSection([np.vstack([side, side[-2::-1] * (-1.0, 1.0)])])
    shell = lathe(area - area.offset(-wall))
    nose, trunk = shell.split_by_plane((0.0, 0.0, 1.0), 0.76 * height)
    # what sits in the wall ends inside it, each at its own depth
    shallow, deep = (lathe(area.offset(-share * wall)) for share in (0.3, 0.6))
    bell = [(0.3, 0.115), (0.42, 0.105), (0.5, 0.045), (0.44, 0.045), (0.3, 0.09)]
    nozzle = lathe(np.array(bell) * (0.5 * diameter, height))
    reach = 0.5 * diameter + fin_span
    blade = [(0.35 * diameter, 0.37 * height), (reach - 0.008, 0.2 * height), (reach, 0.0)]
    blade += [(reach - 0.012, 0.0), (reach - 0.022, 0.1 * height), (0.25 * diameter, 0.14 * height)]
    fin = side_view(soften(outline(blade), 0.0025), 0.006)
    fins, ports, panes = Manifold(), Manifold(), Manifold()
    for angle in (45.0, 135.0, 225.0, 315.0):
        fins += fin.rotate((0.0, 0.0, angle))
    for level, size in ((0.6, 0.15), (0.42, 0.11)):
        z, radius = level * height, size * diameter
        ports += rod((0.0, 0.0, z), (0.515 * diameter, 0.0, z), 1.3 * radius, -1.0, 32)
        panes += rod((0.0, 0.0, z), (0.507 * diameter, 0.0, z), radius, -1.0, 32)
    return assemble(
        Piece(panes - shallow, density, (0.3, 0.6, 0.85)),
        Piece(ports - deep, density, BARE_STEEL),
        Piece(nozzle - deep, density, BLACK),
        Piece(nose, density, RED),
        Piece(fins - deep, density, RED),
        Piece(trunk, density, WHITE),
    )
