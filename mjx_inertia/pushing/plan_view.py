"""What a tip at one height can touch of an object that stays upright, seen from above.

In: an `ObjectModel`, the height and radius of the tip. Out: convex polygons in the object's axes.
An upright prism gives the plans of its collision pieces; any other solid gives the outer outlines
of the slab that lies at the tip's height, cut into convex polygons. So a wall that leans is taken
as upright within the slab, which is as high as the tip.
"""

from collections.abc import Sequence

import numpy as np
import shapely
from jaxtyping import Float

from mjx_inertia.objects import ObjectModel, convex_pieces, outlines_between

_TOLERANCE = 5e-4  # m, between an outline and its polygons
_FEW = 4  # pieces of a prism: more may surround a hole, which no tip comes into
_OUT_OF_REACH = 1e3  # m: where polygons that only fill an array lie


def upright_polygons(obj: ObjectModel) -> Float[np.ndarray, "m k 2"] | None:
    """Plans of the object's collision pieces, counter-clockwise, padded with their last vertex.

    None where a piece is not an upright prism from the table to the object's height.
    """
    plans = []
    for piece in obj.pieces:
        base, top = (piece[np.isclose(piece[:, 2], z)] for z in (0.0, obj.height))
        if len(base) + len(top) != len(piece) or len(base) != len(top):
            return None
        middle = base[:, :2].mean(0)

        def ring(vertices: np.ndarray, middle: np.ndarray = middle) -> np.ndarray:
            flat = vertices[:, :2]
            return flat[np.argsort(np.arctan2(*(flat - middle).T[::-1]))]

        if not np.allclose(ring(base), ring(top)):
            return None
        plans.append(ring(base))
    return _stacked(plans)


def plan_polygons(obj: ObjectModel, height: float, radius: float) -> Float[np.ndarray, "m k 2"]:
    """Polygons of any object, counter-clockwise, padded with their last vertex, m.

    `height` is that of the middle of the tip above the table, `radius` the tip's, m.

    Raises:
      ValueError: nothing of the object is at that height.
    """
    upright = upright_polygons(obj)
    if upright is not None and len(upright) <= _FEW:
        return upright
    rings = outlines_between(obj.mesh, height - radius, height + radius)
    if not rings:
        raise ValueError(f"{obj.name}: nothing of it is {height} m above the table")
    seen = _stacked([piece for ring in rings for piece in convex_pieces(ring, _TOLERANCE)])
    return seen if upright is None or len(seen) < len(upright) else upright


def stack_polygons(
    shapes: Sequence[Float[np.ndarray, "_ _ 2"]],
) -> Float[np.ndarray, "n m k 2"]:
    """Polygons of many objects in one array; padding polygons lie out of reach."""
    pieces, corners = (max(shape.shape[axis] for shape in shapes) for axis in (0, 1))
    far = _OUT_OF_REACH + np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    filler = np.pad(far, ((0, max(corners - 3, 0)), (0, 0)), mode="edge")
    result = np.tile(filler, (len(shapes), pieces, 1, 1))
    for row, shape in zip(result, shapes, strict=True):
        more = ((0, 0), (0, row.shape[1] - shape.shape[1]), (0, 0))
        row[: len(shape)] = np.pad(shape, more, mode="edge")
    return result


def first_contact(
    polygons: Float[np.ndarray, "m k 2"],
    origin: Float[np.ndarray, "2"],
    direction: Float[np.ndarray, "2"],
    radius: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Where a tip that comes from afar along a line first touches the polygons.

    Args:
      polygons: of the object, world axes, m.
      origin: a point of the line, m.
      direction: in which the tip moves, of length 1.
      radius: of the tip, m.

    Returns:
      Middle of the tip, the point that it touches (m) and the inward unit normal there; None where
      it passes by.
    """
    area = shapely.union_all([shapely.Polygon(p) for p in polygons])
    reach = shapely.buffer(area, radius, quad_segs=32).boundary
    low, high = np.array(area.bounds).reshape(2, 2)
    far = float(np.linalg.norm(high - low) + np.linalg.norm(origin - 0.5 * (low + high))) + radius
    line = shapely.LineString([origin - far * direction, origin + far * direction])
    met = shapely.get_coordinates(shapely.intersection(line, reach))
    if len(met) == 0:
        return None
    middle = met[np.argmin(met @ direction)]
    near = shapely.get_coordinates(shapely.shortest_line(area, shapely.Point(middle)))[0]
    return middle, near, (near - middle) / np.linalg.norm(near - middle)


def _stacked(plans: Sequence[Float[np.ndarray, "_ 2"]]) -> Float[np.ndarray, "m k 2"]:
    most = max(len(plan) for plan in plans)
    return np.stack([np.pad(p, ((0, most - len(p)), (0, 0)), mode="edge") for p in plans])
