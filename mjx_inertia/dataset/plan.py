"""Which pushes to simulate: the protocols of the thesis, every range a setting.

In: `CubesProtocol` (the 48,000 pushes of §3.6.1, whole or thinned) or `Cubes30Protocol` (the 30
cubes of §3.3.2). Out: a `PushPlan`: parameters, motions, truth and conditions of every push.
"""

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from flax import struct
from jaxtyping import Float

from mjx_inertia.dataset.batch import PushConditions, PushTruth
from mjx_inertia.pushing import PushParameters, PushSetup, StraightMotion
from mjx_inertia.pushing.push_checks import LONGEST_PUSH
from mjx_inertia.pushing.settings import CLEARANCE
from mjx_inertia.spatial import AnyArray

# Torsional over sliding friction of a uniformly loaded square of edge 1 (errata 5).
SQUARE_FRICTION_RADIUS = 0.38259786


@struct.dataclass
class PushPlan:
    """Everything that decides a set of pushes, with one leading axis, ordered by duration.

    `outline_radius` is c (m) as the outline alone gives it, where the simulated one is another.
    """

    parameters: PushParameters
    motion: StraightMotion
    contact_point: Float[AnyArray, "n 2"]
    contact_normal: Float[AnyArray, "n 2"]
    truth: PushTruth
    conditions: PushConditions
    outline_radius: Float[AnyArray, " n"] | None = None

    def __len__(self) -> int:
        """Number of pushes."""
        return len(self.truth.mass)


@dataclass(frozen=True)
class Range:
    """`count` evenly spaced values from `low` to `high`."""

    low: float
    high: float
    count: int

    def __post_init__(self) -> None:
        """Raises ValueError for a range that has no values."""
        whole = type(self.count) is int and self.count >= 1
        if not (-np.inf < self.low <= self.high < np.inf and whole):
            raise ValueError(f"{self}: expected low ≤ high, both finite, and a count of 1 or more")

    def values(self) -> Float[np.ndarray, " count"]:
        """The values."""
        return np.linspace(self.low, self.high, self.count)


def check_positive(owner: Any, names: Iterable[str]) -> None:
    """Raises ValueError, naming the field, unless fields are positive and finite.

    Of a tuple every entry is, and there is one; of a `Range` its least value; None is left out.
    """
    for name in names:
        value = getattr(owner, name)
        numbers = value.low if isinstance(value, Range) else () if value is None else value
        known = value is None or np.size(numbers) > 0
        if not (known and all(0.0 < x < np.inf for x in np.ravel(numbers))):
            raise ValueError(f"dataset.protocol.{name}={value}: expected positive numbers")


def check_intervals(owner: Any, names: Iterable[str]) -> None:
    """Raises ValueError, naming the field, unless fields are (low, high), 0 ≤ low ≤ high."""
    for name in names:
        value = getattr(owner, name)
        if not (len(value) == 2 and 0.0 <= value[0] <= value[1] < np.inf):
            raise ValueError(f"dataset.protocol.{name}={value}: expected 0 ≤ low ≤ high")


def check_counts(owner: Any, names: Iterable[str]) -> None:
    """Raises ValueError, naming the field, unless fields are whole numbers above 0."""
    for name in names:
        value = getattr(owner, name)
        if not (type(value) is int and value >= 1):
            raise ValueError(f"dataset.protocol.{name}={value}: expected a positive whole number")


def check_path(length: float, speeds: Iterable[float], acceleration: float) -> None:
    """Raises ValueError unless the tip reaches each speed within the path, and ends in 600 s.

    Args:
      length: of the path, m.
      speeds: m/s.
      acceleration: of the run-up, m/s²; 0 for none.
    """
    for speed in speeds:
        run_up = speed**2 / (2.0 * acceleration) if acceleration else 0.0
        if run_up > length:
            raise ValueError(
                f"dataset.protocol.length={length}: the run-up to {speed} m/s at {acceleration} "
                f"m/s² takes {run_up:.3g} m; lengthen the path or accelerate faster"
            )
        if not length / speed < LONGEST_PUSH:
            raise ValueError(
                f"dataset.protocol.length={length}: takes {length / speed:.3g} s at {speed} m/s, "
                f"expected less than {LONGEST_PUSH:g} s"
            )


