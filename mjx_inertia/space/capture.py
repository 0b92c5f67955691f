"""The object that both hands of a free-floating robot hold.

In: a `robots.Robot` with two hands on a free base. Out: `Capture`, the robot with the object's
inertia, where each hand has the object, wrenches turned into the object's axes.
"""

from flax import struct

from mjx_inertia.robots import Robot, with_payload
from mjx_inertia.robots.links import Frame, compose_frames, frame_of
from mjx_inertia.robots.recursions import hand_frame
from mjx_inertia.spatial import InertialParameters, Pose

MOMENTA = ("system", "robot")


@struct.dataclass
class Capture:
    """An object that both hands hold."""

    inertial: InertialParameters  # of the object, in its frame
    T_hand_obj: Pose  # two poses: the object in each hand
    # of a ball around it, m, for clearance
    radius: float = struct.field(pytree_node=False, default=0.4)


def with_capture(robot: Robot, capture: Capture, momentum: str = "system") -> Robot:
    """The robot whose momentum counts: with the object fixed to its first hand, or alone.

    Args:
      robot: the robot.
      capture: the object.
      momentum: "system": with the object; "robot": alone, as in thesis Eqs 7.2 to 7.8.

    Raises:
      ValueError: another `momentum`.
    """
    check_momentum(momentum)
    if momentum == "robot":
        return robot
    return with_payload(robot, capture.inertial, capture.T_hand_obj[0])


def check_momentum(momentum: str) -> None:
    """Raises ValueError for a model of momentum that there is not."""
    if momentum not in MOMENTA:
        raise ValueError(f"`momentum` is {momentum!r}: expected {' or '.join(MOMENTA)}")


def held_frames(robot: Robot, capture: Capture, links: list[Frame]) -> list[Frame]:
    """The object in the base as each hand has it."""
    return [
        compose_frames(hand_frame(robot, links, k), frame_of(capture.T_hand_obj[k]))
        for k in range(len(robot.hands))
    ]
