"""Pushes of objects of any shape: a random family to learn from, or objects of the catalogue.

In: `ShapesProtocol`. Out: a `PushPlan` whose parameters carry what the tip meets of each object, so
that one compiled scene serves all. Object frames have their origin at the centroid of the outline.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import jax
import numpy as np

from mjx_inertia.dataset.batch import PushConditions, PushTruth
from mjx_inertia.dataset.plan import (
    PushPlan,
    check_counts,
    check_intervals,
    check_path,
    check_positive,
    sort_by_duration,
)
from mjx_inertia.objects import (
    ObjectModel,
    RandomShapes,
    friction_radius,
    load_catalogue,
    planar_integrals,
    random_objects,
)
from mjx_inertia.pushing import (
    PushParameters,
    StraightMotion,
    first_contact,
    plan_polygons,
    stack_polygons,
)
from mjx_inertia.pushing.settings import CLEARANCE

_TRIES = 200  # draws of one push before an object counts as one that cannot be pushed so


@dataclass(frozen=True)
class ShapesProtocol:
    """Straight pushes of many shapes, each from a drawn side."""

    objects: int = 600  # of the random family; without effect if `names` are given
    shapes: RandomShapes = field(default_factory=RandomShapes)  # the random family
    # objects of the catalogue instead, as they are there, friction with the table included
    names: tuple[str, ...] = ()
    pushes_per_object: int = 8  # drawn for each
    # of the tip's line from the centroid, drawn up to this share of half the width that the object
    # shows to the tip
    offset: float = 0.6
    # angle between the tip's path and the inward normal where it first touches, degrees; what is
    # steeper is drawn anew
    steepest: float = 40.0
    speeds: tuple[float, ...] = (0.01, 0.02, 0.04, 0.06)  # m/s, shared out evenly
    length: float = 0.15  # of the tip's path, m
    approach: float = 0.0  # distance of the tip from the object at the start, m; 0 starts in touch
    acceleration: float = 0.0  # with which the tip starts, m/s²; 0 starts at full speed
    tip_friction: tuple[float, float] = (0.2, 0.5)  # drawn per push from this interval
    tip_time_constant: tuple[float, float] = (0.01, 0.04)  # s, drawn per push from this interval
    tip_radius: float = 0.005  # m

    def __post_init__(self) -> None:
        """Raises ValueError for pushes that cannot be."""
        check_counts(self, ("objects", "pushes_per_object"))
        check_positive(self, ("speeds", "length", "tip_time_constant", "tip_radius"))
        check_intervals(self, ("tip_friction", "tip_time_constant"))
        limits = {"offset": 1.0, "steepest": 90.0, "approach": 1.0, "acceleration": np.inf}
        for name, most in limits.items():
            if not 0.0 <= (value := getattr(self, name)) <= most or value == np.inf:
                raise ValueError(f"dataset.protocol.{name}={value}: expected 0 to {most:g}")
        check_path(self.length, self.speeds, self.acceleration)

    def models(self, seed: int) -> tuple[ObjectModel, ...]:
        """The objects."""
        if self.names:
            catalogue = load_catalogue(self.names)
            return tuple(catalogue[name] for name in self.names)
        return random_objects(self.objects, seed=seed, settings=self.shapes)


def shapes_plan(p: ShapesProtocol, seed: int, tip_height: float) -> PushPlan:
    """The pushes of a protocol.

    Args:
      p: the protocol.
      seed: of the family, the sides and the contact parameters.
      tip_height: of the tip above the table, m; at most half of the object's.

    Raises:
      ValueError: an object that cannot be touched as the protocol asks, by its name.
    """
    objects = p.models(seed)
    centers = [planar_integrals(obj.outline).centroid for obj in objects]
    polygons = [
        plan_polygons(obj, min(tip_height, obj.height / 2), p.tip_radius) - center
        for obj, center in zip(objects, centers, strict=True)
    ]
    parts = [
        _object_plan(i, obj, center, shape, p, np.random.default_rng([seed, i]))
        for i, (obj, center, shape) in enumerate(zip(objects, centers, polygons, strict=True))
    ]
    plan = jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)
    stacked = np.repeat(stack_polygons(polygons), p.pushes_per_object, axis=0)
    return sort_by_duration(plan.replace(parameters=plan.parameters.replace(polygons=stacked)))


def _object_plan(
    index: int,
    obj: ObjectModel,
    center: np.ndarray,
    polygons: np.ndarray,
    p: ShapesProtocol,
    rng: np.random.Generator,
) -> PushPlan:
    """Pushes of one object, without its polygons."""
    n = p.pushes_per_object
    drawn = zip(*(next(_contacts(obj.name, polygons, p, rng)) for _ in range(n)), strict=True)
    middle, point, normal, direction, offset = (np.array(values) for values in drawn)
    com = np.asarray(obj.inertial.com, float) - np.append(center, 0.0)
    inertia = np.asarray(obj.inertial.inertia, float)
    to_com = com[:2] - point
    left = np.stack([-normal[:, 1], normal[:, 0]], 1)
    arm = np.stack([(to_com * normal).sum(1), (to_com * left).sum(1)], 1)
    speed = rng.permutation(np.resize(p.speeds, n))
    ramp = speed / p.acceleration if p.acceleration else np.zeros(n)
    radius = float(friction_radius(obj.support, np.asarray(obj.inertial.com)[:2]))
    mass = float(obj.inertial.mass)
    return PushPlan(
        parameters=PushParameters(
            mass=np.full(n, mass),
            inertia=np.tile(np.diag(inertia), (n, 1)),
            com=np.tile(com, (n, 1)),
            half_extents=np.tile(obj.half_extents, (n, 1)),
            friction=np.full(n, obj.friction),
            friction_radius=np.full(n, radius),
            tip_friction=rng.uniform(*p.tip_friction, n),
            tip_time_constant=rng.uniform(*p.tip_time_constant, n),
        ),
        motion=StraightMotion(
            start=middle - max(p.approach, CLEARANCE) * direction,
            direction=direction,
            speed=speed,
            ramp=ramp,
            duration=ramp + (p.length - 0.5 * speed * ramp) / speed,
        ),
        contact_point=point,
        contact_normal=normal,
        truth=PushTruth(mass=np.full(n, mass), inertia=np.full(n, inertia[2, 2]), com=arm),
        conditions=PushConditions(
            object_id=np.full(n, index),
            friction=np.full(n, obj.friction),
            size=np.full(n, obj.mean_diameter),
            speed=speed,
            contact_offset=offset,
            angle=np.arctan2((direction * left).sum(1), (direction * normal).sum(1)),
        ),
        # what is known without the CoM and without a look at the underside
        outline_radius=np.full(n, float(friction_radius(obj.outline, center))),
    )


def _contacts(
    name: str, polygons: np.ndarray, p: ShapesProtocol, rng: np.random.Generator
) -> Iterator[Sequence[np.ndarray | float]]:
    """Draws of where and along which line the tip meets an object at its origin.

    Middle of the tip, point, normal, direction, and offset of the line over half the width.
    """
    corners = polygons.reshape(-1, 2)
    least = np.cos(np.radians(p.steepest))
    for _ in range(_TRIES):
        angle, offset = rng.uniform(-np.pi, np.pi), p.offset * rng.uniform(-1.0, 1.0)
        direction = np.array([np.cos(angle), np.sin(angle)])
        left = np.array([-direction[1], direction[0]])
        low, high = np.min(corners @ left), np.max(corners @ left)
        line = left * (0.5 * (low + high) + offset * 0.5 * (high - low))
        found = first_contact(polygons, line, direction, p.tip_radius)
        if found is not None and found[2] @ direction >= least:
            yield (*found, direction, offset)
    raise ValueError(
        f"{name}: no side of it that a path of at most {p.steepest} degrees from the normal meets; "
        "allow a larger dataset.protocol.steepest"
    )
