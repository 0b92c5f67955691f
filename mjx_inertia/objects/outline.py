"""Planar geometry of an outline: integrals over its area, and the way from a point to it.

In: an outline, (k, 2) float64 in m, simple and counter-clockwise, its last vertex joined to its
first. Out: area, centroid, second moments, friction radius, and closest points. NumPy in float64:
outlines are read once, outside any compiled function.
"""

import dataclasses

import numpy as np
import shapely
from jaxtyping import Float, Int
from numpy import ndarray


@dataclasses.dataclass(frozen=True)
class PlanarIntegrals:
    """Integrals over the area of an outline."""

    area: float  # m²
    centroid: Float[ndarray, "2"]  # m, object frame
    # ∫ r rᵀ dA about the centroid, m⁴: its trace is the polar moment
    second_moment: Float[ndarray, "2 2"]


@dataclasses.dataclass(frozen=True)
class OutlineContact:
    """Where an outline is closest to each of many points."""

    point: Float[ndarray, "n 2"]  # closest point of the outline, m
    distance: Float[ndarray, " n"]  # from the outline to the given point, m, negative inside
    # unit vector into the object: along a side's inward normal, and at a corner the direction in
    # which a round tip centred on the given point would press
    normal: Float[ndarray, "n 2"]
    edge: Int[ndarray, " n"]  # index of the closest edge, which runs from vertex `edge` to the next


def edges(outline: Float[ndarray, "k 2"]) -> Float[ndarray, "k 2"]:
    """Vectors from each vertex to the next."""
    return np.roll(outline, -1, axis=0) - outline


def signed_area(outline: Float[ndarray, "k 2"]) -> float:
    """Area in m², positive for a counter-clockwise outline (shoelace formula)."""
    following = np.roll(outline, -1, axis=0)
    return float(0.5 * np.sum(_cross(outline, following)))


def planar_integrals(outline: Float[ndarray, "k 2"]) -> PlanarIntegrals:
    """Area, centroid and second moments of the area inside `outline` (Green's theorem).

    Raises:
      ValueError: the outline is clockwise or encloses no area.
    """
    start = outline[0]  # integrate about a vertex: no cancellation far from the origin
    a = outline - start
    b = np.roll(a, -1, axis=0)
    twice_area = _cross(a, b)
    area = 0.5 * twice_area.sum()
    if not area > 0.0:
        raise ValueError(
            f"outline: signed area {area:.3g} m² is not positive; "
            "give a counter-clockwise outline that encloses an area"
        )
    centroid = np.einsum("k,kd->d", twice_area, a + b) / (6.0 * area)
    pairs = a[:, :, None] * a[:, None, :] + b[:, :, None] * b[:, None, :]
    pairs += 0.5 * (a[:, :, None] * b[:, None, :] + b[:, :, None] * a[:, None, :])
    about_start = np.einsum("k,kij->ij", twice_area, pairs) / 12.0
    return PlanarIntegrals(
        area=float(area),
        centroid=centroid + start,
        second_moment=about_start - area * np.outer(centroid, centroid),
    )


def friction_radius(
    outline: Float[ndarray, "k 2"] | tuple[Float[ndarray, "_ 2"], ...], about: Float[ndarray, "2"]
) -> float:
    """Mean distance in m of the area inside `outline` from the point `about`.

    Under uniform pressure this is c = m_max / f_max, the largest friction moment about that point
    over the largest friction force (thesis Eq. 3.6, with the moment as a magnitude μ ∫ |r| p dA).
    For a square of edge a about its centre it is 0.3826 a. The outline is one ring, or several:
    those of patches counter-clockwise, those of their holes clockwise.

    Raises:
      ValueError: the rings enclose no area.
    """
    rings = outline if isinstance(outline, tuple) else (outline,)
    area = sum(signed_area(ring) for ring in rings)
    if not area > 0.0:
        raise ValueError(
            f"outline: signed area {area:.3g} m² is not positive; "
            "give a counter-clockwise outline that encloses an area"
        )
    return sum(_first_moment(ring, about) for ring in rings) / area


def _first_moment(outline: Float[ndarray, "k 2"], about: Float[ndarray, "2"]) -> float:
    """∫ |r| dA over the area inside a ring, m³; negative for a clockwise one.

    Exact: a triangle from `about` to an edge at signed distance d, whose ends lie at t₁ and t₂
    along the edge from the foot of the perpendicular, holds
    ∫ |r| dA = [d t √(d² + t²) + d³ asinh(t / |d|)] / 6 between t₁ and t₂.
    """
    a = outline - np.asarray(about, dtype=np.float64)
    step = edges(outline)
    length = np.linalg.norm(step, axis=1)
    along = step / length[:, None]
    d = _cross(a, along)
    t1 = np.sum(a * along, axis=1)

    def primitive(t: Float[ndarray, " k"]) -> Float[ndarray, " k"]:
        off_edge = np.where(d == 0.0, 1.0, np.abs(d))
        return (d * t * np.hypot(d, t) + d**3 * np.arcsinh(t / off_edge)) / 6.0

    return float(np.sum(primitive(t1 + length) - primitive(t1)))


def closest_on_outline(
    outline: Float[ndarray, "k 2"], points: Float[ndarray, "n 2"]
) -> OutlineContact:
    """Closest point, signed distance and inward normal from each of `points` to `outline`."""
    step = edges(outline)
    from_start = points[:, None, :] - outline[None]
    fraction = np.clip(np.sum(from_start * step, axis=-1) / np.sum(step**2, axis=-1), 0.0, 1.0)
    candidates = outline[None] + fraction[..., None] * step
    squared = np.sum((points[:, None, :] - candidates) ** 2, axis=-1)
    edge = np.argmin(squared, axis=1)
    rows = np.arange(len(points))
    closest, gap = candidates[rows, edge], np.sqrt(squared[rows, edge])
    inside = shapely.contains_xy(shapely.Polygon(outline), points)
    side = step[edge] / np.linalg.norm(step[edge], axis=1, keepdims=True)
    side_normal = np.stack([-side[:, 1], side[:, 0]], axis=-1)
    towards = np.where(inside, -1.0, 1.0)[:, None] * (closest - points)
    # On the outline itself the direction towards it is lost in rounding: the side's normal.
    scale = np.abs(outline).max()
    far = gap > 1e-9 * scale
    unit = towards / np.where(far, gap, 1.0)[:, None]
    return OutlineContact(
        point=closest,
        distance=np.where(inside, -gap, gap),
        normal=np.where(far[:, None], unit, side_normal),
        edge=edge,
    )


def _cross(a: Float[ndarray, "k 2"], b: Float[ndarray, "k 2"]) -> Float[ndarray, " k"]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def turn_vectors(angle: Float[ndarray, "*n"], v: Float[ndarray, "*n 2"]) -> Float[ndarray, "*n 2"]:
    """Each vector turned counterclockwise by its angle, rad."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * v[..., 0] - sin * v[..., 1], sin * v[..., 0] + cos * v[..., 1]], -1)


def in_object_frame(
    pose: Float[ndarray, "n 3"], point: Float[ndarray, "n 2"]
) -> Float[ndarray, "n 2"]:
    """Points of the world in the frame of an object, one at each of its poses (m, m, rad)."""
    return turn_vectors(-pose[:, 2], point - pose[:, :2])
