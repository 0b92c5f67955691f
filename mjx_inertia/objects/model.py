"""A rigid object as pushing and grasping see it: a solid with known inertia, at rest on a table.

In: a silhouette, a height, inertial parameters, and the solid itself unless it is an upright prism.
Out: `ObjectModel`, checked; upright prisms of given mass; `Part`, of which other objects consist.
"""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.objects.convex import convex_pieces, pieces_error, upright
from mjx_inertia.objects.outline import PlanarIntegrals, planar_integrals, signed_area
from mjx_inertia.spatial import (
    Consistency,
    InertialParameters,
    check_consistency,
    explain_consistency,
    inertia_from_second_moment,
)

_check_consistency = jax.jit(check_consistency)

Color = tuple[float, float, float]  # red, green, blue, each from 0 to 1


@dataclasses.dataclass(frozen=True, eq=False)
class Part:
    """A piece of one material."""

    # closed surface with outward faces, m, in the frame of the object (z up, base at z = 0 in the
    # resting pose)
    mesh: trimesh.Trimesh
    density: float  # kg/m³
    color: Color = (0.6, 0.6, 0.6)
    # vertices of convex bodies whose union is close to the part, for collision. Without any, a
    # convex part is its own piece, and a part that is not convex is decomposed.
    pieces: tuple[Float[ndarray, "_ 3"], ...] = ()


def transform_mesh(mesh: trimesh.Trimesh, T_new_old: Float[ndarray, "4 4"]) -> trimesh.Trimesh:
    """The mesh at a rigid or affine pose; its faces stay outward where that mirrors it."""
    A = T_new_old[:3, :3]
    faces = mesh.faces if np.linalg.det(A) > 0.0 else mesh.faces[:, ::-1]
    return trimesh.Trimesh(mesh.vertices @ A.T + T_new_old[:3, 3], faces, process=False)


def transformed(part: Part, T_new_old: Float[ndarray, "4 4"]) -> Part:
    """The part at a rigid or affine pose, which may mirror it."""
    pieces = tuple(piece @ T_new_old[:3, :3].T + T_new_old[:3, 3] for piece in part.pieces)
    mesh = transform_mesh(part.mesh, T_new_old)
    return dataclasses.replace(part, mesh=mesh, pieces=pieces)


def moved(part: Part, offset: tuple[float, float, float]) -> Part:
    """The part displaced by `offset`, m."""
    return transformed(part, trimesh.transformations.translation_matrix(offset))


def turned(
    part: Part,
    angle_deg: float,
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0),
    about: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Part:
    """The part turned by `angle_deg` around the `axis` through the point `about`, m."""
    matrix = trimesh.transformations.rotation_matrix(np.radians(angle_deg), axis, about)
    return transformed(part, matrix)


def on_table(*parts: Part) -> tuple[Part, ...]:
    """Parts moved up or down together so that the lowest point of all is at z = 0."""
    low = min(float(part.mesh.bounds[0, 2]) for part in parts)
    return tuple(moved(part, (0.0, 0.0, -low)) for part in parts)