@dataclass(frozen=True)
class CubesProtocol:
    """Cubes of every mass, friction and size, pushed between every pair of points (errata 1)."""

    mass: Range = Range(0.5, 5.0, 20)  # kg
    friction: Range = Range(0.2, 0.6, 6)  # between cube and table
    edge: Range = Range(0.1, 0.2, 4)  # m
    points: int = 5  # along the pushed edge, evenly spaced inside it, both start and end of a push
    speeds: tuple[float, ...] = (0.01, 0.02, 0.04, 0.06)  # m/s
    length: float = 0.15  # of the tip's path, m
    # how many of the combinations of points and speed each cube gets (all of them if None), drawn
    # so that speeds are shared out evenly
    pushes_per_cube: int | None = None
    tip_friction: tuple[float, float] = (0.2, 0.5)  # drawn per push from this interval
    # of the contact, s, drawn per push from this interval
    tip_time_constant: tuple[float, float] = (0.01, 0.04)
    tip_radius: float = 0.005  # m

    def __post_init__(self) -> None:
        """Raises ValueError for pushes that cannot be."""
        given = () if self.pushes_per_cube is None else ("pushes_per_cube",)
        check_counts(self, ("points", *given))
        check_positive(self, ("mass", "friction", "edge", "speeds", "length"))
        check_positive(self, ("tip_time_constant", "tip_radius"))
        check_intervals(self, ("tip_friction", "tip_time_constant"))
        check_path(self.length, self.speeds, 0.0)


@dataclass(frozen=True)
class Cubes30Protocol:
    """The 30 cubes of Table 3.1, pushed at points spread over the edge after a run-up (§3.3.2)."""

    pushes_per_cube: int = 10  # points, evenly spaced in [-a/2, a/2] without its ends
    speed: float = 0.25  # reached before contact, m/s
    acceleration: float = 0.2  # of the run-up, m/s²
    approach: float = 0.2  # distance of the tip from the face at the start, m
    length: float = 0.5  # of the tip's path, m
    tip_friction: tuple[float, float] = (0.2, 0.5)  # drawn per push from this interval
    tip_time_constant: tuple[float, float] = (0.01, 0.04)  # s, drawn per push from this interval
    tip_radius: float = 0.005  # m
    # (mass kg, edge m, friction) of each; None for Table 3.1
    cubes: tuple[tuple[float, float, float], ...] | None = None

    def __post_init__(self) -> None:
        """Raises ValueError for pushes that cannot be."""
        check_counts(self, ("pushes_per_cube",))
        check_positive(self, ("speed", "acceleration", "length", "tip_radius"))
        check_positive(self, ("approach", "tip_time_constant", "cubes"))
        check_intervals(self, ("tip_friction", "tip_time_constant"))
        check_path(self.length, (self.speed,), self.acceleration)
        if unfit := [cube for cube in self.cubes or () if np.shape(cube) != (3,)]:
            raise ValueError(
                f"dataset.protocol.cubes has {unfit[0]}: expected mass, edge, friction"
            )


# Thesis Table 3.1: mass kg, edge m, friction. The inertia follows from mass and edge (errata 3).
TABLE_3_1 = (
    (0.147, 0.205, 0.46), (0.475, 0.236, 0.15), (0.81, 0.292, 0.57), (0.857, 0.268, 0.43),
    (0.24, 0.252, 0.22), (0.478, 0.221, 0.31), (0.52, 0.197, 0.24), (0.66, 0.3, 0.44),
    (0.62, 0.284, 0.37), (0.1, 0.189, 0.6), (0.336, 0.213, 0.26), (0.76, 0.173, 0.25),
    (0.43, 0.26, 0.4), (0.71, 0.244, 0.39), (0.384, 0.276, 0.32), (1.0, 0.15, 0.58),
    (0.952, 0.165, 0.42), (0.289, 0.181, 0.33), (0.194, 0.2289, 0.21), (0.9, 0.157, 0.2),
    (1.278, 0.15, 0.28), (1.444, 0.267, 0.54), (1.056, 0.283, 0.52), (1.222, 0.167, 0.53),
    (1.333, 0.2, 0.3), (1.167, 0.217, 0.35), (1.389, 0.233, 0.37), (1.5, 0.183, 0.49),
    (1.0, 0.25, 0.5), (1.111, 0.3, 0.56),
)  # fmt: skip


def _cube_plan(
    cube: np.ndarray,
    mass: np.ndarray,
    edge: np.ndarray,
    friction: np.ndarray,
    start: np.ndarray,
    motion: StraightMotion,
    contact: tuple[np.ndarray, np.ndarray],
) -> PushPlan:
    """A plan for cubes at the origin whose face x = -edge/2 is met at height `start` along y."""
    n, half = len(mass), edge / 2
    contact_point = np.stack([-half, start], 1)
    com = np.stack([np.zeros(n), np.zeros(n), half], 1)
    truth = PushTruth(mass=mass, inertia=mass * edge**2 / 6, com=com[:, :2] - contact_point)
    return PushPlan(
        parameters=PushParameters(
            mass=mass,
            inertia=np.tile(truth.inertia[:, None], (1, 3)),
            com=com,
            half_extents=np.tile(half[:, None], (1, 3)),
            friction=friction,
            friction_radius=SQUARE_FRICTION_RADIUS * edge,
            tip_friction=contact[0],
            tip_time_constant=contact[1],
        ),
        motion=motion,
        contact_point=contact_point,
        contact_normal=np.tile([1.0, 0.0], (n, 1)),
        truth=truth,
        conditions=PushConditions(
            object_id=cube,
            friction=friction,
            size=edge,
            speed=np.asarray(motion.speed),
            contact_offset=start / half,
            angle=np.arctan2(motion.direction[:, 1], motion.direction[:, 0]),
        ),
    )


