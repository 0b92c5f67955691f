"""Pushes of flat objects by a probe that bends: simulation spread widely enough to span reality.

In: `SlidersProtocol`, a range for everything that is not known of a real push. Out: `SliderPlan`:
a `PushPlan` of boxes, each of its own size, mass and friction, and the `Instrument` that reads each
push. The tip follows the swing of a mass on a spring that is drawn along at the commanded speed.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.dataset import PushConditions, PushPlan, PushTruth
from mjx_inertia.objects import friction_radius
from mjx_inertia.pushing import PushParameters, StraightMotion
from mjx_inertia.pushing.settings import CLEARANCE, GRAVITY
from mjx_inertia.spatial import AnyArray

Interval = tuple[float, float]
_HEIGHT = 0.1  # m; without effect on planar motion, and higher than the tip's centre


@dataclass(frozen=True)
class SlidersProtocol:
    """Intervals to draw from, evenly unless said; each push is one object of its own."""

    pushes: int = 12_000  # how many
    mass: Interval = (0.3, 6.0)  # kg, evenly in the logarithm, whatever the size
    edge: Interval = (0.06, 0.14)  # of the footprint, m, each of the two on its own
    # of the CoM from the middle, share of half the edge along each axis
    com_offset: Interval = (-0.15, 0.15)
    inertia_factor: Interval = (0.75, 1.25)  # on the I_zz of uniform density
    friction: Interval = (0.1, 0.5)  # between object and table
    radius_factor: Interval = (0.7, 1.3)  # on the friction radius under uniform pressure
    tip_friction: Interval = (0.1, 0.5)  # between tip and object
    tip_time_constant: Interval = (0.01, 0.03)  # of their contact, s; from two steps of 5 ms on
    # of the first contact from the middle of the face, share of half the face
    contact_offset: Interval = (-0.8, 0.8)
    angle: Interval = (-1.2, 1.2)  # of the push from the inward normal, rad
    speed: Interval = (0.01, 0.3)  # m/s, evenly in the logarithm
    acceleration: Interval = (0.5, 4.0)  # of the drive, m/s², evenly in the logarithm
    length: float = 0.05  # of the commanded path, m
    lead: float = 0.1  # at rest before the drive moves, s
    trail: float = 0.04  # at rest after it, s
    stiffness: Interval = (4e3, 16e3)  # of the probe, N/m, evenly in the logarithm
    damping: Interval = (0.03, 0.25)  # share of the critical one with which probe and object swing
    probe_mass: Interval = (0.0, 0.4)  # between sensor and object, kg
    # force at rest, N; at most 0.9 of what moves the object; for half of the pushes
    preload: Interval = (0.0, 4.0)
    gap: Interval = (0.0, 1e-3)  # between tip and object at rest, m; for the other half
    bias: Interval = (-0.3, 0.3)  # of the sensor along each axis, N
    gain: Interval = (0.97, 1.03)  # of the sensor
    lag: Interval = (-0.004, 0.004)  # of the force after the motion, s
    tip_radius: float = 0.00475  # m


@struct.dataclass
class Instrument:
    """What stands between a push and its record, as `SlidersProtocol` says, one a push."""

    stiffness: Float[AnyArray, " n"]  # N/m
    probe_mass: Float[AnyArray, " n"]  # kg
    preload: Float[AnyArray, " n"]  # N
    gap: Float[AnyArray, " n"]  # m
    bias: Float[AnyArray, "n 2"]  # N
    gain: Float[AnyArray, " n"]  # of the force
    lag: Float[AnyArray, " n"]  # s


@struct.dataclass
class SwingingMotion(StraightMotion):
    """A straight path on which the tip swings about the drive that draws it along.

    The drive rests for `lead`, reaches `speed` within `ramp`, goes on and stops as it began. The
    tip rests until the drive is `hold` ahead, and from then on e, by which the drive is further
    ahead than that, obeys e'' + 2 ζ ω e' + ω² e = d'' with d the way of the drive: a mass on a
    spring against Coulomb friction.
    """

    lead: Float[AnyArray, "*n"]  # s
    travel: Float[AnyArray, "*n"]  # time from the drive's start to its end, s
    hold: Float[AnyArray, "*n"]  # m
    frequency: Float[AnyArray, "*n"]  # ω, rad/s
    damping: Float[AnyArray, "*n"]  # ζ

    def driven(self, time: Float[AnyArray, "*n"]) -> Float[Array, "*n"]:
        """Way of the drive, m."""
        acceleration = jnp.asarray(self.speed) / self.ramp
        since = [jnp.maximum(time - self.lead - begin, 0.0) for begin in self._changes()]
        steps = [0.5 * sign * x**2 for sign, x in zip((1, -1, -1, 1), since, strict=True)]
        return acceleration * sum(steps, jnp.zeros(()))

    def way(self, time: Float[AnyArray, "*n"]) -> Float[Array, "*n"]:
        """Way of the tip, m."""
        held = self.held()
        moving = jnp.maximum(time - self.lead - held, 0.0)
        acceleration = jnp.asarray(self.speed) / self.ramp
        decay, turn = self.damping * self.frequency, self.frequency * jnp.sqrt(1 - self.damping**2)

        def impulse(t: Float[Array, "*n"]) -> Float[Array, "*n"]:
            return jnp.exp(-decay * t) * jnp.sin(turn * t) / turn

        def step(t: Float[Array, "*n"]) -> Float[Array, "*n"]:
            swing = jnp.cos(turn * t) + decay / turn * jnp.sin(turn * t)
            return (1.0 - jnp.exp(-decay * t) * swing) / self.frequency**2

        ahead = jnp.minimum(acceleration * held, self.speed) * impulse(moving)
        for sign, begin in zip((1, -1, -1, 1), self._changes(), strict=True):
            # A change of the drive's acceleration before the tip moves is in its speed by then.
            first = jnp.maximum(begin - held, 0.0)
            ahead += sign * acceleration * step(jnp.maximum(moving - first, 0.0))
        return jnp.where(moving > 0.0, self.driven(time) - self.hold - ahead, 0.0)

    def held(self) -> Float[Array, "*n"]:
        """How long after the drive the tip starts, s."""
        in_ramp = jnp.sqrt(2.0 * jnp.asarray(self.hold) * self.ramp / self.speed)
        return jnp.where(in_ramp < self.ramp, in_ramp, self.hold / self.speed + 0.5 * self.ramp)

    def velocity(self, time: Float[Array, ""], step: float) -> Float[Array, "2"]:
        """Mean velocity from `time` to `time + step`, m/s."""
        return jnp.asarray(self.direction) * (self.way(time + step) - self.way(time)) / step

    def _changes(self) -> tuple[Array, ...]:
        """Times after the drive's start at which its acceleration changes, s."""
        ramp, travel = jnp.asarray(self.ramp), jnp.asarray(self.travel)
        return jnp.zeros_like(ramp), ramp, travel - ramp, travel


