"""What identification estimates and believes beforehand; unknowns ⇄ coordinates ⇄ parameters.

A coordinate counts in standard deviations of its belief, of the logarithm where a value is
positive, so that every point of the search is a physical body (mass and I_zz positive, I_zz / m and
the CoM free of each other: the planar log-Cholesky form). In: coordinates. Out: `PushParameters`
and the `SensorErrors`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.dataset import SensorNoise
from mjx_inertia.pushing import PushParameters, PushSetup, SceneSettings
from mjx_inertia.spatial import AnyArray, planar_rotate

ESTIMATED = (
    "mass", "inertia", "com_x", "com_y", "friction", "tip_friction", "tip_time_constant",
)  # fmt: skip
# Columns of an observation that each channel takes.
CHANNELS = {
    "force": (0, 1),
    "moment": (2,),
    "velocity": (3, 4),
    "spin": (5,),
    "position": (6, 7),
    "yaw": (8,),
}
LOGARITHMIC = frozenset(
    ("mass", "inertia", "friction", "tip_friction", "tip_time_constant", "friction_radius")
)
_DRAWN = 0.3  # spread of further starts, in standard deviations of the belief
_WALL = 0.02  # width of the wall at a bound, in the unit of the coordinate


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


@struct.dataclass
class SensorErrors:
    """What the sensors add: mass of the probe (kg), force bias (N), delay of the force (s)."""

    probe_mass: Float[AnyArray, ""]
    force_bias: Float[AnyArray, "2"]
    force_delay: Float[AnyArray, ""]
    pose_error: Float[AnyArray, "3"]


def to_value(name: str, coordinate: Float[AnyArray, "*n"], beliefs: Beliefs) -> Float[Array, "*n"]:
    """Value of an unknown at a coordinate."""
    belief = getattr(beliefs, name)
    if name in LOGARITHMIC:
        return belief.center * jnp.exp(belief.spread * jnp.asarray(coordinate))
    return belief.center + belief.spread * jnp.asarray(coordinate)


def to_coordinate(name: str, value: Float[AnyArray, "*n"], beliefs: Beliefs) -> Float[Array, "*n"]:
    """Coordinate of a value, which is taken into the bounds first."""
    belief = getattr(beliefs, name)
    value = jnp.clip(jnp.asarray(value), belief.low, belief.high)
    if name in LOGARITHMIC:
        return jnp.log(value / belief.center) / belief.spread
    return (value - belief.center) / belief.spread


def to_coordinates(
    values: Mapping[str, Float[AnyArray, "*n"] | float], settings: SysidSettings
) -> Float[Array, "*n p"]:
    """Coordinates of the estimated unknowns, given by name."""
    columns = [
        to_coordinate(name, jnp.asarray(values[name]), settings.beliefs)
        for name in settings.estimated
    ]
    return jnp.stack(columns, -1)


def bounds(settings: SysidSettings) -> tuple[Float[Array, " p"], Float[Array, " p"]]:
    """Lowest and highest coordinate of each estimated unknown."""
    names, beliefs = settings.estimated, settings.beliefs
    low = [to_coordinate(n, np.asarray(getattr(beliefs, n).low), beliefs) for n in names]
    high = [to_coordinate(n, np.asarray(getattr(beliefs, n).high), beliefs) for n in names]
    return jnp.stack(low), jnp.stack(high)


def beyond_bounds(z: Float[AnyArray, " p"], settings: SysidSettings) -> Float[Array, " p"]:
    """Residual of the walls: zero inside the bounds, one at a wall's width beyond."""
    low, high = bounds(settings)
    return (jnp.minimum(z - low, 0.0) + jnp.maximum(z - high, 0.0)) / _WALL


def values(z: Float[AnyArray, " p"], settings: SysidSettings) -> dict[str, Float[Array, ""]]:
    """Every unknown by name: its value at `z` if it is estimated, else the centre of its belief."""
    at = dict(zip(settings.estimated, z, strict=True))
    zero = jnp.zeros((), z.dtype)
    return {
        name: to_value(name, at.get(name, zero), settings.beliefs)
        for name in Beliefs.__dataclass_fields__
    }


