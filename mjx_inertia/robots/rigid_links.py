"""Poses and links as files state them, in double precision whatever JAX computes in.

In: printed figures. Out: NumPy poses whose right angles are exact, and links joined to one.
"""

from collections.abc import Sequence
from typing import cast

import jax
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.spatial import InertialParameters, Pose, combine, inertial_float64

_PRINTED_RIGHT_ANGLE = 1e-10  # rad; Baxter's file prints π/2 to eleven digits
_ROUNDING = 4e-16  # of the entries of a rotation


def printed_pose(xyz: Sequence[float], rpy: Sequence[float]) -> Pose:
    """As `pose`, but a right angle that was printed to few digits is one."""
    angles = np.asarray(rpy, np.float64)
    right = np.round(angles / (np.pi / 2)) * (np.pi / 2)
    return pose(xyz, np.where(abs(angles - right) < _PRINTED_RIGHT_ANGLE, right, angles).tolist())


def pose(xyz: Sequence[float], rpy: Sequence[float]) -> Pose:
    """Pose of URDF's `origin`: R = Rz(yaw) Ry(pitch) Rx(roll), fixed axes, rad."""
    angles = np.asarray(rpy, np.float64)
    return exact_pose(Rotation.from_euler("xyz", angles).as_matrix(), np.asarray(xyz, np.float64))


def exact_pose(rotation: Float[ndarray, "3 3"], translation: Float[ndarray, "3"]) -> Pose:
    """The pose with entries of the rotation that are 0, 1 or -1 but for rounding made so."""
    whole = np.round(rotation)
    near = abs(rotation - whole) < _ROUNDING
    return Pose(np.where(near, whole + 0.0, rotation), np.asarray(translation, np.float64))


def about_axis(axis: Float[ndarray, "3"], angle: float) -> Pose:
    """Rotation by `angle` (rad) about a unit `axis` through the origin."""
    return exact_pose(Rotation.from_rotvec(angle * axis).as_matrix(), np.zeros(3))


def shift(offset: Float[ndarray, "3"]) -> Pose:
    """Translation by `offset` (m)."""
    return Pose(np.eye(3), np.asarray(offset, np.float64))


def link_parameters(
    mass: float, com: Sequence[float], upper: Sequence[float], T_new_old: Pose | None = None
) -> InertialParameters:
    """A link of printed figures; the tensor's entries are xx, xy, xz, yy, yz, zz."""
    xx, xy, xz, yy, yz, zz = map(float, upper)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    params = inertial_float64(mass, com, tensor)
    return params if T_new_old is None else transform_parameters(params, T_new_old)


def cuboid_parameters(
    mass: float, size: Sequence[float], center: Sequence[float]
) -> InertialParameters:
    """A uniform cuboid with edges (m) along the axes."""
    square = np.asarray(size, np.float64) ** 2
    return inertial_float64(mass, center, np.diag(mass / 12.0 * (square.sum() - square)))


def transform_parameters(params: InertialParameters, T_new_old: Pose) -> InertialParameters:
    """The body in frame `new`, in the arrays of its figures: NumPy's, or traced ones."""
    turn = T_new_old.rotation
    # R I Rᵀ as sums of products, because a GPU rounds the factors of a matrix product in float32
    half = (turn[:, :, None] * params.inertia).sum(1)
    inertia = (half[:, None] * turn).sum(-1)
    com = cast(jax.Array, T_new_old.apply(params.com))
    return InertialParameters(params.mass, com, inertia)


def merge_links(bodies: Sequence[InertialParameters]) -> InertialParameters:
    """Bodies in one frame as one body; none at all weigh nothing."""
    if not bodies:
        return inertial_float64(0.0, np.zeros(3), np.zeros((3, 3)))
    if len(bodies) == 1:
        return bodies[0]
    with jax.enable_x64(True):
        return jax.tree.map(np.asarray, combine(stacked_links(bodies)))


def stacked_poses(poses: Sequence[Pose]) -> Pose:
    """Poses with one leading axis."""
    rotation = np.stack([np.asarray(T.rotation) for T in poses])
    return Pose(rotation, np.stack([np.asarray(T.translation) for T in poses]))


def stacked_links(links: Sequence[InertialParameters]) -> InertialParameters:
    """Links with one leading axis."""
    return jax.tree.map(lambda *leaves: np.stack(leaves), *links)
