"""Parallel jaws as three boxes: two fingers and a palm.

Out: `Gripper`, and two of them with published figures.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from numpy import ndarray


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
    def stroke(self) -> float:
        """By how much the width can change, m."""
        return self.open_width - self.closed_width

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
