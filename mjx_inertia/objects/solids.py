"""Solids as parts: what stays convex piece by piece, because the construction knows how.

In: sizes in m, a density in kg/m³, a colour. Out: `Part`s, watertight, with convex pieces. Round
surfaces become flat facets, and their radius grows so that the facets enclose the volume of the
true shape: its moments are then met within the fourth power of the facet's angle (2e-6 with 48).
"""

import itertools
from collections.abc import Sequence

import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from numpy import ndarray
from shapely.geometry.base import BaseGeometry

from mjx_inertia.objects.convex import (
    SECTIONS,
    prism_pieces,
    revolution_pieces,
)
from mjx_inertia.objects.manifolds import from_manifold, to_manifold, union
from mjx_inertia.objects.part import Color, Part, moved, transformed

GREY: Color = (0.6, 0.6, 0.6)


def ellipse(
    semi_x: float, semi_y: float | None = None, sections: int = SECTIONS
) -> Float[ndarray, "k 2"]:
    """Polygon with the area of an ellipse (a circle of radius `semi_x` without `semi_y`)."""
    angle = 2.0 * np.pi * np.arange(sections) / sections
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * _equal_area(sections)
    return ring * [semi_x, semi_x if semi_y is None else semi_y]


def box(
    size: tuple[float, float, float],
    base: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    density: float,
    color: Color = GREY,
) -> Part:
    """A box with edges along the axes; `base` is the middle of its lower face."""
    middle = np.array([base[0], base[1], base[2] + 0.5 * size[2]])
    mesh = trimesh.creation.box(size, trimesh.transformations.translation_matrix(middle))
    return Part(mesh, density, color)


def extrusion(
    outline: Float[ndarray, "k 2"] | BaseGeometry,
    height: float,
    base: float = 0.0,
    *,
    density: float,
    color: Color = GREY,
) -> Part:
    """An upright prism from z = `base` to `base` + `height`.

    Args:
      outline: vertices in order, or a polygon that may have holes, m.
      height: m.
      base: m.
      density: kg/m³.
      color: of the part.
    """
    polygon = shapely.Polygon(outline) if isinstance(outline, ndarray) else outline
    mesh = trimesh.creation.extrude_polygon(polygon, height, engine="manifold")
    mesh.apply_translation([0.0, 0.0, base])
    return Part(mesh, density, color, prism_pieces(polygon, height, base))


def revolution(
    profile: Float[ndarray, "k 2"],
    *,
    density: float,
    color: Color = GREY,
    sections: int = SECTIONS,
) -> Part:
    """A solid of revolution about the z axis.

    Args:
      profile: radius and z of the vertices in order around the area that turns, m; radii from 0.
      density: kg/m³.
      color: of the part.
      sections: facets around the axis; a multiple of 16.
    """
    grown = shapely.orient_polygons(shapely.Polygon(profile * [_equal_area(sections), 1.0]))
    ring = np.asarray(grown.exterior.coords)[:-1]
    path = np.roll(ring, -_after_axis(ring), axis=0)
    if path[0, 0] > 0.0:  # a ring around the axis: its profile ends where it begins
        path = np.concatenate([path, path[:1]])
    mesh = trimesh.creation.revolve(path, sections=sections)
    if mesh.volume < 0.0:
        mesh.invert()
    return Part(mesh, density, color, revolution_pieces(grown, sections))


def cylinder(
    radius: float,
    height: float,
    base: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    density: float,
    color: Color = GREY,
    sections: int = SECTIONS,
) -> Part:
    """An upright cylinder; `base` is the middle of its lower face."""
    outline = ellipse(radius, sections=sections) + np.array(base[:2])
    return extrusion(outline, height, base[2], density=density, color=color)


def tube(
    outer: float,
    inner: float,
    height: float,
    base: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    density: float,
    color: Color = GREY,
    sections: int = SECTIONS,
) -> Part:
    """An upright tube of the two radii; `base` is the middle of its lower end."""
    profile = np.array([[inner, 0.0], [outer, 0.0], [outer, height], [inner, height]])
    part = revolution(profile, density=density, color=color, sections=sections)
    return moved(part, base)


def ellipsoid(
    semi_axes: tuple[float, float, float],
    center: tuple[float, float, float],
    *,
    density: float,
    color: Color = GREY,
) -> Part:
    """An ellipsoid with axes along those of the frame; its collision piece is a coarser one."""
    fine, coarse = (trimesh.creation.icosphere(subdivisions=n) for n in (3, 2))
    sphere = 4.0 / 3.0 * np.pi
    vertices = fine.vertices * (sphere / fine.volume) ** (1 / 3) * semi_axes + center
    piece = coarse.vertices * (sphere / coarse.volume) ** (1 / 3) * semi_axes + center
    return Part(trimesh.Trimesh(vertices, fine.faces, process=False), density, color, (piece,))


