"""A homogeneous piece of an object: what the catalogue builds its objects from.

In: a watertight mesh, a density, a colour. Out: `Part`.
"""

import dataclasses

import trimesh


@dataclasses.dataclass(frozen=True, eq=False)
class Part:
    """A piece of one material.

    Attributes:
      mesh: closed surface with outward faces, m, in the frame of the object (z up, base at z = 0
        in the resting pose).
      density: kg/m³.
      color: red, green, blue, each from 0 to 1.
    """

    mesh: trimesh.Trimesh
    density: float
    color: tuple[float, float, float] = (0.6, 0.6, 0.6)
