"""A homogeneous piece of an object: what the catalogue builds its objects from.

In: a watertight mesh, a density, a colour. Out: `Part`, here or there.
"""

import dataclasses

import numpy as np
import trimesh
from jaxtyping import Float
from numpy import ndarray

Color = tuple[float, float, float]


@dataclasses.dataclass(frozen=True, eq=False)
class Part:
    """A piece of one material."""

    # closed surface with outward faces, m, in the frame of the object (z up, base at z = 0 in the
    # resting pose)
    mesh: trimesh.Trimesh
    density: float  # kg/m³
    color: Color = (0.6, 0.6, 0.6)  # red, green, blue, each from 0 to 1
    # vertices of convex bodies whose union is close to the part, for collision, where its
    # construction knows them; without any, a convex part is its own piece and another one is
    # decomposed
    pieces: tuple[Float[ndarray, "_ 3"], ...] = ()


def transformed(part: Part, matrix: Float[ndarray, "4 4"]) -> Part:
    """The part at a rigid or affine `matrix` (homogeneous, new from old); a mirrored one too."""
    mesh = trimesh.Trimesh(
        vertices=part.mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3],
        faces=part.mesh.faces if np.linalg.det(matrix[:3, :3]) > 0 else part.mesh.faces[:, ::-1],
        process=False,
    )
    pieces = tuple(piece @ matrix[:3, :3].T + matrix[:3, 3] for piece in part.pieces)
    return dataclasses.replace(part, mesh=mesh, pieces=pieces)


def moved(part: Part, offset: tuple[float, float, float]) -> Part:
    """The part displaced by `offset`, m."""
    return transformed(part, trimesh.transformations.translation_matrix(offset))


def turned(
    part: Part,
    angle_deg: float,
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0),
    about: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Part:
    """The part turned by `angle_deg` around the `axis` through the point `about`, m."""
    matrix = trimesh.transformations.rotation_matrix(np.radians(angle_deg), axis, about)
    return transformed(part, matrix)


def on_table(*parts: Part) -> tuple[Part, ...]:
    """Parts moved up or down together so that the lowest point of all is at z = 0."""
    low = min(float(part.mesh.bounds[0, 2]) for part in parts)
    return tuple(moved(part, (0.0, 0.0, -low)) for part in parts)
