"""New objects out of known ones: larger, heavier, or several joined.

In: `ObjectModel`s. Out: another one, consistent in shape, mass and inertia (thesis §3.2: "the
object models can be scaled and combined to generate new objects with new inertial parameters").
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

from mjx_inertia.objects.manifolds import from_manifold, lowest, silhouette, union
from mjx_inertia.objects.mesh_integrals import is_positive
from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.part import Part, transformed
from mjx_inertia.objects.part_assembly import SUPPORT_DEPTH, combine_bodies
from mjx_inertia.spatial import (
    InertialParameters,
    change_frame,
    inertia_from_second_moment,
    second_moment_from_inertia,
)

_OVERLAP = 1e-4  # of the smaller object's volume


def re_mass(obj: ObjectModel, mass: float) -> ObjectModel:
    """The same shape with another mass, kg: all densities, and the tensor, scale with it.

    Raises:
      ValueError: a mass that is not positive.
    """
    if not is_positive(mass):
        raise ValueError(f"{obj.name}: mass {mass!r} kg is not positive")
    factor = mass / float(obj.inertial.mass)
    inertial = obj.inertial
    return dataclasses.replace(
        obj,
        inertial=InertialParameters(
            mass=jnp.asarray(np.float64(mass)),
            com=inertial.com,
            inertia=inertial.inertia * factor,
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
    with jax.enable_x64(True):
        body = jax.tree.map(lambda x: jnp.asarray(np.asarray(x, np.float64)), obj.inertial)
        times = float(np.prod(stretch))
        moment = second_moment_from_inertia(body.inertia) * np.outer(stretch, stretch) * times
        grown = jax.tree.map(
            np.asarray, (body.mass * times, body.com * stretch, inertia_from_second_moment(moment))
        )
    matrix = np.diag([*stretch, 1.0])
    flat = stretch[:2]
    larger = dataclasses.replace(
        obj,
        outline=obj.outline * flat,
        height=obj.height * float(stretch[2]),
        inertial=InertialParameters(*map(jnp.asarray, grown)),
        pieces=tuple(piece * stretch for piece in obj.pieces),
        support=tuple(ring * flat for ring in obj.support),
        mesh=trimesh.Trimesh(obj.mesh.vertices * stretch, obj.mesh.faces, process=False),
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
    meshes = [_placed(obj.mesh, T) for obj, T in zip(objects, matrices, strict=True)]
    low = min(float(mesh.bounds[0, 2]) for mesh in meshes)
    for T in matrices:
        T[2, 3] -= low
    meshes = [_placed(obj.mesh, T) for obj, T in zip(objects, matrices, strict=True)]
    whole = union(meshes)
    shared = sum(mesh.volume for mesh in meshes) - whole.volume()
    if shared > _OVERLAP * min(mesh.volume for mesh in meshes):
        raise ValueError(
            f"{name}: objects overlap by {1e6 * shared:.3g} cm³; move them apart until they touch"
        )
    bodies = [_moved(obj.inertial, T) for obj, T in zip(objects, matrices, strict=True)]
    heaviest = max(objects, key=lambda obj: float(obj.inertial.mass))
    return ObjectModel(
        name=name,
        outline=silhouette(whole, name),
        height=whole.bounding_box()[5],
        inertial=combine_bodies(bodies),
        pieces=tuple(
            piece @ T[:3, :3].T + T[:3, 3]
            for obj, T in zip(objects, matrices, strict=True)
            for piece in obj.pieces
        ),
        support=lowest(whole, SUPPORT_DEPTH),
        mesh=from_manifold(whole),
        parts=tuple(
            transformed(part, T)
            for obj, T in zip(objects, matrices, strict=True)
            for part in obj.parts or (_homogeneous(obj),)
        ),
        friction=heaviest.friction,
        color=heaviest.color,
        source=" + ".join(obj.name for obj in objects),
    )


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


def _placed(mesh: trimesh.Trimesh, T_new_object: Float[ndarray, "4 4"]) -> trimesh.Trimesh:
    vertices = mesh.vertices @ T_new_object[:3, :3].T + T_new_object[:3, 3]
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def _moved(body: InertialParameters, T_new_object: Float[ndarray, "4 4"]) -> InertialParameters:
    """In double precision, as NumPy arrays."""
    with jax.enable_x64(True):
        exact = jax.tree.map(lambda x: jnp.asarray(np.asarray(x, np.float64)), body)
        there = change_frame(exact, jaxlie.SE3.from_matrix(jnp.asarray(T_new_object)))
        return jax.tree.map(np.asarray, there)


def _homogeneous(obj: ObjectModel) -> Part:
    return Part(obj.mesh, float(obj.inertial.mass) / obj.mesh.volume, obj.color)
