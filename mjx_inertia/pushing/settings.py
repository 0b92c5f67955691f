"""Settings of the simulated experiment, every number with its unit and its reason."""

import math
from dataclasses import dataclass
from typing import Literal

Table = Literal["limit_surface", "corners", "pads"]

GRAVITY = 9.81  # m/s²

# A floor contact whose impedance starts at 0 does not chatter: with MuJoCo's default
# (0.9 0.95 0.001) the steady force of a push varies by 20 % of its mean, with this one by 0.2 %.
FLOOR_SOLIMP = (0.0, 0.95, 0.002, 0.5, 2.0)
FLOOR_SOLREF = (0.02, 1.0)
# Friction is regularised: below a slip speed of (1 - d)/d μ g / (b impratio) it is viscous. With
# MuJoCo's 1 that is 17 mm/s at μ = 0.6, so a push at 10 mm/s meets 0.6 of Coulomb's force; with 30
# it meets all of it, as does every speed of the data (tested).
IMPRATIO = 30.0
# A convex cone lifts what slips: friction's damping b would hold a tip that slides along the face
# at μ b v / k from it, the contact opens and the force falls to nothing for single samples (in 28 %
# of the pushes with the contact's own b). Slow friction damping closes the gap; IMPRATIO keeps the
# friction of the tip hard.
TIP_SOLREF_FRICTION = (0.3, 1.0)
# The tip's contact is stiff from the first touch: an impedance that starts at 0 lets the tip sink
# in for 30 ms before any force is felt, and then strikes.
TIP_SOLIMP = (0.9, 0.95, 0.001, 0.5, 2.0)
# The tip is driven, not pushed: C MuJoCo needs a huge mass for that (1e4 kg slows down visibly in a
# 15 s push); our own step treats its velocity as given. It must be mass and not armature: MuJoCo
# scales contact stiffness by the bodies' masses, and a light tip would sink centimetres in.
TIP_MASS = 1e6  # kg
# The tip starts a hair's breadth off the face, so that rounding does not decide in which step it
# touches.
CLEARANCE = 1e-5  # m
MAX_TIMESTEP = 0.005  # s; end poses equal those of 1 ms to 1 mm and 0.5 degrees (tested)
FASTEST_RATE = 1e4  # Hz; no force sensor samples faster
MOST_SUBSTEPS = 1000  # of a sample: 10 s of push then take a million steps
SOLVER_ITERATIONS = 50  # at most; one does in sustained contact, the first touch takes up to ten
LINE_SEARCH = 20  # at most; nearly always the first will do


@dataclass(frozen=True)
class SceneSettings:
    """What a scene is built from, beside the object."""

    # `limit_surface` (one contact under the CoM, whose torsional friction makes the ellipsoidal
    # limit surface of thesis Eq. 3.7), `corners` (MuJoCo's own contacts of the base with a plane,
    # full 3-D motion) or `pads` (a grid of equally loaded feet: uniform pressure)
    table: Table = "limit_surface"
    rate: float = 100.0  # samples a second, Hz
    # of the simulation, s; the step used is the longest that divides a sample
    max_timestep: float = MAX_TIMESTEP
    tip_radius: float = 0.005  # of the spherical pusher, m
    # of its centre above the table, m; limited to half the object's height
    tip_height: float = 0.02
    pads: int = 4  # feet along each side (table `pads`)
    solver_iterations: int = SOLVER_ITERATIONS  # Newton steps a time step, at most
    line_search: int = LINE_SEARCH  # evaluations along each Newton step, at most

    def __post_init__(self) -> None:
        """Raises ValueError for settings that make no experiment."""
        if self.table not in ("limit_surface", "corners", "pads"):
            raise ValueError(f"table={self.table!r}: choose 'limit_surface', 'corners' or 'pads'")
        for name in ("rate", "max_timestep", "tip_radius", "tip_height"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name}={getattr(self, name)}: must be positive")
        if self.rate > FASTEST_RATE:
            raise ValueError(f"rate={self.rate}: at most {FASTEST_RATE:g} Hz")
        for name in ("pads", "solver_iterations", "line_search"):
            value = getattr(self, name)
            if not (type(value) is int and value >= 1):
                raise ValueError(f"{name}={value}: must be a whole number, at least 1")
        if self.substeps > MOST_SUBSTEPS:
            raise ValueError(
                f"rate={self.rate} and max_timestep={self.max_timestep}: {self.substeps} time "
                f"steps a sample; at most {MOST_SUBSTEPS}"
            )

    @property
    def substeps(self) -> int:
        """Simulation steps a sample."""
        return max(1, math.ceil(round(1.0 / (self.rate * self.max_timestep), 6)))

    @property
    def timestep(self) -> float:
        """Simulation step, s."""
        return 1.0 / (self.rate * self.substeps)
