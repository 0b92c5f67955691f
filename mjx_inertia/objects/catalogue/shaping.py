"""Shapes of the catalogue's things: turned, extruded, swept and rounded solids.

In: outlines and curves in m. Out: closed solids of `manifold3d`, to be united, cut and moved with
its operators (`+`, `-`, `^`; rotations in degrees about the fixed x, y, z axes in turn). `assembly`
makes parts of them.
"""

import itertools
from collections.abc import Sequence

import numpy as np
import shapely
from jaxtyping import Float
from manifold3d import CrossSection, FillRule, Manifold, OpType
from numpy import ndarray
from scipy.interpolate import CubicSpline

from mjx_inertia.objects.convex import SECTIONS

Point = tuple[float, float, float] | Float[ndarray, "3"]
Curve = Sequence[tuple[float, ...] | Float[ndarray, " d"]] | Float[ndarray, "n d"]

ROUND = 40  # sides of a circle that a person looks at
SMALL = 20  # sides of a small one


def spline(points: Curve, count: int) -> Float[ndarray, "{count} d"]:
    """A smooth curve through `points` (n, d), as `count` points at even steps of chord length."""
    knots = np.asarray(points, dtype=np.float64)
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1)))
    return CubicSpline(length, knots)(np.linspace(0.0, length[-1], count))


def arc(
    center: tuple[float, float], radius: float, start_deg: float, end_deg: float, count: int = 16
) -> Float[ndarray, "{count} 2"]:
    """`count` points on a circle, from one angle to the other, both included."""
    angle = np.radians(np.linspace(start_deg, end_deg, count))
    return np.array(center) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def equal_area_ring(
    semi_x: float, semi_y: float | None = None, sections: int = SECTIONS
) -> Float[ndarray, "{sections} 2"]:
    """Polygon with the area of an ellipse (a circle of radius `semi_x` without `semi_y`)."""
    angle = 2.0 * np.pi * np.arange(sections) / sections
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * equal_area_factor(sections)
    return ring * [semi_x, semi_x if semi_y is None else semi_y]


def equal_area_factor(sections: int) -> float:
    """Radius of a regular polygon with the area of the unit circle."""
    angle = 2.0 * np.pi / sections
    return float(np.sqrt(angle / np.sin(angle)))


def outline(points: Curve) -> CrossSection:
    """The area inside a simple polygon (n, 2), m, in either sense of rotation."""
    return CrossSection([np.asarray(points, dtype=np.float64)], FillRule.NonZero)


def soften(area: CrossSection, radius: float) -> CrossSection:
    """Corners rounded to `radius`, m, outer ones and then inner ones."""
    outer = area.offset(-radius).offset(radius, circular_segments=SMALL)
    inner = outer.offset(radius, circular_segments=SMALL).offset(-radius)
    return inner.simplify(0.005 * radius)


def rectangle(x: float, y: float, radius: float = 0.0) -> CrossSection:
    """A rectangle about the origin, corners rounded to `radius`; all m."""
    if radius == 0.0:
        return CrossSection.square((x, y), center=True)
    inner = CrossSection.square((x - 2.0 * radius, y - 2.0 * radius), center=True)
    return inner.offset(radius, circular_segments=SMALL)


def plate(area: CrossSection, thickness: float, edge: float = 0.0) -> Manifold:
    """`area` from z = 0 to `thickness`, both rims rounded to the radius `edge`; all m.

    `edge` stays below the smallest radius of the area's convex corners, unless they are sharp.

    Raises:
      ValueError: the rims meet.
    """
    if edge == 0.0:
        return Manifold.extrude(area, thickness)
    if not edge < 0.5 * thickness:
        raise ValueError(f"edge: {edge} m is not below half of the thickness {thickness} m")
    steps = 3
    angle = np.linspace(0.0, 0.5 * np.pi, steps + 1)
    low = edge * (1.0 - np.cos(angle))
    inset = edge * (1.0 - np.sin(angle))
    heights = np.concatenate([low, thickness - low[::-1]])
    insets = np.concatenate([inset, inset[::-1]])
    rings = 2 * steps + 1
    rim, outward = _miters(area)

    def rounded(vertices: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        ring = np.rint(vertices[:, 2] / thickness * rings).astype(int)
        nearest = np.argmin(np.linalg.norm(vertices[:, None, :2] - rim, axis=-1), axis=1)
        moved = vertices[:, :2] - insets[ring, None] * outward[nearest]
        return np.column_stack([moved, heights[ring]])

    return Manifold.extrude(area, thickness, rings - 1).warp_batch(rounded)


def slab(area: CrossSection, thickness: float, edge: float = 0.0) -> Manifold:
    """A `plate` that lies about the plane z = 0."""
    return plate(area, thickness, edge).translate((0.0, 0.0, -0.5 * thickness))


def side_view(area: CrossSection, width: float, edge: float = 0.0) -> Manifold:
    """A `plate` whose outline is given in x and z; it stands about the plane y = 0."""
    return slab(area, width, edge).rotate((90.0, 0.0, 0.0))


def block(x: float, y: float, z: float, radius: float = 0.0) -> Manifold:
    """A box about the z axis, standing on z = 0, all edges rounded to `radius`; all m."""
    if radius == 0.0:
        return Manifold.extrude(rectangle(x, y), z)
    corner = Manifold.sphere(radius, SMALL).translate((0.0, 0.0, radius))
    signs = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [0.0, 1.0])).T.reshape(-1, 3)
    room = np.array([x, y, z]) - 2.0 * radius
    return Manifold.batch_hull([corner.translate(tuple(room * sign)) for sign in signs])


