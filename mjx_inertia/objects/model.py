"""A rigid object as pushing and grasping see it: an upright prism with known inertia.

In: an outline, a height and inertial parameters. Out: `ObjectModel`, checked.
"""

import dataclasses
import functools

import jax
import numpy as np
import shapely
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.objects.convex_pieces import convex_pieces
from mjx_inertia.objects.outline import PlanarIntegrals, planar_integrals, signed_area
from mjx_inertia.spatial import Consistency, InertialParameters, check_consistency, explain

_check_consistency = jax.jit(check_consistency)


@dataclasses.dataclass(frozen=True, eq=False)
class ObjectModel:
    """An object that stands on a table.

    The object frame has its z axis up and z = 0 at the base; its origin is where the outline's
    coordinates say, not at the CoM in general.

    Attributes:
      name: for messages and tables.
      outline: (k, 2) of the footprint, m, simple; made counter-clockwise if it is not.
      height: m.
      inertial: true parameters in the object frame.
      pieces: convex outlines, m, whose union is the footprint, for collision; made from the
        outline when not given.

    Raises:
      ValueError: an outline, a height or a mass that no object can have.
    """

    name: str
    outline: Float[ndarray, "k 2"]
    height: float
    inertial: InertialParameters
    pieces: tuple[Float[ndarray, "_ 2"], ...] = ()

    def __post_init__(self) -> None:
        """Checks the fields and completes them."""
        outline = checked_outline(self.outline, self.name)
        if not (np.isfinite(self.height) and self.height > 0.0):
            raise ValueError(f"{self.name}: height {self.height} m is not positive")
        if _check_consistency(self.inertial) > Consistency.ON_BOUNDARY:
            raise ValueError(f"{self.name}: {explain(self.inertial)}")
        object.__setattr__(self, "outline", outline)
        object.__setattr__(self, "pieces", self.pieces or convex_pieces(outline))

    @functools.cached_property
    def footprint(self) -> PlanarIntegrals:
        """Area, centroid and second moments of the footprint."""
        return planar_integrals(self.outline)

    @property
    def is_convex(self) -> bool:
        """Whether one convex piece is the whole object."""
        return len(self.pieces) == 1

    @functools.cached_property
    def is_box(self) -> bool:
        """Whether the outline is a rectangle along the axes of the object frame."""
        if len(self.outline) != 4:
            return False
        step = np.abs(np.roll(self.outline, -1, axis=0) - self.outline)
        return bool(np.all(step.min(axis=1) <= 1e-9 * step.max()))

    @property
    def center(self) -> Float[ndarray, "3"]:
        """Centre of the bounding box in the object frame, m."""
        low, high = self.outline.min(axis=0), self.outline.max(axis=0)
        return np.append(0.5 * (low + high), 0.5 * self.height)

    @property
    def half_extents(self) -> Float[ndarray, "3"]:
        """Half the edges of the bounding box, m: those of the object itself if `is_box`."""
        low, high = self.outline.min(axis=0), self.outline.max(axis=0)
        return np.append(0.5 * (high - low), 0.5 * self.height)

    @property
    def mean_diameter(self) -> float:
        """Diameter of the circle with the footprint's area, m."""
        return float(2.0 * np.sqrt(self.footprint.area / np.pi))


def checked_outline(outline: object, name: str) -> Float[ndarray, "k 2"]:
    """`outline` as a counter-clockwise (k, 2) float64 array without repeated vertices.

    A clockwise outline is reversed; a last vertex equal to the first is dropped.

    Raises:
      ValueError: wrong shape, not finite, no area, or crossing itself.
    """
    try:
        vertices = np.array(outline, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: outline is not a table of numbers ({error})") from None
    if vertices.ndim != 2 or vertices.shape[1] != 2:
        raise ValueError(f"{name}: outline has shape {vertices.shape}, expected (vertices, 2)")
    if not np.all(np.isfinite(vertices)):
        raise ValueError(f"{name}: outline has values that are not finite")
    vertices = vertices[np.any(vertices != np.roll(vertices, 1, axis=0), axis=1)]
    if len(vertices) < 3:
        raise ValueError(f"{name}: outline has {len(vertices)} distinct vertices, needs 3 or more")
    spread = np.linalg.svd(vertices - vertices.mean(axis=0), compute_uv=False)
    if spread[1] <= 1e-9 * spread[0]:
        raise ValueError(f"{name}: outline encloses no area; its vertices lie on a line")
    if not shapely.Polygon(vertices).is_valid:
        reason = shapely.is_valid_reason(shapely.Polygon(vertices))
        raise ValueError(
            f"{name}: outline is not simple ({reason}); list its vertices in order around it"
        )
    return vertices if signed_area(vertices) > 0.0 else vertices[::-1].copy()
