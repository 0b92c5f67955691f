"""Prisms and solids of revolution as convex pieces, for collision engines that know no others.

In: a plan extruded, a profile turned around an axis. Out: vertices of convex bodies, and how far
their union is from a solid.
"""

import manifold3d
import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from numpy import ndarray
from shapely.geometry.base import BaseGeometry

from mjx_inertia.objects.convex_partition import convex_pieces
from mjx_inertia.objects.manifolds import difference_volume, filled, to_manifold

SECTIONS = 48  # facets around a circle; a multiple of 4, and of the sectors
SECTORS = 16  # convex pieces around a ring
Pieces = tuple[Float[ndarray, "_ 3"], ...]

_FINE = 0.08  # of the mean thickness of an outline: how close its convex pieces follow it
_FINEST = 1e-4  # m


def hull_vertices(points: Float[ndarray, "k 3"]) -> Float[ndarray, "_ 3"]:
    """Those of `points` that are corners of their convex hull."""
    return np.array(manifold3d.Manifold.hull_points(points).to_mesh64().vert_properties)


def upright(
    flat: Float[ndarray, "k 2"], height: float, base: float = 0.0
) -> Float[ndarray, "2*k 3"]:
    """Vertices of the upright prism on an outline, from z = `base` to `base` + `height`, m."""
    return np.concatenate(
        [np.c_[flat, np.full(len(flat), z)] for z in (base, base + height)], dtype=np.float64
    )


def prism_pieces(
    plan: BaseGeometry, height: float, base: float = 0.0, coarse: float = 0.0
) -> Pieces:
    """Convex bodies whose union is close to an upright prism on polygons with or without holes.

    Args:
      plan: m.
      height: m.
      base: z of the lower face, m.
      coarse: m, by which they may miss the plan, if that is more than is usual for its thickness.

    Raises:
      ValueError: more than 200 bodies for one polygon.
    """
    return tuple(upright(flat, height, base) for flat in _flat_pieces(plan, coarse))


def revolution_pieces(
    profile: BaseGeometry, sections: int = SECTIONS, coarse: float = 0.0
) -> Pieces:
    """Convex bodies whose union is close to a profile (radius, z) turned around the z axis.

    A convex piece of the profile that reaches the axis along an edge turns into one body, another
    one into sectors, which fill a hollow up to their chords.

    Args:
      profile: m, radii from 0.
      sections: facets around the axis; a multiple of the number of sectors.
      coarse: as in `prism_pieces`.

    Raises:
      ValueError: more than 200 bodies for one polygon.
    """
    each = sections // SECTORS
    radius = profile.bounds[2]
    # the chords of the sectors miss the hollow by more than half of this in any case
    chord = 0.5 * radius * (1.0 - np.cos(np.pi / SECTORS))
    pieces: list[ndarray] = []
    for flat in _flat_pieces(profile, max(coarse, chord)):
        if np.sum(flat[:, 0] <= 1e-6) >= 2:
            pieces.append(_around(flat, sections, 0, sections))
        else:
            pieces += [_around(flat, sections, each * i, each * (i + 1)) for i in range(SECTORS)]
    return tuple(pieces)


def pieces_error(mesh: trimesh.Trimesh, pieces: Pieces) -> float:
    """Volume in the solid or in the union of `pieces` but not in both, as a share of the solid's.

    Hollows that are closed, where nothing can touch, count as filled.

    Raises:
      ValueError: the mesh bounds no solid.
    """
    solid = filled(to_manifold(mesh))
    hulls = [manifold3d.Manifold.hull_points(piece) for piece in pieces]
    joined = manifold3d.Manifold.batch_boolean(hulls, manifold3d.OpType.Add)
    return difference_volume(solid, joined) / solid.volume()


def _flat_pieces(plan: BaseGeometry, coarse: float) -> list[Float[ndarray, "_ 2"]]:
    """Convex outlines whose union is close to polygons, which are cut through their holes."""
    waiting, done = list(shapely.get_parts(plan)), []
    while waiting:
        polygon = waiting.pop()
        if not polygon.interiors:
            ring = np.asarray(shapely.orient_polygons(polygon).exterior.coords)[:-1, :2]
            thickness = 2.0 * polygon.area / polygon.length
            done += convex_pieces(ring, max(_FINEST, coarse, _FINE * thickness))
            continue
        x = shapely.Polygon(polygon.interiors[0]).centroid.x
        low_x, low_y, high_x, high_y = polygon.bounds
        for left, right in ((low_x - 1.0, x), (x, high_x + 1.0)):
            half = polygon.intersection(shapely.box(left, low_y - 1.0, right, high_y + 1.0))
            waiting += [part for part in shapely.get_parts(half) if part.area > 0.0]
    return done


def _around(
    flat: Float[ndarray, "k 2"], sections: int, first: int, last: int
) -> Float[ndarray, "_ 3"]:
    """Vertices of a profile turned from one facet's edge to another."""
    angle = 2.0 * np.pi * np.arange(first, last + 1) / sections
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    plane = flat[:, None, :1] * turn[None]
    z = np.broadcast_to(flat[:, None, 1:], (*plane.shape[:2], 1))
    return hull_vertices(np.concatenate([plane, z], axis=-1).reshape(-1, 3))