@dataclasses.dataclass(frozen=True, eq=False)
class ObjectModel:
    """An object that stands on a table.

    The object frame has its z axis up and z = 0 at the base; its origin is that of the outline's
    coordinates, in general not the CoM. `name`, `outline`, `height` and `inertial` alone describe
    an upright prism, whose mesh, pieces and support are made from them.

    Raises:
      ValueError: an outline, a height, a friction or a mass that no object can have.
    """

    name: str  # for messages and tables
    # (k, 2), m, simple: what the object covers as seen from above, without holes; made
    # counter-clockwise if it is not
    outline: Float[ndarray, "k 2"]
    height: float  # m
    inertial: InertialParameters  # true parameters in the object frame
    # vertices (k, 3), m, of convex bodies whose union is close to the object, for collision;
    # `pieces_error` says how close
    pieces: tuple[Float[ndarray, "_ 3"], ...] = ()
    # rings of the patches that touch the table, m, those of holes clockwise; the pressure of the
    # table is taken to be uniform over them
    support: tuple[Float[ndarray, "_ 2"], ...] = ()
    # watertight surface of the whole, m
    mesh: trimesh.Trimesh = dataclasses.field(default_factory=trimesh.Trimesh)
    # of one material each, which together are the object; none where only the whole is known
    parts: tuple[Part, ...] = ()
    category: str = ""  # of the catalogue, or empty
    friction: float = 0.4  # Coulomb's coefficient on a wooden or plastic table
    color: Color = (0.6, 0.6, 0.6)  # where the parts have none
    source: str = ""  # where the figures come from

    def __post_init__(self) -> None:
        """Checks the fields and completes them."""
        outline = checked_outline(self.outline, self.name)
        if not (np.isfinite(self.height) and self.height > 0.0):
            raise ValueError(f"{self.name}: height {self.height} m is not positive")
        if not (np.isfinite(self.friction) and self.friction >= 0.0):
            raise ValueError(f"{self.name}: friction {self.friction} is negative or not finite")
        if _check_consistency(self.inertial) > Consistency.ON_BOUNDARY:
            raise ValueError(f"{self.name}: {explain_consistency(self.inertial)}")
        object.__setattr__(self, "outline", outline)
        object.__setattr__(self, "support", self.support or (outline,))
        if self.mesh.is_empty:
            polygon = shapely.Polygon(outline)
            prism = trimesh.creation.extrude_polygon(polygon, self.height, engine="manifold")
            object.__setattr__(self, "mesh", prism)
        if not self.pieces:
            pieces = tuple(upright(piece, self.height) for piece in convex_pieces(outline))
            object.__setattr__(self, "pieces", pieces)

    @functools.cached_property
    def footprint(self) -> PlanarIntegrals:
        """Area, centroid and second moments of the area inside the outline."""
        return planar_integrals(self.outline)

    @property
    def is_convex(self) -> bool:
        """Whether one convex piece is the whole object."""
        return len(self.pieces) == 1

    @functools.cached_property
    def is_box(self) -> bool:
        """Whether it is a box with edges along the axes of the object frame."""
        if len(self.outline) != 4 or not self.is_convex or len(self.pieces[0]) != 8:
            return False
        off = np.abs(np.abs(self.pieces[0] - self.center) - self.half_extents)
        return bool(np.all(off <= 1e-6 * self.half_extents.max()))

    @functools.cached_property
    def pieces_error(self) -> float:
        """Volume in the object or in its `pieces` but not in both, as a share of the object's."""
        return pieces_error(self.mesh, self.pieces)

    @functools.cached_property
    def stability(self) -> float:
        """Distance of the CoM, seen from above, inside the hull of `support`, m.

        Negative where the object topples.
        """
        hull = shapely.MultiPoint(np.concatenate(self.support)).convex_hull
        com = shapely.Point(np.asarray(self.inertial.com)[:2])
        distance = float(hull.boundary.distance(com))
        return distance if hull.covers(com) else -distance

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


def cube(edge: float, mass: float, name: str = "cube") -> ObjectModel:
    """A uniform cube centred on the object frame's z axis: I = m a² / 6 about every axis."""
    return cuboid((edge, edge, edge), mass, name=name)


def cuboid(size: tuple[float, float, float], mass: float, name: str = "cuboid") -> ObjectModel:
    """A uniform cuboid centred on the object frame's z axis; `size` along x, y, z in m."""
    if not all(np.isfinite(edge) and edge > 0.0 for edge in size):
        raise ValueError(f"{name}: size {size} m has an edge that is not positive")
    x, y = 0.5 * size[0], 0.5 * size[1]
    outline = np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
    return prism(outline, size[2], mass, name=name)


def prism(
    outline: Float[ndarray, "k 2"],
    height: float,
    mass: float,
    *,
    inertia_zz: float | None = None,
    com: tuple[float, float] | None = None,
    name: str = "prism",
) -> ObjectModel:
    """An upright prism on `outline`.

    Uniform density unless told otherwise. With `inertia_zz`, the mass is taken to be spread like
    the outline but scaled in the plane: the planar second moments keep their ratios and sum to
    I_zz, while the spread along z stays m h² / 12. `com` moves the CoM in the plane and leaves
    the tensor about it; the CoM stays at half the height.

    Args:
      outline: (k, 2), m, simple.
      height: m.
      mass: kg.
      inertia_zz: about the CoM, kg m².
      com: x, y in the object frame, m.
      name: for messages.

    Raises:
      ValueError: values that no object can have.
    """
    outline = checked_outline(outline, name)
    if not (np.isfinite(mass) and mass > 0.0):
        raise ValueError(f"{name}: mass {mass} kg is not positive")
    if inertia_zz is not None and not (np.isfinite(inertia_zz) and inertia_zz > 0.0):
        raise ValueError(f"{name}: inertia_zz {inertia_zz} kg m² is not positive")
    if com is not None and not np.all(np.isfinite(com)):
        raise ValueError(f"{name}: com {com} m is not finite")
    # second moments of the mass about the CoM: in the plane as the outline's, and along z
    plane = planar_integrals(outline)
    spread = mass * plane.second_moment / plane.area
    if inertia_zz is not None:
        spread = spread * (inertia_zz / np.trace(spread))
    second_moment = np.zeros((3, 3))
    second_moment[:2, :2] = spread
    second_moment[2, 2] = mass * height**2 / 12.0
    center = plane.centroid if com is None else np.asarray(com, dtype=np.float64)
    return ObjectModel(
        name=name,
        outline=outline,
        height=height,
        inertial=InertialParameters(
            mass=jnp.asarray(np.float64(mass)),
            com=jnp.asarray(np.append(center, 0.5 * height)),
            inertia=inertia_from_second_moment(jnp.asarray(second_moment)),
        ),
    )
