"""What identification estimates, what it takes as known, and what it believes beforehand."""

from dataclasses import dataclass, field

from mjx_inertia.dataset import SensorNoise
from mjx_inertia.pushing import SceneSettings

ESTIMATED = (
    "mass", "inertia", "com_x", "com_y", "friction", "tip_friction", "tip_time_constant",
)  # fmt: skip


@dataclass(frozen=True)
class Belief:
    """A normal prior of one unknown in its coordinate, and bounds of its value.

    Attributes:
      center: value at the middle of the prior.
      spread: standard deviation of the coordinate: relative where it is a logarithm.
      low: bound of the value; beyond it a steep wall stands in the cost.
      high: the other bound.
    """

    center: float
    spread: float
    low: float
    high: float


@dataclass(frozen=True)
class Beliefs:
    """A prior for each unknown; wide, so that it matters only where the data are weak.

    Lengths of the object count from the centre of its outline in units of its half extents, I_zz in
    units of that of a uniform plate of its bounding box and mass.

    Attributes:
      mass: kg, as a logarithm.
      inertia: I_zz over m (a² + b²) / 12 with a, b the sides of the bounding box, as a logarithm.
      com_x: object frame, half extents.
      com_y: object frame, half extents.
      friction: μ between object and table, as a logarithm.
      tip_friction: between tip and object, as a logarithm.
      tip_time_constant: of their contact, s, as a logarithm.
      friction_radius: c over the one of the outline under uniform pressure, as a logarithm.
      probe_mass: that the force sensor carries, kg.
      force_bias_x: of the sensor, N, world.
      force_bias_y: of the sensor, N, world.
      force_delay: of the force behind the motion, s.
      pose_x: error of the known initial pose, m.
      pose_y: error of the known initial pose, m.
      pose_yaw: error of the known initial pose, rad.
    """

    mass: Belief = Belief(1.5, 1.0, 0.02, 50.0)
    inertia: Belief = Belief(1.0, 0.5, 0.05, 5.0)
    com_x: Belief = Belief(0.0, 0.5, -1.0, 1.0)
    com_y: Belief = Belief(0.0, 0.5, -1.0, 1.0)
    friction: Belief = Belief(0.35, 0.5, 0.02, 2.0)
    tip_friction: Belief = Belief(0.3, 0.5, 0.02, 2.0)
    tip_time_constant: Belief = Belief(0.02, 0.7, 0.0101, 0.2)
    friction_radius: Belief = Belief(1.0, 0.3, 0.2, 3.0)
    probe_mass: Belief = Belief(0.0, 0.5, -0.5, 5.0)
    force_bias_x: Belief = Belief(0.0, 0.5, -5.0, 5.0)
    force_bias_y: Belief = Belief(0.0, 0.5, -5.0, 5.0)
    force_delay: Belief = Belief(0.0, 0.01, -0.05, 0.05)
    pose_x: Belief = Belief(0.0, 0.001, -0.01, 0.01)
    pose_y: Belief = Belief(0.0, 0.001, -0.01, 0.01)
    pose_yaw: Belief = Belief(0.0, 0.01, -0.1, 0.1)


@dataclass(frozen=True)
class SysidSettings:
    """How a push is identified.

    Attributes:
      estimated: unknowns that the data decide; others are held at the centre of their belief.
      beliefs: priors and bounds.
      scene: table, time step and tip of the simulation.
      noise: of the sensors; the weights of the residuals.
      channels: signals that are fitted.
      huber: residual, in standard deviations, beyond which its cost grows linearly (0: squares).
      uniform_density: take I_zz and CoM from mass and outline: an assumption, so not the default.
      start_features: feature set of the trees whose estimate starts the search (None: the belief).
      draws: further starts, drawn near the first, for fits whose residuals are too large.
      coarse: seconds of the push that the first fit sees.
      iterations: of Levenberg and Marquardt's method, at most, in each of the two fits.
      block: pushes fitted at once on each device.
      misfit: limit of the mean squared residual, in standard deviations of the noise. A fit beyond
        it by more than five standard deviations of chance counts as stuck in a local minimum.
      progress: show a bar with the running cost.
      identifiable: largest relative standard deviation of mass with which an estimate is reported.
    """

    estimated: tuple[str, ...] = ESTIMATED
    beliefs: Beliefs = field(default_factory=Beliefs)
    scene: SceneSettings = field(default_factory=SceneSettings)
    noise: SensorNoise = field(default_factory=lambda: SensorNoise(0.05, 1.0))
    channels: tuple[str, ...] = ("force", "moment", "velocity", "spin", "position", "yaw")
    huber: float = 0.0
    uniform_density: bool = False
    start_features: str | None = "onset"
    draws: int = 3
    coarse: float = 0.6
    iterations: int = 20
    block: int = 32
    misfit: float = 1.05
    progress: bool = True
    identifiable: float = 0.3

    def __post_init__(self) -> None:
        """Raises ValueError for names that are no unknown or no channel."""
        if self.block < 1 or self.iterations < 1:
            raise ValueError(f"sysid.block={self.block}, iterations={self.iterations}: at least 1")
        known = tuple(Beliefs.__dataclass_fields__)
        for name in self.estimated:
            if name not in known:
                raise ValueError(f"sysid.estimated has {name!r}; choose from {known}")
        if len(set(self.estimated)) != len(self.estimated) or not self.estimated:
            raise ValueError(f"sysid.estimated={self.estimated}: name each unknown once")
        for name in self.channels:
            if name not in CHANNELS:
                raise ValueError(f"sysid.channels has {name!r}; choose from {tuple(CHANNELS)}")
        both = {"inertia", "com_x", "com_y"} & set(self.estimated)
        if self.uniform_density and both:
            raise ValueError(
                f"sysid.uniform_density fixes {sorted(both)}: leave them out of sysid.estimated"
            )
        for name in known:
            belief = getattr(self.beliefs, name)
            if not belief.low <= belief.center <= belief.high or not belief.spread > 0:
                raise ValueError(f"sysid.beliefs.{name}={belief}: needs low <= center <= high")


# Columns of an observation that each channel takes.
CHANNELS = {
    "force": (0, 1),
    "moment": (2,),
    "velocity": (3, 4),
    "spin": (5,),
    "position": (6, 7),
    "yaw": (8,),
}
