"""Densities, friction and colours of what the catalogue's objects are made of.

Densities are the middle of the handbook ranges (Ashby, Materials Selection in Mechanical Design,
appendix A; wood at 12 % moisture). Friction is Coulomb's coefficient, dry, on a wooden or plastic
table: tabulated pairs scatter by ±30 % with finish and age.
"""

import dataclasses


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
