"""Parallel jaws, and how they hold an object: pose of the hand, opening, and the two contacts.

The hand frame has its origin in the middle between the finger pads, z along the approach (out of
the palm, towards the object), y along the closing direction and x = y × z across the fingers. Pad 0
is on the side of -y and pushes along +y, pad 1 the other way round.
In: contact points and approach directions. Out: `Grasp`; `Gripper`, a jaw as three boxes, and two
jaws with published figures.
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
    """Hands that touch the points (m, object frame) of pad 0 and pad 1.

    Of `approach`, the direction out of the palm, only the part normal to the closing direction
    counts.

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

    Points and approach, and errors, as for `hand_frames_from_points`; normals are unit vectors into
    the object.
    """
    frames = hand_frames_from_points(points, approach)
    wxyz = Rotation.from_matrix(frames.axes).as_quat(scalar_first=True)
    return Grasp(
        T_obj_hand=jaxlie.SE3(jnp.asarray(np.concatenate([wxyz, frames.origin], axis=1))),
        width=jnp.asarray(frames.width),
        contacts=Contacts(jnp.asarray(points), jnp.asarray(normals)),
    )


@dataclasses.dataclass(frozen=True)
class Gripper:
    """A parallel jaw; lengths in m.

    Raises:
      ValueError: a length, or a force, that no gripper can have.
    """

    name: str  # for messages
    closed_width: float  # between the pads when closed
    open_width: float  # between the pads when open
    finger_length: float  # from the palm to the finger tips
    finger_width: float  # across the fingers (x of the hand frame)
    finger_thickness: float  # along the closing direction (y)
    pad_to_tip: float  # from the middle of the pads to the finger tips (z)
    # of the palm along x, y and z; it ends where the fingers begin
    palm_size: tuple[float, float, float]
    force_limit: float  # that the jaw can squeeze with, N
    note: str = ""  # where the figures come from

    def __post_init__(self) -> None:
        """Checks the figures."""
        sizes = {
            "finger_length": self.finger_length,
            "finger_width": self.finger_width,
            "finger_thickness": self.finger_thickness,
            "force_limit": self.force_limit,
            "palm_size": min(self.palm_size),
        }
        for field, value in sizes.items():
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{self.name}: `{field}` {value} is not positive")
        if not 0.0 <= self.closed_width < self.open_width < np.inf:
            raise ValueError(
                f"{self.name}: `closed_width` {self.closed_width} m and `open_width` "
                f"{self.open_width} m; expected 0 <= closed_width < open_width"
            )
        if not 0.0 <= self.pad_to_tip < self.finger_length:
            raise ValueError(
                f"{self.name}: `pad_to_tip` {self.pad_to_tip} m is not within the finger of "
                f"{self.finger_length} m"
            )

    @property
    def half_extents(self) -> Float[ndarray, "3 3"]:
        """Of the boxes finger 0, finger 1 and palm (rows), m."""
        finger = [self.finger_width, self.finger_thickness, self.finger_length]
        return 0.5 * np.array([finger, finger, self.palm_size])

    def box_centers(self, opening: Float[ndarray, " n"]) -> Float[ndarray, "n 3 3"]:
        """Centres of the three boxes in the hand frame, m, for openings between the pads (m)."""
        centers = np.zeros((len(opening), 3, 3))
        aside = 0.5 * (opening + self.finger_thickness)
        centers[:, 0, 1], centers[:, 1, 1] = -aside, aside
        centers[:, :2, 2] = self.pad_to_tip - 0.5 * self.finger_length
        centers[:, 2, 2] = self.pad_to_tip - self.finger_length - 0.5 * self.palm_size[2]
        return centers


BAXTER_GRIPPER = Gripper(
    name="Baxter's electric gripper",
    closed_width=0.0,
    open_width=2 * 0.020833,
    finger_length=0.1127,
    finger_width=0.0135,
    finger_thickness=0.010,
    pad_to_tip=0.015,
    palm_size=(0.06, 0.14, 0.05),
    force_limit=35.0,
    note="Extended narrow fingers: stroke and finger box as in Rethink's rethink_ee_description; "
    "each further slot adds 0.019 m to both widths (dataclasses.replace). The palm's box, "
    "pad_to_tip and the force are estimates.",
)

PARALLEL_JAW_80MM = Gripper(
    name="parallel jaw of 80 mm",
    closed_width=0.0,
    open_width=0.08,
    finger_length=0.0538,
    finger_width=0.021,
    finger_thickness=0.015,
    pad_to_tip=0.0088,
    palm_size=(0.063, 0.204, 0.066),
    force_limit=70.0,
    note="Much like the Franka Hand: stroke, continuous force and the heights of palm, tool centre "
    "and finger tips are those of its model; the boxes are drawn around it.",
)
