"""How a parallel jaw holds an object: the pose of the hand, its opening, and the two contacts.

The hand frame has its origin in the middle between the finger pads, z along the approach (out of
the palm, towards the object), y along the closing direction and x = y × z across the fingers. Pad 0
is on the side of -y and pushes along +y, pad 1 the other way round.
In: contact points and approach directions. Out: `Grasp`.
"""

import dataclasses

import jax.numpy as jnp
import jaxlie
import numpy as np
from flax import struct
from jaxtyping import Array, Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.spatial import AnyArray


@struct.dataclass
class Contacts:
    """Where fingers touch an object (with leading axes: of many grasps), in the object frame."""

    points: Float[Array, "*n k 3"]  # m
    # of length 1, into the object: the direction in which a finger can push
    normals: Float[Array, "*n k 3"]


@struct.dataclass
class Grasp:
    """A grasp of a parallel jaw (with leading axes: many of them)."""

    T_obj_hand: jaxlie.SE3  # pose of the hand frame in the object frame
    width: Float[Array, "*n"]  # between the pads, m
    contacts: Contacts  # of pad 0 and pad 1

    @property
    def approach(self) -> Float[Array, "*n 3"]:
        """Direction out of the palm, in the axes of the object."""
        return self.T_obj_hand.rotation().as_matrix()[..., :, 2]

    @property
    def closing(self) -> Float[Array, "*n 3"]:
        """Direction from pad 0 to pad 1, in the axes of the object."""
        return self.T_obj_hand.rotation().as_matrix()[..., :, 1]


@dataclasses.dataclass(frozen=True)
class HandFrames:
    """Hand frames on the host, before they become a `Grasp`."""

    axes: Float[ndarray, "n 3 3"]  # columns x, y, z of the hand in the axes of the object
    origin: Float[ndarray, "n 3"]  # m, in the object frame
    width: Float[ndarray, " n"]  # m


def hand_frames_from_points(
    points: Float[AnyArray, "n 2 3"], approach: Float[AnyArray, "n 3"]
) -> HandFrames:
    """Hands that touch the points of pad 0 and pad 1.

    Args:
      points: m, in the object frame.
      approach: direction out of the palm; only its part normal to the closing direction counts.

    Raises:
      ValueError: two points coincide, or an approach is along its closing direction; with the row.
    """
    points = np.asarray(points, dtype=np.float64)
    approach = np.asarray(approach, dtype=np.float64)
    across = points[:, 1] - points[:, 0]
    width = np.linalg.norm(across, axis=1)
    if np.any(bad := ~(width > 0.0)):
        row = int(np.flatnonzero(bad)[0])
        raise ValueError(f"`points` of grasp {row} coincide at {points[row, 0].tolist()}")
    y = across / width[:, None]
    z = approach - np.sum(approach * y, axis=1, keepdims=True) * y
    length = np.linalg.norm(z, axis=1)
    if np.any(bad := ~(length > 1e-6 * np.linalg.norm(approach, axis=1))):
        row = int(np.flatnonzero(bad)[0])
        raise ValueError(
            f"`approach` of grasp {row} is {approach[row].tolist()}, along the closing direction "
            f"{y[row].tolist()}; give one across it"
        )
    z /= length[:, None]
    return HandFrames(np.stack([np.cross(y, z), y, z], axis=2), points.mean(axis=1), width)


def grasps_at(
    points: Float[AnyArray, "n 2 3"],
    normals: Float[AnyArray, "n 2 3"],
    approach: Float[AnyArray, "n 3"],
) -> Grasp:
    """Grasps by their contacts and approach directions, on the host.

    Args:
      points: of pad 0 and pad 1, m, in the object frame.
      normals: of length 1, into the object.
      approach: as for `hand_frames_from_points`.

    Raises:
      ValueError: as `hand_frames_from_points`.
    """
    frames = hand_frames_from_points(points, approach)
    wxyz = Rotation.from_matrix(frames.axes).as_quat(scalar_first=True)
    return Grasp(
        T_obj_hand=jaxlie.SE3(jnp.asarray(np.concatenate([wxyz, frames.origin], axis=1))),
        width=jnp.asarray(frames.width),
        contacts=Contacts(jnp.asarray(points), jnp.asarray(normals)),
    )
