"""An outline as convex pieces, for collision engines that know convex bodies only.

In: a simple outline and a tolerance. Out: convex outlines whose union follows it within that
tolerance. A convex outline stays one piece.
"""

import numpy as np
import shapely
from jaxtyping import Float
from numpy import ndarray
from shapely.geometry.base import BaseGeometry


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


def area_error(outline: Float[ndarray, "k 2"], pieces: tuple[Float[ndarray, "_ 2"], ...]) -> float:
    """Area that is in `outline` or in the union of `pieces` but not in both, as a fraction."""
    whole = shapely.Polygon(outline)
    union = shapely.union_all([shapely.Polygon(piece) for piece in pieces])
    return whole.symmetric_difference(union).area / whole.area


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