@struct.dataclass
class SliderPlan:
    """Pushes and the instrument that reads each, with one leading axis, ordered by duration."""

    pushes: PushPlan
    instrument: Instrument


class _Draw:
    """Draws one value a push."""

    def __init__(self, seed: int, count: int) -> None:
        self.rng, self.count = np.random.default_rng(seed), count

    def even(self, interval: Interval, axes: int = 1) -> np.ndarray:
        drawn = self.rng.uniform(*interval, (self.count, axes))
        return drawn[:, 0] if axes == 1 else drawn

    def logarithmic(self, interval: Interval) -> np.ndarray:
        return np.exp(self.even((np.log(interval[0]), np.log(interval[1]))))


def sliders_plan(p: SlidersProtocol, seed: int) -> SliderPlan:
    """Draws boxes, pushes and instruments.

    Raises:
      ValueError: a path shorter than the probe bends before the object moves.
    """
    draw = _Draw(seed, p.pushes)
    parameters = _objects(p, draw)
    half, com = parameters.half_extents, np.asarray(parameters.com)[:, :2]
    offset, angle = draw.even(p.contact_offset), draw.even(p.angle)
    contact = np.stack([-half[:, 0], offset * half[:, 1]], 1)
    direction = np.stack([np.cos(angle), np.sin(angle)], 1)
    instrument, motion = _instrument(p, draw, parameters, contact, direction)
    n = p.pushes
    plan = PushPlan(
        parameters=parameters,
        motion=motion,
        contact_point=contact,
        contact_normal=np.tile([1.0, 0.0], (n, 1)),
        truth=PushTruth(
            mass=parameters.mass, inertia=np.asarray(parameters.inertia)[:, 2], com=com - contact
        ),
        conditions=PushConditions(
            object_id=np.arange(n),
            friction=parameters.friction,
            size=4.0 * np.sqrt(half[:, 0] * half[:, 1] / np.pi),
            speed=np.asarray(motion.speed),
            contact_offset=offset,
            angle=angle,
        ),
    )
    order = np.argsort(motion.duration, kind="stable")
    return jax.tree.map(lambda x: np.asarray(x)[order], SliderPlan(plan, instrument))


