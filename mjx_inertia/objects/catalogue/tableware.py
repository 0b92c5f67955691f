"""Things on a laid table: mug, bowl, plate, wine glass, bottle, can.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ALUMINIUM,
    BLUE,
    CERAMIC,
    GLASS,
    WHITE,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    arc,
    core,
    lathe,
    plate,
    rectangle,
    spline,
    sweep,
    vessel,
)
from mjx_inertia.objects.model import Part

_STONEWARE = "stoneware, 2400 kg/m³, at the usual wall thickness"


@catalogue_object("Home", f"{_STONEWARE} of a 0.3 l mug", friction=CERAMIC.friction)
def mug(
    height: float = 0.095,
    diameter: float = 0.082,  # of the body
    wall: float = 0.0042,
    handle_reach: float = 0.032,  # from the body to the outside of the handle
    density: float = CERAMIC.density,
) -> tuple[Part, ...]:
    """A stoneware mug."""
    radius = 0.5 * diameter
    foot = [(0.0, 0.0015), (0.72 * radius, 0.0015), (0.76 * radius, 0.0), (0.84 * radius, 0.0)]
    corner = arc((0.84 * radius, 0.16 * radius), 0.16 * radius, -80.0, 0.0, 8)
    curve = np.vstack([foot, corner, [(radius, height)]])
    start, out = radius - 0.5 * wall, radius + handle_reach - 0.005
    ring = [(start, 0.85), (0.6 * start + 0.4 * out, 0.87), (out, 0.72), (out - 0.002, 0.45)]
    ring += [(0.5 * (start + out), 0.24), (start, 0.2)]
    path = spline(np.array(ring) * (1.0, height), 20)
    section = CrossSection.circle(1.0, 16).scale((0.005, 0.0075))
    handle = sweep(section, path) - core(curve, 0.5 * wall)
    return assemble(Piece(vessel(curve, wall) + handle, density, (0.16, 0.32, 0.6)))


@catalogue_object("Home", f"{_STONEWARE} of a cereal bowl", friction=CERAMIC.friction)
def bowl(
    diameter: float = 0.155,  # of the rim
    height: float = 0.065,
    wall: float = 0.004,
    density: float = CERAMIC.density,
) -> tuple[Part, ...]:
    """A cereal bowl on a foot ring."""
    shape = [(0.42, 0.06), (0.7, 0.22), (0.9, 0.52), (1.0, 1.0)]
    side = spline(np.array(shape) * (0.5 * diameter, height), 16)
    foot = np.array([(0.0, 0.035), (0.36, 0.035), (0.37, 0.0), (0.42, 0.0)])
    curve = np.vstack([foot * (0.5 * diameter, height), side])
    return assemble(Piece(vessel(curve, wall), density, (0.85, 0.55, 0.2)))


@catalogue_object(
    "Home",
    "porcelain, 2400 kg/m³, at the usual thickness of a 26.5 cm plate",
    friction=CERAMIC.friction,
)
def dinner_plate(
    diameter: float = 0.265,
    height: float = 0.024,
    wall: float = 0.0045,
    density: float = CERAMIC.density,
) -> tuple[Part, ...]:
    """A porcelain dinner plate with a wide rim."""
    shape = [(0.0, 0.08), (0.55, 0.08), (0.56, 0.0), (0.61, 0.0), (0.63, 0.08), (0.68, 0.24)]
    shape += [(0.72, 0.42), (0.76, 0.52), (0.85, 0.66), (1.0, 0.85)]
    curve = np.array(shape) * (0.5 * diameter, height)
    whole = vessel(curve, wall, 64)
    inner, outer, low = 0.43 * diameter, 0.46 * diameter, 0.7 * height
    ring = lathe([(inner, low), (outer, low), (outer, 1.0), (inner, 1.0)], 64)
    glaze, body = whole.split(ring)
    return assemble(Piece(glaze, density, BLUE), Piece(body, density, WHITE))


@catalogue_object(
    "Home", "soda-lime glass, 2500 kg/m³, with a bowl 1.5 mm thick", friction=GLASS.friction
)
def wine_glass(
    height: float = 0.21,
    bowl_diameter: float = 0.078,  # the largest
    foot_diameter: float = 0.072,
    wall: float = 0.0015,  # of the bowl
    density: float = GLASS.density,
) -> tuple[Part, ...]:
    """A wine glass on a stem."""
    shape = [(0.0, 0.46), (0.35, 0.475), (0.75, 0.54), (1.0, 0.68), (0.93, 0.85), (0.76, 1.0)]
    curve = spline(np.array(shape) * (0.5 * bowl_diameter, height), 24)
    foot = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.008), (0.5, 0.018), (0.2, 0.035)]
    stem = [(0.115, 0.08), (0.1, 0.2), (0.1, 0.35), (0.16, 0.43), (0.3, 0.472), (0.0, 0.47)]
    under = lathe(np.array(foot + stem) * (0.5 * foot_diameter, height))
    return assemble(Piece(under + vessel(curve, wall), density, (0.75, 0.85, 0.88)))


@catalogue_object(
    "Home",
    "glass, 2500 kg/m³, at the 3.5 mm of an empty 0.75 l Bordeaux bottle, 0.4 to 0.6 kg",
    friction=GLASS.friction,
)
def bottle(
    height: float = 0.3,
    diameter: float = 0.075,  # of the body
    neck_diameter: float = 0.029,
    wall: float = 0.0035,
    density: float = GLASS.density,
) -> tuple[Part, ...]:
    """An empty wine bottle of the Bordeaux shape with a punt."""
    radius, neck = 0.5 * diameter, 0.5 * neck_diameter
    punt = [(0.0, 0.075 * height), (0.35 * radius, 0.065 * height), (0.75 * radius, 0.0)]
    punt += [(0.9 * radius, 0.0), (radius, 0.012 * height), (radius, 0.62 * height)]
    shape = [(1.0, 0.62), (0.93, 0.68), (0.55, 0.745), (0.12, 0.795), (0.0, 0.85)]
    shoulder = spline(shape, 14)
    curve = np.column_stack([neck + shoulder[:, 0] * (radius - neck), shoulder[:, 1] * height])
    whole = vessel(np.vstack([punt, curve[1:], [(neck, height)]]), wall)
    inside, low, high = neck - 0.5 * wall, height - 0.02, height - 0.011
    ring = [(inside, low), (neck + 0.001, low), (neck + 0.0015, low + 0.001)]
    ring += [(neck + 0.0015, high - 0.001), (inside, high)]
    return assemble(Piece(whole + lathe(ring), density, (0.08, 0.3, 0.14)))


@catalogue_object(
    "Home", "0.33 l of lemonade, 1040 kg/m³, in 13 g of aluminium", friction=ALUMINIUM.friction
)
def can(
    height: float = 0.115,
    diameter: float = 0.066,  # of the body
    wall: float = 0.00017,  # mean of body and ends
    fill: float = 0.93,  # height of the drink over that of the inside, on the axis, from 0 to 1
    density: float = ALUMINIUM.density,  # of the can
    drink_density: float = 1040.0,
) -> tuple[Part, ...]:
    """A drinks can, unopened; the drink moves with it.

    Raises:
      ValueError: `fill` is outside 0 to 1.
    """
    if not 0.0 <= fill <= 1.0:
        raise ValueError(f"fill: {fill} is not between 0 and 1")
    shape = [(0.0, 0.09), (0.45, 0.07), (0.66, 0.0), (0.74, 0.0), (1.0, 0.08), (1.0, 0.87)]
    shape += [(0.95, 0.92), (0.81, 0.965), (0.81, 0.975), (0.84, 0.985), (0.84, 1.0), (0.79, 1.0)]
    shape += [(0.76, 0.968), (0.0, 0.968)]
    half = np.array(shape) * (0.5 * diameter, height)
    whole = np.vstack([half, half[-2:0:-1] * [-1.0, 1.0]])
    area = CrossSection([whole])
    inside = area.offset(-wall)
    lid, body = lathe(area - inside).split_by_plane((0.0, 0.0, 1.0), 0.955 * height)
    radius, level = 0.5 * diameter, 0.968 * height
    tab = rectangle(0.72 * radius, 0.44 * radius, 0.2 * radius)
    tab -= rectangle(0.2 * radius, 0.24 * radius, 0.08 * radius).translate((0.19 * radius, 0.0))
    ring = plate(tab, 0.001).translate((0.3 * radius, 0.0, level + 0.0006))
    rivet = Manifold.cylinder(0.0008, 0.09 * radius, -1.0, 16)
    ring += rivet.translate((0.08 * radius, 0.0, level))
    drink = []
    if fill > 0.0:
        bottom = 0.09 * height + wall
        surface = bottom + fill * (level - wall - bottom)
        below = inside ^ rectangle(diameter, 2.0 * surface)
        full = lathe(max(below.decompose(), key=CrossSection.area))
        drink = [Piece(full, drink_density, (0.4, 0.2, 0.1))]
    return assemble(
        Piece(ring, density, (0.4, 0.41, 0.43)),
        Piece(lid, density, (0.7, 0.71, 0.73)),
        Piece(body, density, (0.75, 0.06, 0.08)),
        *drink,
    )
