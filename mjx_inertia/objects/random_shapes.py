"""Random families of upright shapes, as varied as the catalogue's, for training.

In: `RandomShapes`, a count and a seed. Out: `ObjectModel`s whose outline, size, mass and density
all vary. Every object is the extrusion of an area, which may have holes, of one material or of two
that meet along a straight cut.
"""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import shapely
import trimesh
from numpy.random import Generator
from shapely.affinity import scale, translate
from shapely.geometry.base import BaseGeometry
from shapely.ops import split

from mjx_inertia.objects.convex import prism_pieces
from mjx_inertia.objects.mesh_integrals import solid_properties_float64
from mjx_inertia.objects.model import ObjectModel, Part
from mjx_inertia.spatial import combine_float64

Interval = tuple[float, float]
_COLORS = np.array([[0.20, 0.40, 0.70], [0.87, 0.55, 0.20], [0.25, 0.55, 0.30], [0.60, 0.30, 0.55]])


@dataclasses.dataclass(frozen=True)
class RandomShapes:
    """Intervals to draw from, evenly unless said."""

    # of outlines, names in `OUTLINES`, each as likely as the others
    kinds: tuple[str, ...] = (
        "rectangle", "rounded", "ellipse", "polygon", "star", "l", "t", "cross", "trapezium",
        "half_disc", "frame", "ring",
    )  # fmt: skip
    length: Interval = (0.1, 0.3)  # longer edge of the outline's box, m
    aspect: Interval = (0.35, 1.0)  # shorter edge over longer edge
    height: Interval = (0.02, 0.15)  # m
    mass: Interval = (0.1, 5.0)  # kg, evenly in the logarithm
    two_materials: float = 0.5  # share of the objects that are made of two
    density_ratio: Interval = (1.5, 5.0)  # between the two, evenly in the logarithm
    friction: Interval = (0.2, 0.6)  # between object and table

    def __post_init__(self) -> None:
        """Refuses kinds and intervals that nothing can be drawn from."""
        unknown = [kind for kind in self.kinds if kind not in OUTLINES]
        if unknown or not self.kinds:
            raise ValueError(f"kinds={self.kinds}: choose from {sorted(OUTLINES)}")
        for name in ("length", "aspect", "height", "mass", "density_ratio", "friction"):
            low, high = getattr(self, name)
            if not 0.0 < low <= high:
                raise ValueError(f"{name}={(low, high)}: give 0 < low <= high")


def random_objects(
    count: int, *, seed: int, settings: RandomShapes | None = None
) -> tuple[ObjectModel, ...]:
    """Objects of a random family, the same for the same seed; object i does not depend on `count`.

    Raises:
      ValueError: a count that is not positive.
    """
    if count < 1:
        raise ValueError(f"count={count} is not positive")
    chosen = settings or RandomShapes()
    return tuple(_random_object(i, np.random.default_rng([seed, i]), chosen) for i in range(count))


def _random_object(index: int, rng: Generator, settings: RandomShapes) -> ObjectModel:
    # outline, height and mass
    kind = str(rng.choice(settings.kinds))
    length = rng.uniform(*settings.length)
    area = _fitted(OUTLINES[kind](rng), length, length * rng.uniform(*settings.aspect))
    height = rng.uniform(*settings.height)
    mass = _log_uniform(rng, settings.mass)
    # one material, or two on either side of a cut; densities that give the mass
    areas, ratio = [area], 1.0
    if rng.random() < settings.two_materials:
        areas = _cut(area, rng)
        ratio = _log_uniform(rng, settings.density_ratio)
    densities = np.array([1.0, ratio])[: len(areas)]
    densities *= mass / (height * sum(d * a.area for d, a in zip(densities, areas, strict=True)))
    colors = _COLORS[rng.permutation(len(_COLORS))].tolist()
    parts = [
        Part(_extruded(polygon, height), float(density), tuple(color))
        for side, density, color in zip(areas, densities, colors, strict=False)
        for polygon in shapely.get_parts(side)
    ]
    body = combine_float64([solid_properties_float64(part.mesh, part.density) for part in parts])
    outer = np.asarray(area.exterior.coords)[:-1]
    rings = [np.asarray(ring.coords)[:-1] for ring in area.interiors]
    return ObjectModel(
        name=f"{kind}_{index}",
        outline=outer,
        height=height,
        inertial=jax.tree.map(jnp.asarray, body),
        pieces=prism_pieces(area, height),
        support=(outer, *rings),
        mesh=_extruded(area, height),
        parts=tuple(parts),
        friction=rng.uniform(*settings.friction),
        source=f"random family, {kind}",
    )


def _log_uniform(rng: Generator, interval: Interval) -> float:
    return float(np.exp(rng.uniform(*np.log(interval))))