def _objects(p: SlidersProtocol, draw: _Draw) -> PushParameters:
    n = p.pushes
    mass, edges = draw.logarithmic(p.mass), draw.even(p.edge, 2)
    half = np.concatenate([0.5 * edges, np.full((n, 1), 0.5 * _HEIGHT)], 1)
    com = np.concatenate([draw.even(p.com_offset, 2) * half[:, :2], half[:, 2:]], 1)
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    uniform = [friction_radius(corners * h[:2], c[:2]) for h, c in zip(half, com, strict=True)]
    inertia = mass * (edges**2).sum(1) / 12.0 * draw.even(p.inertia_factor)
    return PushParameters(
        mass=mass,
        inertia=np.tile(inertia[:, None], (1, 3)),  # the planar table uses I_zz alone
        com=com,
        half_extents=half,
        friction=draw.even(p.friction),
        friction_radius=np.array(uniform) * draw.even(p.radius_factor),
        tip_friction=draw.even(p.tip_friction),
        tip_time_constant=draw.even(p.tip_time_constant),
    )


def _instrument(
    p: SlidersProtocol,
    draw: _Draw,
    of: PushParameters,
    contact: np.ndarray,
    direction: np.ndarray,
) -> tuple[Instrument, SwingingMotion]:
    """The probe, and how it swings with the object that it pushes."""
    n = p.pushes
    arm = contact - np.asarray(of.com)[:, :2]
    lever = arm[:, 0] * direction[:, 1] - arm[:, 1] * direction[:, 0]
    # Force that moves the object, on the ellipsoid; and what it moves (thesis Eq. 3.7).
    breakaway = of.friction * of.mass * GRAVITY / np.sqrt(1.0 + (lever / of.friction_radius) ** 2)
    moved = 1.0 / (1.0 / of.mass + lever**2 / np.asarray(of.inertia)[:, 2])
    touching = draw.rng.random(n) < 0.5
    preload = np.where(touching, np.minimum(draw.even(p.preload), 0.9 * breakaway), 0.0)
    instrument = Instrument(
        stiffness=draw.logarithmic(p.stiffness),
        probe_mass=draw.even(p.probe_mass),
        preload=preload,
        gap=np.where(touching, 0.0, draw.even(p.gap)),
        bias=draw.even(p.bias, 2),
        gain=draw.even(p.gain),
        lag=draw.even(p.lag),
    )
    speed = draw.logarithmic(p.speed)
    ramp = np.minimum(speed / draw.logarithmic(p.acceleration), p.length / speed)
    travel = p.length / speed + ramp
    hold = instrument.gap + (breakaway - preload) / instrument.stiffness
    if hold.max() >= p.length:
        raise ValueError(
            f"length={p.length} m: the probe bends by up to {hold.max():.3f} m before the object "
            "moves; choose a longer path or a stiffer probe"
        )
    motion = SwingingMotion(
        start=contact - [p.tip_radius + CLEARANCE, 0.0],
        direction=direction,
        speed=speed,
        ramp=ramp,
        duration=p.lead + travel + p.trail,
        lead=np.full(n, p.lead),
        travel=travel,
        hold=hold,
        frequency=np.sqrt(instrument.stiffness / (moved + instrument.probe_mass)),
        damping=draw.even(p.damping),
    )
    return instrument, motion