def to_parameters(
    z: Float[AnyArray, " p"],
    setup: PushSetup,
    centroid: Float[AnyArray, "2"],
    settings: SysidSettings,
) -> tuple[PushParameters, SensorErrors]:
    """What to simulate at a point of the search.

    `centroid` is that of the outline, object frame, m.
    """
    v = values(z, settings)
    half = jnp.asarray(setup.half_extents)
    plate = v["mass"] * (half[0] ** 2 + half[1] ** 2) / 3.0
    inertia = plate * v["inertia"]
    # the two other moments and the height of the CoM matter in `corners` only: those of a box
    across = v["mass"] * (half[:2] ** 2 + half[2] ** 2) / 3.0
    com = centroid + half[:2] * jnp.stack([v["com_x"], v["com_y"]])
    parameters = PushParameters(
        mass=v["mass"],
        inertia=jnp.stack([across[1], across[0], inertia]),
        com=jnp.append(com, half[2]),
        half_extents=half,
        friction=v["friction"],
        friction_radius=setup.friction_radius * v["friction_radius"],
        tip_friction=v["tip_friction"],
        tip_time_constant=v["tip_time_constant"],
        polygons=setup.polygons,
    )
    instrument = SensorErrors(
        probe_mass=v["probe_mass"],
        force_bias=jnp.stack([v["force_bias_x"], v["force_bias_y"]]),
        force_delay=v["force_delay"],
        pose_error=jnp.stack([v["pose_x"], v["pose_y"], v["pose_yaw"]]),
    )
    return parameters, instrument


def planar_values(
    z: Float[AnyArray, " p"],
    setup: PushSetup,
    centroid: Float[AnyArray, "2"],
    contact_point: Float[AnyArray, "2"],
    contact_normal: Float[AnyArray, "2"],
    settings: SysidSettings,
) -> Float[Array, "4"]:
    """Mass, I_zz and the CoM from the first contact point, as an `Estimate` states them, SI."""
    parameters, _ = to_parameters(z, setup, centroid, settings)
    offset = planar_rotate(jnp.asarray(setup.pose)[2], parameters.com[:2])
    arm = jnp.asarray(setup.pose[:2]) + offset - contact_point
    inward, left = contact_normal, jnp.stack([-contact_normal[1], contact_normal[0]])
    return jnp.stack([parameters.mass, parameters.inertia[2], arm @ inward, arm @ left])


def from_planar_values(
    mean: Float[AnyArray, "4"],
    z: Float[AnyArray, " p"],
    setup: PushSetup,
    centroid: Float[AnyArray, "2"],
    contact_point: Float[AnyArray, "2"],
    contact_normal: Float[AnyArray, "2"],
    settings: SysidSettings,
) -> Float[Array, " p"]:
    """Coordinates of another estimator's answer; unknowns that it does not give stay as in `z`."""
    half = jnp.asarray(setup.half_extents)
    left = jnp.stack([-contact_normal[1], contact_normal[0]])
    offset = contact_point + mean[2] * contact_normal + mean[3] * left - setup.pose[:2]
    com = planar_rotate(-jnp.asarray(setup.pose)[2], offset)
    com = jnp.clip((com - centroid) / half[:2], -0.9, 0.9)
    known = {
        "mass": mean[0],
        "inertia": mean[1] / (mean[0] * (half[0] ** 2 + half[1] ** 2) / 3.0),
        "com_x": com[0],
        "com_y": com[1],
    }
    at = dict(zip(settings.estimated, z, strict=True))
    for name, value in known.items():
        if name in at:
            at[name] = to_coordinate(name, value, settings.beliefs)
    return jnp.where(jnp.isfinite(mean).all(), jnp.stack(list(at.values())), z)


def random_restart(
    key: jax.Array, around: Float[AnyArray, " p"], settings: SysidSettings
) -> Float[Array, " p"]:
    """Another start near a given one, within the bounds."""
    low, high = bounds(settings)
    error = _DRAWN * jax.random.normal(key, low.shape, low.dtype)
    return jnp.clip(jnp.asarray(around) + error, low, high)
