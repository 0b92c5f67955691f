"""Objects made of parts, and new objects made of known ones: larger, heavier, or several joined.

In: `Part`s that touch but do not overlap, in their resting pose, or `ObjectModel`s. Out: an
`ObjectModel` consistent in shape, mass and inertia (thesis §3.2: "the object models can be scaled
and combined to generate new objects with new inertial parameters").
"""

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import trimesh
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.objects.decomposition import object_pieces
from mjx_inertia.objects.manifolds import from_manifold, lowest, silhouette, union
from mjx_inertia.objects.mesh_integrals import is_positive, mass_properties
from mjx_inertia.objects.model import Color, ObjectModel, Part, transform_mesh, transformed
from mjx_inertia.spatial import (
    InertialParameters,
    change_frame_float64,
    combine_float64,
    inertia_from_second_moment,
    inertial_float64,
    second_moment_from_inertia,
)

# What lies within this of the table bears the object: elastic bodies sink in, and so a ball has a
# patch and a lying cylinder a strip. It is beyond the facets of round surfaces (0.05 mm at a radius
# of 40 mm) and well below what stands free.
SUPPORT_DEPTH = 2e-4  # m
_OVERLAP = 1e-4  # of the volume: what parts may share before their mass is counted twice
_OFF_TABLE = 1e-6  # m


def from_parts(
    name: str,
    parts: Sequence[Part],
    *,
    mass: float | None = None,
    category: str = "",
    friction: float = 0.4,
    source: str = "",
) -> ObjectModel:
    """The object that `parts` make up, with exact inertial parameters.

    Args:
      name: for messages and tables.
      parts: watertight, touching but not overlapping, with the lowest point on z = 0.
      mass: kg; all densities are scaled by one factor to meet it, and are taken as they are if
        None.
      category: of the catalogue.
      friction: Coulomb's coefficient on a wooden or plastic table.
      source: where the figures come from.

    Raises:
      ValueError: which part is no solid or has no density, parts that overlap or lie apart as seen
        from above, an object that does not stand on z = 0, or a mass that is not positive.
    """
    if not parts:
        raise ValueError(f"{name}: no parts")
    if mass is not None:
        _check_mass(name, mass)
    bodies = [_part_inertial(name, i, part) for i, part in enumerate(parts)]
    total = combine_float64(bodies)
    factor = 1.0 if mass is None else mass / sum(float(body.mass) for body in bodies)
    # the union of the parts, and whether they share volume
    whole = union(part.mesh for part in parts)
    volume = whole.volume()
    shared = sum(part.mesh.volume for part in parts) - volume
    if shared > _OVERLAP * volume:
        raise ValueError(
            f"{name}: parts overlap by {1e6 * shared:.3g} cm³ of {1e6 * volume:.3g} cm³, which "
            "would count that mass twice; cut one part out of the other"
        )
    low, high = whole.bounding_box()[2], whole.bounding_box()[5]
    if abs(low) > _OFF_TABLE:
        raise ValueError(
            f"{name}: its lowest point is at z = {low:.3g} m, not on the table; move its parts"
        )
    return ObjectModel(
        name=name,
        outline=silhouette(whole, name),
        height=high,
        inertial=_scaled(total, factor),
        pieces=object_pieces(parts, whole),
        support=lowest(whole, SUPPORT_DEPTH),
        mesh=from_manifold(whole),
        # each with its true density; the object holds the convex pieces of all
        parts=tuple(
            dataclasses.replace(
                part,
                mesh=trimesh.Trimesh(part.mesh.vertices, part.mesh.faces, process=False),
                density=part.density * factor,
                pieces=(),
            )
            for part in parts
        ),
        category=category,
        friction=friction,
        color=main_color(parts),
        source=source,
    )


def main_color(parts: Sequence[Part]) -> Color:
    """Colour of the largest part."""
    return max(parts, key=lambda part: part.mesh.volume).color


def re_mass(obj: ObjectModel, mass: float) -> ObjectModel:
    """The same shape with another mass, kg: all densities, and the tensor, scale with it.

    Raises:
      ValueError: a mass that is not positive.
    """
    _check_mass(obj.name, mass)
    factor = mass / float(obj.inertial.mass)
    return dataclasses.replace(
        obj,
        inertial=obj.inertial.replace(
            mass=jnp.asarray(np.float64(mass)), inertia=obj.inertial.inertia * factor
        ),
        parts=tuple(dataclasses.replace(p, density=p.density * factor) for p in obj.parts),
    )