def lathe(profile: Curve | CrossSection, segments: int = ROUND) -> Manifold:
    """Turned about the z axis: `profile` (n, 2) in radius and height, m, closed to itself."""
    area = profile if isinstance(profile, CrossSection) else outline(profile)
    return Manifold.revolve(area, segments)


def vessel(curve: Curve, wall: float, segments: int = ROUND) -> Manifold:
    """A turned hollow body, open at the top, with a rounded rim.

    `curve` (n, 2) is radius and height of the outside from the middle of the bottom to the rim, m;
    `wall` (m) is measured across the wall, bottom included.
    """
    return lathe(vessel_section(curve, wall), segments)


def vessel_section(curve: Curve, wall: float) -> CrossSection:
    """The wall of a `vessel` in radius and height, m, and its image beyond the axis."""
    half = np.asarray(curve, dtype=np.float64)
    whole = shapely.LineString(np.vstack([half[:0:-1] * [-1.0, 1.0], half]))
    stroke = whole.buffer(wall, single_sided=True, quad_segs=3)  # to its left: inside
    section = outline(shapely.get_coordinates(stroke)[:-1])
    rounded = section.offset(-0.4 * wall).offset(0.4 * wall, circular_segments=12)
    return rounded.simplify(0.01 * wall)


def core(curve: Curve, depth: float, segments: int = ROUND) -> Manifold:
    """What lies deeper than `depth`, m, below the outside of a `vessel` that is closed at the rim.

    At half a wall's thickness it cuts handles and spouts off inside the wall.
    """
    half = np.asarray(curve, dtype=np.float64)
    whole = outline(np.vstack([half[:0:-1] * [-1.0, 1.0], half]))
    return lathe(whole.offset(-depth, circular_segments=SMALL), segments)


def ellipsoid_manifold(
    center: tuple[float, float, float], radii: tuple[float, float, float], segments: int = 28
) -> Manifold:
    """Half axes along x, y, z, m."""
    return Manifold.sphere(1.0, segments).scale(radii).translate(center)


def limb(points: Curve, radii: float | Sequence[float], segments: int = SMALL) -> Manifold:
    """A round bar with ball ends along `points` (n, 3), as thick as `radii` (n,) say; m."""
    centers = np.asarray(points, dtype=np.float64)
    sizes = np.broadcast_to(np.asarray(radii, dtype=np.float64), len(centers))
    balls = [
        Manifold.sphere(float(size), segments).translate(tuple(center))
        for center, size in zip(centers, sizes, strict=True)
    ]
    links = [Manifold.batch_hull(list(pair)) for pair in itertools.pairwise(balls)]
    return Manifold.batch_boolean(links, OpType.Add)


def rod(
    start: Point, end: Point, radius: float, end_radius: float = -1.0, segments: int = SMALL
) -> Manifold:
    """A cylinder from `start` to `end` (3,), or a cone if `end_radius` is given; m."""
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    axis = end - start
    length = float(np.linalg.norm(axis))
    tilt = np.degrees(np.arctan2(np.hypot(axis[0], axis[1]), axis[2]))
    heading = np.degrees(np.arctan2(axis[1], axis[0]))
    upright = Manifold.cylinder(length, radius, end_radius, segments)
    return upright.rotate((0.0, tilt, 0.0)).rotate((0.0, 0.0, heading)).translate(tuple(start))


def sweep(area: CrossSection, path: Curve, scale: float | Curve = 1.0) -> Manifold:
    """`area` carried along a curve in the x-z plane.

    The x axis of the area points to the right of the way (towards +x on the way up), its y axis
    along y. Bends must be wider than the area.

    Args:
      area: m.
      path: (n, 2), x and z, m.
      scale: of the area at each point: a scalar, or (n, 2) for its x and its y.
    """
    way = np.asarray(path, dtype=np.float64)
    sizes = np.broadcast_to(np.asarray(scale, dtype=np.float64), way.shape)
    step = np.diff(way, axis=0)
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    bisector = np.vstack([step[:1], step[:-1] + step[1:], step[-1:]])
    bisector /= np.linalg.norm(bisector, axis=1, keepdims=True)
    stretch = 1.0 / np.sum(bisector * np.vstack([step[:1], step]), axis=1)
    right = np.stack([bisector[:, 1], -bisector[:, 0]], axis=1) * stretch[:, None]

    def carried(vertices: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        ring = np.rint(vertices[:, 2] * (len(way) - 1)).astype(int)
        across = vertices[:, :2] * sizes[ring]
        place = way[ring] + across[:, :1] * right[ring]
        return np.column_stack([place[:, 0], across[:, 1], place[:, 1]])

    return Manifold.extrude(area, 1.0, len(way) - 2).warp_batch(carried)


def _miters(area: CrossSection) -> tuple[Float[ndarray, "n 2"], Float[ndarray, "n 2"]]:
    """Vertices of all contours, and how each moves when every edge moves outwards by 1 m."""
    vertices, outward = [], []
    for ring in area.to_polygons():
        step = np.roll(ring, -1, axis=0) - ring
        step /= np.linalg.norm(step, axis=1, keepdims=True)
        after = np.stack([step[:, 1], -step[:, 0]], axis=1)
        before = np.roll(after, 1, axis=0)
        cosine = np.sum(before * after, axis=1, keepdims=True)
        vertices.append(ring)
        outward.append((before + after) / np.maximum(1.0 + cosine, 0.2))
    return np.vstack(vertices), np.vstack(outward)
