"""What identification estimates, what it takes as known, and what it believes beforehand."""

from dataclasses import dataclass, field

from mjx_inertia.dataset import SensorNoise
from mjx_inertia.pushing import SceneSettings

ESTIMATED = (
    "mass", "inertia", "com_x", "com_y", "friction", "tip_friction", "tip_time_constant",
)  # fmt: skip


@dataclass(frozen=True)
class Belief:
    """A normal prior of one unknown in its coordinate, and bounds of its value."""

    center: float  # value at the middle of the prior
    spread: float  # standard deviation of the coordinate: relative where it is a logarithm
    low: float  # bound of the value; beyond it a steep wall stands in the cost
    high: float  # the other bound


@dataclass(frozen=True)
class Beliefs:
    """A prior for each unknown; wide, so that it matters only where the data are weak.

    Lengths of the object count from the centre of its outline in units of its half extents, I_zz in
    units of that of a uniform plate of its bounding box and mass.
    """

    mass: Belief = Belief(1.5, 1.0, 0.02, 50.0)  # kg, as a logarithm
    # I_zz over m (a² + b²) / 12 with a, b the sides of the bounding box, as a logarithm
    inertia: Belief = Belief(1.0, 0.5, 0.05, 5.0)
    com_x: Belief = Belief(0.0, 0.5, -1.0, 1.0)  # object frame, half extents
    com_y: Belief = Belief(0.0, 0.5, -1.0, 1.0)  # object frame, half extents
    friction: Belief = Belief(0.35, 0.5, 0.02, 2.0)  # μ between object and table, as a logarithm
    tip_friction: Belief = Belief(0.3, 0.5, 0.02, 2.0)  # between tip and object, as a logarithm
    # of their contact, s, as a logarithm
    tip_time_constant: Belief = Belief(0.02, 0.7, 0.0101, 0.2)
    # c over the one of the outline under uniform pressure, as a logarithm
    friction_radius: Belief = Belief(1.0, 0.3, 0.2, 3.0)
    probe_mass: Belief = Belief(0.0, 0.5, -0.5, 5.0)  # that the force sensor carries, kg
    force_bias_x: Belief = Belief(0.0, 0.5, -5.0, 5.0)  # of the sensor, N, world
    force_bias_y: Belief = Belief(0.0, 0.5, -5.0, 5.0)  # of the sensor, N, world
    force_delay: Belief = Belief(0.0, 0.01, -0.05, 0.05)  # of the force behind the motion, s
    pose_x: Belief = Belief(0.0, 0.001, -0.01, 0.01)  # error of the known initial pose, m
    pose_y: Belief = Belief(0.0, 0.001, -0.01, 0.01)  # error of the known initial pose, m
    pose_yaw: Belief = Belief(0.0, 0.01, -0.1, 0.1)  # error of the known initial pose, rad


@dataclass(frozen=True)
class SysidSettings:
    """How a push is identified."""

    # unknowns that the data decide; others are held at the centre of their belief
    estimated: tuple[str, ...] = ESTIMATED
    beliefs: Beliefs = field(default_factory=Beliefs)  # priors and bounds
    # table, time step and tip of the simulation
    scene: SceneSettings = field(default_factory=SceneSettings)
    # of the sensors; the weights of the residuals
    noise: SensorNoise = field(default_factory=lambda: SensorNoise(0.05, 1.0))
    # signals that are fitted
    channels: tuple[str, ...] = ("force", "moment", "velocity", "spin", "position", "yaw")
    # residual, in standard deviations, beyond which its cost grows linearly (0: squares)
    huber: float = 0.0
    # take I_zz and CoM from mass and outline: an assumption, so not the default
    uniform_density: bool = False
    # feature set of the trees whose estimate starts the search (None: the belief)
    start_features: str | None = "onset"
    draws: int = 3  # further starts, drawn near the first, for fits whose residuals are too large
    coarse: float = 0.6  # seconds of the push that the first fit sees
    iterations: int = 20  # of Levenberg and Marquardt's method, at most, in each of the two fits
    block: int = 32  # pushes fitted at once on each device
    # limit of the mean squared residual, in standard deviations of the noise. A fit beyond it by
    # more than five standard deviations of chance counts as stuck in a local minimum.
    misfit: float = 1.05
    progress: bool = True  # show a bar with the running cost
    # largest relative standard deviation of mass with which an estimate is reported
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
