"""What an object of the catalogue is written with: its recipe, materials and colours.

Densities are the middle of the handbook ranges (Ashby, Materials Selection in Mechanical Design,
appendix A; wood at 12 % moisture). Friction is Coulomb's coefficient, dry, on a wooden or plastic
table: tabulated pairs scatter by ±30 % with finish and age.
"""

import dataclasses
from collections.abc import Callable
from typing import Literal

from mjx_inertia.objects.model import Part

Category = Literal["Primitives", "Tools", "Home", "Toys", "Pushing"]
Builder = Callable[..., tuple[Part, ...]]

WORKSHOP_TOOLS = "Workshop Tools Dataset (Nadeau, Giamou, Kelly 2023, arXiv 2302.06685)"


@dataclasses.dataclass(frozen=True)
class Recipe:
    """One object of the catalogue."""

    name: str  # lower case, words joined by underscores
    category: Category  # one of the five
    # keyword parameters, all with defaults (sizes, wall thicknesses, m; densities, kg/m³), to parts
    # that touch but do not overlap, standing on z = 0 in their resting pose
    build: Builder
    # kg of the real thing; the parts' densities are scaled by one factor to meet it. None where the
    # parts' own densities and sizes give it.
    mass: float | None
    source: str  # where the mass and the sizes come from
    friction: float = 0.4  # on a wooden or plastic table, Coulomb's coefficient


def catalogue_object(
    category: Category, source: str, *, mass: float | None = None, friction: float = 0.4
) -> Callable[[Builder], Recipe]:
    """Turns a builder into the recipe that has its name; arguments as in `Recipe`."""
    return lambda build: Recipe(build.__name__, category, build, mass, source, friction)


@dataclasses.dataclass(frozen=True)
class Material:
    """A homogeneous material."""

    density: float  # kg/m³
    friction: float  # on a wooden or plastic table


STEEL = Material(7850.0, 0.35)
STAINLESS = Material(7900.0, 0.3)
CAST_STEEL = Material(7800.0, 0.4)
ALUMINIUM = Material(2700.0, 0.35)
BRASS = Material(8500.0, 0.35)
WOOD = Material(700.0, 0.4)  # beech, oak, ash
CARDBOARD = Material(150.0, 0.4)  # corrugated board: 0.6 kg/m² at 4 mm
GLASS = Material(2500.0, 0.3)
CERAMIC = Material(2400.0, 0.4)  # glazed stoneware and porcelain; foot ring unglazed
ABS = Material(1050.0, 0.3)
PVC = Material(1300.0, 0.4)
VINYL = Material(1200.0, 0.6)  # soft PVC of dipped grips and bath toys
RUBBER = Material(1100.0, 0.7)
FABRIC = Material(400.0, 0.5)  # linen on a plastic foil
PLUSH = Material(90.0, 0.6)  # polyester filling under short fur

# red, green, blue
BARE_STEEL = (0.72, 0.74, 0.77)
BARE_BRASS = (0.8, 0.65, 0.25)
BARE_WOOD = (0.75, 0.52, 0.28)
BLACK = (0.06, 0.06, 0.07)
DARK = (0.16, 0.17, 0.18)
WHITE = (0.94, 0.93, 0.9)
RED = (0.8, 0.1, 0.08)
YELLOW = (0.95, 0.75, 0.1)
GREEN = (0.12, 0.5, 0.25)
BLUE = (0.12, 0.3, 0.6)