def _fitted(area: BaseGeometry, x: float, y: float) -> BaseGeometry:
    """Stretched to a box of the given edges, its centroid at the origin, oriented."""
    low_x, low_y, high_x, high_y = area.bounds
    stretched = scale(area, x / (high_x - low_x), y / (high_y - low_y))
    centred = translate(stretched, -stretched.centroid.x, -stretched.centroid.y)
    return shapely.orient_polygons(centred)


def _cut(area: BaseGeometry, rng: Generator) -> list[BaseGeometry]:
    """The area on either side of a line that passes near its centroid."""
    low_x, low_y, high_x, high_y = area.bounds
    size = np.array([high_x - low_x, high_y - low_y])
    through = rng.uniform(-0.15, 0.15, 2) * size
    angle = rng.uniform(0.0, np.pi)
    reach = 2.0 * size.max() * np.array([np.cos(angle), np.sin(angle)])
    line = shapely.LineString([through - reach, through + reach])
    beside = np.array([-reach[1], reach[0]])
    left = shapely.Polygon([through - reach, through + reach, through + beside])
    parts = shapely.get_parts(split(area, line))
    on_left = [left.contains(part.representative_point()) for part in parts]
    sides = [
        [p for p, side in zip(parts, on_left, strict=True) if side is s] for s in (True, False)
    ]
    return [shapely.MultiPolygon(side) for side in sides if side]


def _extruded(area: BaseGeometry, height: float) -> trimesh.Trimesh:
    return trimesh.creation.extrude_polygon(area, height, engine="manifold")


def _rectangle(rng: Generator) -> BaseGeometry:
    return shapely.box(0.0, 0.0, 1.0, 1.0)


def _rounded(rng: Generator) -> BaseGeometry:
    radius = rng.uniform(0.1, 0.4)
    return shapely.box(radius, radius, 1.0 - radius, 1.0 - radius).buffer(radius, quad_segs=6)


def _ellipse(rng: Generator) -> BaseGeometry:
    return shapely.Point(0.0, 0.0).buffer(1.0, quad_segs=12)


def _polygon(rng: Generator) -> BaseGeometry:
    """Convex, of three to eight corners, none of them sharp."""
    corners = int(rng.integers(3, 9))
    angle = 2.0 * np.pi * (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) / corners
    return shapely.Polygon(np.stack([np.cos(angle), np.sin(angle)], axis=-1)).convex_hull


def _star(rng: Generator) -> BaseGeometry:
    """Of four to seven points of different lengths, like a broken stone."""
    points = int(rng.integers(4, 8))
    radius = rng.uniform(0.55, 1.0, 2 * points)
    radius[1::2] *= rng.uniform(0.6, 0.95)
    angle = np.pi * np.arange(2 * points) / points
    return shapely.Polygon(radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def _l(rng: Generator) -> BaseGeometry:
    x, y = rng.uniform(0.2, 0.6, 2)
    return shapely.Polygon([(0, 0), (1, 0), (1, y), (x, y), (x, 1), (0, 1)])


def _t(rng: Generator) -> BaseGeometry:
    x, y = rng.uniform(0.2, 0.5, 2)
    left = rng.uniform(0.2, 0.8 - x)
    stem = shapely.box(left, 0.0, left + x, 1.0)
    return shapely.union(stem, shapely.box(0.0, 1.0 - y, 1.0, 1.0))


def _cross(rng: Generator) -> BaseGeometry:
    x, y = rng.uniform(0.2, 0.5, 2)
    left, low = rng.uniform(0.15, 0.85 - x), rng.uniform(0.15, 0.85 - y)
    return shapely.union(shapely.box(left, 0.0, left + x, 1.0), shapely.box(0.0, low, 1.0, low + y))


def _trapezium(rng: Generator) -> BaseGeometry:
    top = rng.uniform(0.3, 0.9)
    left = rng.uniform(0.0, 1.0 - top)
    return shapely.Polygon([(0, 0), (1, 0), (left + top, 1), (left, 1)])


def _half_disc(rng: Generator) -> BaseGeometry:
    angle = np.linspace(0.0, np.pi, 25)
    return shapely.Polygon(np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def _frame(rng: Generator) -> BaseGeometry:
    wall = rng.uniform(0.08, 0.25, 4)
    hole = shapely.box(wall[0], wall[1], 1.0 - wall[2], 1.0 - wall[3])
    return shapely.difference(shapely.box(0.0, 0.0, 1.0, 1.0), hole)


def _ring(rng: Generator) -> BaseGeometry:
    disc = shapely.Point(0.0, 0.0).buffer(1.0, quad_segs=12)
    return disc.difference(shapely.Point(0.0, 0.0).buffer(rng.uniform(0.4, 0.8), quad_segs=12))


OUTLINES: dict[str, Callable[[Generator], BaseGeometry]] = {
    "rectangle": _rectangle,
    "rounded": _rounded,
    "ellipse": _ellipse,
    "polygon": _polygon,
    "star": _star,
    "l": _l,
    "t": _t,
    "cross": _cross,
    "trapezium": _trapezium,
    "half_disc": _half_disc,
    "frame": _frame,
    "ring": _ring,
}
