"""Tools that hold a thing: pliers and the C-clamp.

In: sizes and densities. Out: parts at rest, as `Recipe.build` promises.
"""

import numpy as np
from manifold3d import CrossSection, Manifold

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.materials import (
    BARE_BRASS,
    BARE_STEEL,
    BLUE,
    BRASS,
    CAST_STEEL,
    DARK,
    RED,
    STAINLESS,
    VINYL,
)
from mjx_inertia.objects.catalogue.shaping import (
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
from mjx_inertia.objects.part import Part


def pliers(
    length: float = 0.2471,
    thickness: float = 0.019,
    arm_width: float = 0.0105,
    grip_wall: float = 0.0022,
    density: float = STAINLESS.density,
    grip_density: float = VINYL.density,
) -> tuple[Part, ...]:
    """Combination pliers, closed, with dipped grips; lying flat.

    Args:
      length: overall, m; the outline scales with it.
      thickness: of jaws and joint, m.
      arm_width: of the bare arms, in the plane of the tool, m.
      grip_wall: of the dipped grips, m.
      density: of the arms, kg/m³.
      grip_density: kg/m³.
    """
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


def c_clamp(
    height: float = 0.1576,
    depth: float = 0.0785,
    frame_thickness: float = 0.0165,
    screw_diameter: float = 0.012,
    density: float = CAST_STEEL.density,
    screw_density: float = STAINLESS.density,
    bar_density: float = BRASS.density,
) -> tuple[Part, ...]:
    """A C-clamp with a threaded screw, a swivel pad and a sliding bar, lying on its side.

    Args:
      height: from the underside of the frame to the top of the screw, m.
      depth: from the back of the frame to the front of its arms, m.
      frame_thickness: m.
      screw_diameter: over the thread, m.
      density: of the frame, kg/m³.
      screw_density: kg/m³.
      bar_density: of the sliding bar, kg/m³.
    """
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