def bar(
    path: Float[ndarray, "n 3"],
    radius: float,
    *,
    density: float,
    color: Color = GREY,
    sections: int = 24,
) -> Part:
    """A round bar along a path of straight stretches, mitred where they meet.

    Args:
      path: its axis, m; open, without repeated points or turns of 90° and more.
      radius: m.
      density: kg/m³.
      color: of the part.
      sections: facets around it.

    Raises:
      ValueError: a turn that no mitre can make.
    """
    steps = np.diff(path, axis=0)
    along = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    if np.any(np.sum(along[1:] * along[:-1], axis=1) <= 1e-6):
        raise ValueError("path: a turn of 90° or more between two stretches; round it off")
    ring = _ring_across(along[0], radius * _equal_area(sections), sections)
    rings = [path[0] + ring]
    for i in range(1, len(path)):
        normal = along[i - 1] + along[i] if i < len(along) else along[i - 1]
        reach = (path[i] - rings[-1]) @ normal / (along[i - 1] @ normal)
        rings.append(rings[-1] + reach[:, None] * along[i - 1])
    return skin(rings, density=density, color=color)


def skin(rings: Sequence[Float[ndarray, "k 3"]], *, density: float, color: Color = GREY) -> Part:
    """A solid through rings of equally many vertices, flat at its ends, convex from ring to ring.

    Args:
      rings: counter-clockwise as seen from the last one, m.
      density: kg/m³.
      color: of the part.
    """
    ends = [rings[0].mean(axis=0), rings[-1].mean(axis=0)]
    mesh = trimesh.Trimesh(
        np.concatenate([*rings, ends]), _skin_faces(len(rings), len(rings[0])), process=False
    )
    pieces = tuple(np.concatenate(pair) for pair in itertools.pairwise(rings))
    return Part(mesh, density, color, pieces)


def convex(points: Float[ndarray, "k 3"], *, density: float, color: Color = GREY) -> Part:
    """The convex hull of points, m."""
    return Part(trimesh.convex.convex_hull(points), density, color)


def with_volume(part: Part, volume: float) -> Part:
    """The part scaled about the origin to a volume, m³: that of the true shape of a faceted one."""
    scale = (volume / part.mesh.volume) ** (1.0 / 3.0)
    return transformed(part, np.diag([scale, scale, scale, 1.0]))


def carved(part: Part, *cutters: Part) -> Part:
    """`part` without what lies in the `cutters`.

    Raises:
      ValueError: nothing is left.
    """
    rest = to_manifold(part.mesh) - union(cutter.mesh for cutter in cutters)
    if rest.is_empty():
        raise ValueError("cutters: nothing of the part is left")
    return Part(from_manifold(rest), part.density, part.color)


def _equal_area(sections: int) -> float:
    """Radius of a regular polygon with the area of the unit circle."""
    angle = 2.0 * np.pi / sections
    return float(np.sqrt(angle / np.sin(angle)))


def _after_axis(ring: Float[ndarray, "k 2"]) -> int:
    """Vertex of a profile that ends its edge on the axis, 0 if it has none."""
    on_axis = ring[:, 0] == 0.0
    ends = np.flatnonzero(on_axis & ~np.roll(on_axis, -1))
    return int(ends[0]) if len(ends) else 0


def _ring_across(
    direction: Float[ndarray, "3"], radius: float, sections: int
) -> Float[ndarray, "k 3"]:
    """Circle around the origin in the plane across `direction`."""
    helper = np.eye(3)[np.argmin(np.abs(direction))]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first)
    second = np.cross(direction, first)
    angle = 2.0 * np.pi * np.arange(sections) / sections
    return radius * (np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second))


def _skin_faces(rings: int, sections: int) -> ndarray:
    """Faces of a skin: walls between rings, and caps around the last two vertices."""
    faces = []
    turn = np.arange(sections)
    following = (turn + 1) % sections
    for i in range(rings - 1):
        a, b = i * sections + turn, i * sections + following
        c, d = a + sections, b + sections
        faces += [np.stack([a, b, d], -1), np.stack([a, d, c], -1)]
    first, last = rings * sections, rings * sections + 1
    faces.append(np.stack([np.full(sections, first), following, turn], -1))
    end = (rings - 1) * sections
    faces.append(np.stack([np.full(sections, last), end + turn, end + following], -1))
    return np.concatenate(faces)
