"""The manoeuvres that the figures show: the planar robot's, and one in three dimensions.

In: settings. Out: `Manoeuvre`. The thesis does not give poses (errata 29). Those of the planar
robot were chosen so that the straight quintic turns the base visibly, and that the coefficients can
undo the turn.
"""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_inertia.space.arms_on_base import (
    SERVICER_LEADING,
    SERVICER_READY,
    servicer,
    servicer_capture,
)
from mjx_inertia.space.manoeuvre import Manoeuvre
from mjx_inertia.space.manoeuvre_planning import ManoeuvreSettings, plan_manoeuvre
from mjx_inertia.space.planar_model import PlanarSettings, planar_capture, planar_robot
from mjx_inertia.spatial import Pose

START = (0.0, 2.2, 0.0)  # of the object: x, y (m) and angle (rad) in the base
TARGET = (-0.4, 2.4, -0.3)
ELBOWS = (1.45, 1.72, 1.3, 1.45, 1.72, 1.3)  # rad: joints near the start, elbows outward

SERVICER_START = (1.2, 0.0, 0.0)  # m, of the object in front of the servicer
SERVICER_TARGET = (1.23, 0.07, -0.205)
SERVICER_TURN = (0.15, 0.4, -0.07)  # rotation vector of the object at its target, rad

AS_PRINTED = ManoeuvreSettings(motion="independent", momentum="robot")


def planar_manoeuvre(
    settings: ManoeuvreSettings | None = None,
    robot: PlanarSettings | None = None,
    start: tuple[float, float, float] = START,
    target: tuple[float, float, float] = TARGET,
) -> Manoeuvre:
    """The planar robot's manoeuvre.

    Args:
      settings: of the model; `AS_PRINTED` is the thesis'.
      robot: figures of robot and object.
      start: of the object, x, y (m) and angle (rad), in the base as it starts.
      target: of the object in the same frame, which is the world's.

    Raises:
      ValueError: as `plan_manoeuvre`.
    """
    return plan_manoeuvre(
        planar_robot(robot),
        planar_capture(robot),
        planar_pose(*start),
        planar_pose(*target),
        settings,
        guess=np.array(ELBOWS),
    )


def planar_pose(x: float, y: float, angle: float) -> Pose:
    """A pose in the plane z = 0: m, rad."""
    c, s = np.cos(angle), np.sin(angle)
    return Pose(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([x, y, 0.0]))


def servicer_manoeuvre(settings: ManoeuvreSettings | None = None) -> Manoeuvre:
    """The servicer turns and moves its object: 0.22 m and 25 degrees in 20 s.

    Args:
      settings: of the model; by default 20 s, joints that obey the grasp, momentum of the system.

    Raises:
      ValueError: as `plan_manoeuvre`.
    """
    s = settings or ManoeuvreSettings(duration=20.0)
    if s.motion == "consistent" and s.leading is None:
        s = dataclasses.replace(s, leading=SERVICER_LEADING)
    return plan_manoeuvre(
        servicer(),
        servicer_capture(),
        Pose(np.eye(3), np.array(SERVICER_START)),
        Pose(Rotation.from_rotvec(SERVICER_TURN).as_matrix(), np.array(SERVICER_TARGET)),
        s,
        guess=SERVICER_READY,
    )
