"""How one object of the catalogue is made, and where its figures come from."""

import dataclasses
from collections.abc import Callable
from typing import Literal

from mjx_inertia.objects.part import Part

Category = Literal["Primitives", "Tools", "Home", "Toys", "Pushing"]
Builder = Callable[..., tuple[Part, ...]]


@dataclasses.dataclass(frozen=True)
class Recipe:
    """One object of the catalogue.

    Attributes:
      name: lower case, words joined by underscores.
      category: one of the five.
      build: keyword parameters, all with defaults (sizes, wall thicknesses, m; densities, kg/m³),
        to parts that touch but do not overlap, standing on z = 0 in their resting pose.
      mass: kg of the real thing; the parts' densities are scaled by one factor to meet it. None
        where the parts' own densities and sizes give it.
      source: where the mass and the sizes come from.
      friction: on a wooden or plastic table, Coulomb's coefficient.
    """

    name: str
    category: Category
    build: Builder
    mass: float | None
    source: str
    friction: float = 0.4


def of_function(
    build: Builder, category: Category, mass: float | None, source: str, friction: float = 0.4
) -> Recipe:
    """The recipe that has the name of its function."""
    return Recipe(build.__name__, category, build, mass, source, friction)
