"""Outlines, prisms and solids of revolution as convex pieces, for collision engines.

In: a simple outline, a plan extruded, a profile turned around an axis; a tolerance. Out: convex
outlines or vertices of convex bodies whose union follows it, and how far that union is from it.
"""

import manifold3d
import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from numpy import ndarray
from shapely.geometry.base import BaseGeometry

from mjx_inertia.objects.manifolds import difference_volume, filled, to_manifold

SECTIONS = 48  # facets around a circle; a multiple of 4, and of the sectors
SECTORS = 16  # convex pieces around a ring
Pieces = tuple[Float[ndarray, "_ 3"], ...]

_FINE = 0.08  # of the mean thickness of an outline: how close its convex pieces follow it
_FINEST = 1e-4  # m


def convex_pieces(
    outline: Float[ndarray, "k 2"], tolerance: float = 2e-4, most: int = 200
) -> tuple[Float[ndarray, "_ 2"], ...]:
    """Cuts the area inside `outline` into convex outlines, each counter-clockwise, in m.

    A piece is cut at its deepest notch, by the chord from there to a vertex in sight that leaves
    the smallest notches on both sides, until no notch is deeper than the tolerance; then each
    piece is replaced by its hull. Vertices that matter less than half the tolerance are dropped
    before, so a finely drawn curve does not become hundreds of pieces.

    Args:
      outline: (k, 2), m, simple and counter-clockwise.
      tolerance: m, largest distance between the outline and that of the union of the pieces.
      most: pieces; a tolerance that asks for more is a mistake, not a model.

    Raises:
      ValueError: the tolerance is not positive, or asks for more than `most` pieces.
    """
    if not tolerance > 0.0:
        raise ValueError(f"tolerance: {tolerance} m is not positive")
    whole = shapely.Polygon(outline)
    if _depth(whole) <= 1e-9 * np.sqrt(whole.area):
        return (np.array(outline, dtype=np.float64),)
    waiting: list[BaseGeometry] = [whole.simplify(0.5 * tolerance)]
    done: list[Float[ndarray, "_ 2"]] = []
    while waiting:
        piece = waiting.pop()
        if _depth(piece) <= 0.5 * tolerance:
            done.append(_vertices(shapely.convex_hull(piece)))
        else:
            waiting.extend(_cut(piece))
        if len(waiting) + len(done) > most:
            raise ValueError(
                f"tolerance: {tolerance} m needs more than {most} convex pieces; "
                "give a larger tolerance or a coarser outline"
            )
    return tuple(done)


def _depth(piece: BaseGeometry) -> float:
    """How far the boundary of a piece's hull is from the piece, in m."""
    return float(_notch_depths(_vertices(piece)).max())


def _notch_depths(vertices: Float[ndarray, "k 2"]) -> Float[ndarray, " k"]:
    """Distance from each vertex to the boundary of the hull of all."""
    hull = shapely.convex_hull(shapely.Polygon(vertices)).boundary
    return np.asarray(shapely.distance(shapely.points(vertices), hull))


def _cut(piece: BaseGeometry) -> list[shapely.Polygon]:
    vertices = _vertices(piece)
    deepest = int(np.argmax(_notch_depths(vertices)))
    best: list[shapely.Polygon] = []
    best_waste = np.inf
    for other in range(len(vertices)):
        first, last = sorted((deepest, other))
        if last - first < 2 or last - first > len(vertices) - 2:
            continue  # neighbours: the chord is an edge
        chord = shapely.LineString(vertices[[first, last]])
        if not piece.covers(chord):
            continue
        parts = [
            shapely.Polygon(vertices[first : last + 1]),
            shapely.Polygon(np.concatenate([vertices[last:], vertices[: first + 1]])),
        ]
        if not all(part.is_valid and part.area > 0.0 for part in parts):
            continue
        waste = sum(shapely.convex_hull(part).area - part.area for part in parts)
        if waste < best_waste:
            best, best_waste = parts, waste
    return best  # a reflex vertex of a simple polygon always sees a vertex that is no neighbour


def _vertices(piece: BaseGeometry) -> Float[ndarray, "k 2"]:
    ring = shapely.get_coordinates(shapely.orient_polygons(piece))
    return ring[:-1]


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

    `base` is the z of the lower face, m. The bodies may miss the plan by `coarse`, m, if that is
    more than is usual for its thickness.

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

    Radii (m) are from 0; `sections`, the facets around the axis, is a multiple of the number of
    sectors; `coarse` is as for `prism_pieces`.

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
