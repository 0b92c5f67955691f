"""Tools that turn nuts, bolts and screws: adjustable wrench, spanner, Allen key, screwdriver.

In: sizes and densities. Out: parts at rest, as `Recipe.build` promises.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.materials import (
    BARE_BRASS,
    BARE_STEEL,
    BRASS,
    CAST_STEEL,
    DARK,
    PVC,
    RED,
    STAINLESS,
    STEEL,
)
from mjx_inertia.objects.catalogue.shaping import (
    arc,
    block,
    lathe,
    outline,
    plate,
    rectangle,
    rod,
    slab,
    soften,
    sweep,
)
from mjx_inertia.objects.part import Part


def adjustable_wrench(
    length: float = 0.3038,
    opening: float = 0.014,
    head_thickness: float = 0.0143,
    handle_thickness: float = 0.0078,
    density: float = CAST_STEEL.density,
    spindle_density: float = BRASS.density,
) -> tuple[Part, ...]:
    """A wrench with a sliding lower jaw and a thumbwheel, lying flat.

    Args:
      length: overall, m; the outline scales with it.
      opening: between the jaws, m.
      head_thickness: of body and jaws, m.
      handle_thickness: m.
      density: of body and jaw, kg/m³.
      spindle_density: of the thumbwheel, kg/m³.
    """
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


def spanner(
    size: float = 0.019,
    length: float = 0.235,
    thickness: float = 0.0075,
    density: float = STEEL.density,
) -> tuple[Part, ...]:
    """A combination spanner: an open end, a ring with twelve points; lying flat.

    Args:
      size: across the flats of the nut, m.
      length: overall, m.
      thickness: of the open end, m; 0.75 of it for the shaft, 1.4 of it for the ring.
      density: kg/m³.
    """
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


def allen_key(
    across_flats: float = 0.00953,
    long_arm: float = 0.1826,
    short_arm: float = 0.0492,
    density: float = 7700.0,
) -> tuple[Part, ...]:
    """A hexagonal key, lying flat.

    Args:
      across_flats: m.
      long_arm: from the outside of the bend to the end, m.
      short_arm: likewise, m.
      density: of alloy steel, kg/m³.
    """
    half, bend = 0.5 * across_flats, 1.3 * across_flats
    corner = arc((half + bend, half + bend), bend, 180.0, 270.0, 12)
    path = np.vstack([[(half, long_arm)], corner, [(short_arm, half)]])
    section = CrossSection.circle(across_flats / np.sqrt(3.0), 6).rotate(30.0)  # flats along y
    return assemble(Piece(sweep(section, path), density, DARK), turn_deg=(90.0, 0.0, 0.0))


def screwdriver(
    length: float = 0.1948,
    handle_length: float = 0.085,
    handle_diameter: float = 0.0169,
    blade_diameter: float = 0.004,
    handle_density: float = PVC.density,
    blade_density: float = STAINLESS.density,
) -> tuple[Part, ...]:
    """A slotted screwdriver with a fluted handle, lying on it.

    Args:
      length: overall, m.
      handle_length: m.
      handle_diameter: over the ribs, m.
      blade_diameter: m.
      handle_density: kg/m³.
      blade_density: kg/m³.
    """
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
