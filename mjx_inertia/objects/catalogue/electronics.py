"""Things with a battery: phone and remote control.

In: sizes (m) and densities (kg/m³). Out: parts at rest.
"""

from manifold3d import CrossSection, Manifold, OpType

from mjx_inertia.objects.catalogue.assembly import Piece, assemble
from mjx_inertia.objects.catalogue.recipe import (
    ABS,
    ALUMINIUM,
    BLACK,
    GLASS,
    RED,
    RUBBER,
    catalogue_object,
)
from mjx_inertia.objects.catalogue.shaping import (
    block,
    plate,
    rectangle,
    rod,
)
from mjx_inertia.objects.model import Part

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