def _combinations(p: CubesProtocol, rng: np.random.Generator) -> np.ndarray:
    """(n, 4) of cube, start point, end point, speed: all, or `pushes_per_cube` of each cube."""
    cubes = p.mass.count * p.friction.count * p.edge.count
    points, speeds = range(p.points), range(len(p.speeds))
    if p.pushes_per_cube is None:
        return np.array(list(itertools.product(range(cubes), points, points, speeds)))
    rows = []
    share, rest = divmod(p.pushes_per_cube, len(p.speeds))
    if p.pushes_per_cube > p.points**2 * len(p.speeds):
        raise ValueError(
            f"pushes_per_cube={p.pushes_per_cube}: there are only "
            f"{p.points**2 * len(p.speeds)} combinations of points and speed"
        )
    for cube in range(cubes):
        for s in speeds:
            count = share + ((s - cube * rest) % len(p.speeds) < rest)
            for pair in rng.permutation(p.points**2)[:count]:
                rows.append((cube, *divmod(int(pair), p.points), s))
    return np.array(rows)


def cubes_plan(p: CubesProtocol, seed: int) -> PushPlan:
    """The pushes of §3.6.1: 48,000 as the thesis sets them, or a thinned set over the same ranges.

    Raises:
      ValueError: for points so far apart that no path of this length joins them.
    """
    rng = np.random.default_rng(seed)
    cube, first, last, speed = _combinations(p, rng).T
    per_mass = p.friction.count * p.edge.count
    mass = p.mass.values()[cube // per_mass]
    friction = p.friction.values()[cube // p.edge.count % p.friction.count]
    edge = p.edge.values()[cube % p.edge.count]
    # inside the edge: an odd number of steps from one corner to the other
    fraction = (np.arange(p.points) - (p.points - 1) / 2) * 2 / (p.points + 1)
    start, end = fraction[first] * edge / 2, fraction[last] * edge / 2
    if np.abs(end - start).max() >= p.length:
        raise ValueError(
            f"length={p.length}: points {np.abs(end - start).max():.3f} m apart need a longer path"
        )
    across = (end - start) / p.length
    tip_x = -edge / 2 - p.tip_radius - CLEARANCE
    v = np.asarray(p.speeds)[speed]
    n = len(v)
    motion = StraightMotion(
        start=np.stack([tip_x, start], 1),
        direction=np.stack([np.sqrt(1 - across**2), across], 1),
        speed=v,
        ramp=np.zeros(n),
        duration=p.length / v,
    )
    contact = rng.uniform(*p.tip_friction, n), rng.uniform(*p.tip_time_constant, n)
    plan = _cube_plan(cube, mass, edge, friction, start, motion, contact)
    return sort_by_duration(plan)


def cubes30_plan(p: Cubes30Protocol, seed: int) -> PushPlan:
    """The pushes of §3.3.2 on the cubes of Table 3.1."""
    rng = np.random.default_rng(seed)
    table = np.asarray(p.cubes or TABLE_3_1)
    cube = np.repeat(np.arange(len(table)), p.pushes_per_cube)
    mass, edge, friction = table[cube].T
    fraction = (np.arange(p.pushes_per_cube) + 0.5) / p.pushes_per_cube * 2 - 1
    start = np.tile(fraction, len(table)) * edge / 2
    n = len(mass)
    ramp = p.speed / p.acceleration
    duration = ramp + (p.length - 0.5 * p.speed * ramp) / p.speed
    motion = StraightMotion(
        start=np.stack([-edge / 2 - p.tip_radius - p.approach, start], 1),
        direction=np.tile([1.0, 0.0], (n, 1)),
        speed=np.full(n, p.speed),
        ramp=np.full(n, ramp),
        duration=np.full(n, duration),
    )
    contact = rng.uniform(*p.tip_friction, n), rng.uniform(*p.tip_time_constant, n)
    return _cube_plan(cube, mass, edge, friction, start, motion, contact)


def select_pushes(plan: PushPlan, index: np.ndarray) -> PushPlan:
    """The pushes of `plan` at `index`."""
    return jax.tree.map(lambda x: np.asarray(x)[index], plan)


def known_setup(plan: PushPlan) -> PushSetup:
    """What the experimenter knows of planned pushes: the scene's outline, or one for each push."""
    n = len(plan)
    return PushSetup(
        motion=plan.motion,
        pose=np.zeros((n, 3)),
        half_extents=plan.parameters.half_extents,
        friction_radius=known
        if (known := plan.outline_radius) is not None
        else plan.parameters.friction_radius,
        shape=np.zeros(n, np.int32),
        polygons=plan.parameters.polygons,
    )


def sort_by_duration(plan: PushPlan) -> PushPlan:
    """The pushes from the shortest to the longest."""
    return select_pushes(plan, np.argsort(plan.motion.duration, kind="stable"))