def scale_object(
    obj: ObjectModel, factor: float | tuple[float, float, float], mass: float | None = None
) -> ObjectModel:
    """The object stretched about the origin of its frame.

    The tensor follows exactly: a stretch S takes the second moment Σ to |S| S Σ S at the same
    density.

    Args:
      obj: the object.
      factor: for all axes, or along x, y and z.
      mass: kg; the densities stay if None.

    Raises:
      ValueError: a factor or a mass that is not positive.
    """
    given = np.asarray(factor)
    if given.shape not in ((), (3,)) or given.dtype.kind not in "iuf":
        raise ValueError(f"{obj.name}: factor {factor!r} is not one number or three")
    stretch = np.broadcast_to(given.astype(np.float64), (3,))
    if not np.all(np.isfinite(stretch) & (stretch > 0.0)):
        raise ValueError(f"{obj.name}: factor {factor} is not positive")
    # mass, CoM and second moment at the same density, in double precision
    volume_factor = float(np.prod(stretch))
    body = inertial_float64(obj.inertial.mass, obj.inertial.com, obj.inertial.inertia)
    with jax.enable_x64(True):
        moment = second_moment_from_inertia(jnp.asarray(body.inertia))
        moment = moment * np.outer(stretch, stretch) * volume_factor
        tensor = np.asarray(inertia_from_second_moment(moment))
    grown = inertial_float64(body.mass * volume_factor, body.com * stretch, tensor)
    matrix = np.diag([*stretch, 1.0])
    larger = dataclasses.replace(
        obj,
        outline=obj.outline * stretch[:2],
        height=obj.height * float(stretch[2]),
        inertial=jax.tree.map(jnp.asarray, grown),
        pieces=tuple(piece * stretch for piece in obj.pieces),
        support=tuple(ring * stretch[:2] for ring in obj.support),
        mesh=transform_mesh(obj.mesh, matrix),
        parts=tuple(transformed(part, matrix) for part in obj.parts),
    )
    return larger if mass is None else re_mass(larger, mass)


def combine_objects(
    objects: Sequence[ObjectModel], poses: Sequence[jaxlie.SE3], name: str = "combined"
) -> ObjectModel:
    """Several objects joined rigidly into one, of non-uniform mass.

    Args:
      objects: which touch, or stand one above the other, and do not overlap.
      poses: T_new_object of each. The whole is then put down: moved along z so that its lowest
        point is at z = 0. Whether it stands there by itself, its `stability` says.
      name: of the new object.

    Raises:
      ValueError: not as many poses as objects, none at all, a pose that is not finite, objects that
        overlap, or that lie apart as seen from above.
    """
    if len(objects) == 0 or len(objects) != len(poses):
        raise ValueError(f"{name}: {len(objects)} objects with {len(poses)} poses")
    matrices = [_rigid(name, i, pose) for i, pose in enumerate(poses)]
    placed = list(zip(objects, matrices, strict=True))
    # put down on the table
    low = min(float(transform_mesh(obj.mesh, T).bounds[0, 2]) for obj, T in placed)
    for T in matrices:
        T[2, 3] -= low
    meshes = [transform_mesh(obj.mesh, T) for obj, T in placed]
    whole = union(meshes)
    shared = sum(mesh.volume for mesh in meshes) - whole.volume()
    if shared > _OVERLAP * min(mesh.volume for mesh in meshes):
        raise ValueError(
            f"{name}: objects overlap by {1e6 * shared:.3g} cm³; move them apart until they touch"
        )
    # mass properties of the whole; friction and colour of the heaviest
    total = combine_float64([change_frame_float64(obj.inertial, T) for obj, T in placed])
    heaviest = max(objects, key=lambda obj: float(obj.inertial.mass))
    return ObjectModel(
        name=name,
        outline=silhouette(whole, name),
        height=whole.bounding_box()[5],
        inertial=jax.tree.map(jnp.asarray, total),
        pieces=tuple(p @ T[:3, :3].T + T[:3, 3] for obj, T in placed for p in obj.pieces),
        support=lowest(whole, SUPPORT_DEPTH),
        mesh=from_manifold(whole),
        parts=tuple(
            transformed(part, T) for obj, T in placed for part in obj.parts or (_homogeneous(obj),)
        ),
        friction=heaviest.friction,
        color=heaviest.color,
        source=" + ".join(obj.name for obj in objects),
    )


def _check_mass(name: str, mass: float) -> None:
    if not is_positive(mass):
        raise ValueError(f"{name}: mass {mass!r} kg is not positive")


def _part_inertial(name: str, index: int, part: Part) -> InertialParameters:
    """In double precision, as NumPy arrays."""
    try:
        with jax.enable_x64(True):
            body = mass_properties(part.mesh.vertices, part.mesh.faces, part.density)
            return jax.tree.map(np.asarray, body)
    except ValueError as error:
        raise ValueError(f"{name}: part {index}: {error}") from None


def _scaled(body: InertialParameters, factor: float) -> InertialParameters:
    """The body with all densities times `factor`, in the precision that JAX works in."""
    grown = body.replace(mass=body.mass * factor, inertia=body.inertia * factor)
    return jax.tree.map(jnp.asarray, grown)


def _rigid(name: str, i: int, pose: jaxlie.SE3) -> Float[ndarray, "4 4"]:
    """In double precision, exactly orthonormal whatever the precision of the pose."""
    if not isinstance(pose, jaxlie.SE3):
        raise ValueError(f"{name}: pose {i} is a {type(pose).__name__}, expected a jaxlie.SE3")
    numbers = np.asarray(pose.wxyz_xyz, np.float64)
    if numbers.shape != (7,):
        raise ValueError(f"poses: one has leading axes, {numbers.shape[:-1]}; give one per object")
    if not np.all(np.isfinite(numbers)):
        raise ValueError(f"{name}: pose {i} is not finite (wxyz, xyz = {numbers.tolist()})")
    matrix = trimesh.transformations.quaternion_matrix(numbers[:4])
    matrix[:3, 3] = numbers[4:]
    return matrix


def _homogeneous(obj: ObjectModel) -> Part:
    return Part(obj.mesh, float(obj.inertial.mass) / obj.mesh.volume, obj.color)
