"""Parts of the catalogue's objects: with convex pieces of prisms and turned solids, at rest.

In: plans, profiles, solids of `shaping`, each with a density (kg/m³) and a colour. Out: `Part`s
that touch and do not overlap.
"""

import dataclasses

import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from manifold3d import Manifold
from numpy import ndarray
from scipy.spatial import ConvexHull
from shapely.geometry.base import BaseGeometry

from mjx_inertia.objects.catalogue.shaping import equal_area_factor
from mjx_inertia.objects.convex import SECTIONS, prism_pieces, revolution_pieces
from mjx_inertia.objects.manifolds import from_manifold
from mjx_inertia.objects.model import Color, Part, transformed


def prism_part(
    plan: Float[ndarray, "k 2"] | BaseGeometry,
    height: float,
    base: float = 0.0,
    *,
    density: float,
    color: Color,
) -> Part:
    """An upright prism from z = `base` to `base` + `height`.

    The plan is vertices in order, or a polygon that may have holes; lengths in m, density in kg/m³.
    """
    polygon = shapely.Polygon(plan) if isinstance(plan, ndarray) else plan
    mesh = trimesh.creation.extrude_polygon(polygon, height, engine="manifold")
    mesh.apply_translation([0.0, 0.0, base])
    return Part(mesh, density, color, prism_pieces(polygon, height, base))


def turned_part(
    profile: Float[ndarray, "k 2"], *, density: float, color: Color, sections: int = SECTIONS
) -> Part:
    """A solid of revolution about the z axis.

    Round surfaces become flat facets, and their radius grows so that the facets enclose the volume
    of the true shape: its moments are then met within the fourth power of the facet's angle (2e-6
    with 48).

    The profile is radius (from 0) and z of the vertices in order around the area that turns, m;
    `sections`, the facets around the axis, is a multiple of 16. Density in kg/m³.
    """
    area = shapely.Polygon(profile * [equal_area_factor(sections), 1.0])
    area = shapely.orient_polygons(area)
    mesh = trimesh.creation.revolve(np.asarray(area.exterior.coords), sections=sections)
    return Part(mesh, density, color, revolution_pieces(area, sections))


@dataclasses.dataclass(frozen=True)
class Piece:
    """A solid of one material."""

    solid: Manifold  # m, any pose
    density: float  # kg/m³
    color: Color  # red, green, blue, each from 0 to 1


def assemble(
    *pieces: Piece, turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0), scale: float = 1.0
) -> tuple[Part, ...]:
    """Parts at rest on z = 0.

    Where pieces overlap, the earlier one keeps the place. The whole is then turned, by the
    smallest angle, to a pose in which the CoM lies above its contact with the table, and the
    middle of its bounding box is put above the origin.

    Args:
      pieces: at least one.
      turn_deg: about the fixed x, y, z axes in turn, before the whole is put at rest.
      scale: of all lengths.

    Raises:
      ValueError: a piece is empty, or nothing of it is left outside the earlier ones.
    """
    loose = [
        Part(
            from_manifold(solid.scale((scale, scale, scale)).rotate(turn_deg)),
            piece.density,
            piece.color,
        )
        for piece, solid in zip(pieces, _apart(pieces), strict=True)
    ]
    masses = np.array([part.density * part.mesh.volume for part in loose])
    com = masses @ np.stack([part.mesh.center_mass for part in loose]) / masses.sum()
    vertices = np.vstack([part.mesh.vertices for part in loose])
    pose = np.eye(4)
    pose[:3, :3] = resting_rotation(vertices, com)
    turned = vertices @ pose[:3, :3].T
    low, high = turned.min(axis=0), turned.max(axis=0)
    pose[:3, 3] = -0.5 * (low[0] + high[0]), -0.5 * (low[1] + high[1]), -low[2]
    return tuple(transformed(part, pose) for part in loose)


def resting_rotation(
    vertices: Float[ndarray, "n 3"], com: Float[ndarray, "3"]
) -> Float[ndarray, "3 3"]:
    """The smallest rotation to a pose in which a body stands by itself on a horizontal table.

    A body can rest on a face of its convex hull if the foot of the CoM on the plane of the face
    lies inside the face.
    """
    hull = ConvexHull(vertices)
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    corners = vertices[hull.simplices]
    foot = com - (normals @ com + offsets)[:, None] * normals
    # barycentric coordinates of the foot, as ratios of areas
    area = np.stack(
        [
            np.sum(np.cross(corners[:, j] - foot, corners[:, k] - foot) * normals, axis=1)
            for j, k in ((0, 1), (1, 2), (2, 0))
        ],
        axis=1,
    )
    area *= np.sign(area.sum(axis=1, keepdims=True))
    stable = np.all(area >= -1e-9 * np.abs(area).sum(axis=1, keepdims=True), axis=1)
    down = normals[stable][np.argmin(normals[stable][:, 2])]
    axis = np.array([-down[1], down[0], 0.0])  # down x (0, 0, -1), of length sin(angle)
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 - down[2])


def _apart(pieces: tuple[Piece, ...]) -> list[Manifold]:
    """What of each piece the earlier ones leave."""
    left = []
    for index, piece in enumerate(pieces):
        solid = piece.solid
        for earlier in reversed(pieces[:index]):
            if _overlap(solid, earlier.solid):
                solid -= earlier.solid
        if solid.volume() <= 0.0:
            raise ValueError(
                f"pieces: number {index} of {len(pieces)} has no volume of its own; "
                "change the sizes so that it is not inside the others"
            )
        left.append(solid)
    return left


def _overlap(one: Manifold, other: Manifold) -> bool:
    """Whether two solids share more than rounding; those that only touch are not to be cut."""
    return (one ^ other).volume() > 1e-6 * min(one.volume(), other.volume())
