"""Which push to make next: expected information of each candidate, and the best candidate.

Fisher information of pushes of one object adds up, because all unknowns are shared by its pushes:
body, table, and the contact with one and the same tip. In: the limits of a pusher, a belief (mean
and information). Out: candidate pushes, their expected information, and the choice; `search` with
`body` gives the estimate from all pushes made so far.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Float, Int

from mjx_inertia.estimators.sysid.normal_equations import equations_at
from mjx_inertia.estimators.sysid.observation import SysidProblem, observed
from mjx_inertia.estimators.sysid.unknowns import SysidSettings, bounds, to_parameters
from mjx_inertia.pushing import PushRecord, PushSetup, Scene, StraightMotion, simulate
from mjx_inertia.pushing.settings import CLEARANCE
from mjx_inertia.spatial import AnyArray

_SIMULATED = 256  # pushes at once: sets of every size share one compiled simulation
_TARGETS = ("mass", "inertia", "com_x", "com_y")
Criterion = Literal["A", "D"]


@dataclass(frozen=True)
class PusherLimits:
    """What the pusher can do; candidates are a grid over it."""

    speed: tuple[float, float] = (0.03, 0.2)  # lowest and highest, m/s
    acceleration: float = 2.0  # of the tip at the start, m/s²
    angle: float = math.radians(20.0)  # largest one between path and face normal, rad
    # farthest contact point from the middle of a face, half lengths of the face
    contact: float = 0.7
    length: float = 0.08  # of the path, m
    # of the box that can be reached: 0 is -x, 1 is -y, 2 is +x, 3 is +y (object frame)
    faces: tuple[int, ...] = (0, 1, 2, 3)

    def __post_init__(self) -> None:
        """Raises ValueError for limits within which there is no push."""
        if not 0 < self.speed[0] <= self.speed[1]:
            raise ValueError(f"speed={self.speed}: needs 0 < lowest <= highest")
        if not (self.acceleration > 0 and self.length > 0 and 0 <= self.contact < 1):
            raise ValueError(f"{self}: needs acceleration, length > 0 and 0 <= contact < 1")
        if not 0 <= self.angle < math.pi / 2 or not self.faces:
            raise ValueError(f"{self}: needs 0 <= angle < pi/2 and at least one face")
        if not set(self.faces) <= {0, 1, 2, 3}:
            raise ValueError(f"faces={self.faces}: choose out of 0, 1, 2, 3")


@struct.dataclass
class Pushes:
    """Pushes that could be made, with a leading axis."""

    setup: PushSetup  # what is known before each
    contact_point: Float[AnyArray, "n 2"]  # m, world
    contact_normal: Float[AnyArray, "n 2"]  # inward unit normal, world
    face: Int[AnyArray, " n"]  # number of the face
    offset: Float[AnyArray, " n"]  # see `Paths`
    angle: Float[AnyArray, " n"]  # see `Paths`

    def __len__(self) -> int:
        """Number of pushes."""
        return len(self.offset)


@struct.dataclass
class Paths:
    """How straight pushes go; fields are broadcast against each other, one axis n."""

    face: AnyArray | int  # see `PusherLimits`
    # of the contact point from the middle of the face, half lengths of it, to the left of the
    # inward normal
    offset: AnyArray | float
    angle: AnyArray | float  # from the inward normal to the path, counterclockwise, rad
    speed: AnyArray | float  # m/s
    acceleration: AnyArray | float  # from rest, m/s²; inf for full speed at once


def straight_pushes(
    half_extents: Float[AnyArray, "3"],
    friction_radius: float,
    paths: Paths,
    *,
    length: float,
    tip_radius: float = 0.005,
) -> Pushes:
    """Straight pushes of a box whose outline's centre is at the world's origin, axes parallel.

    `half_extents` are those of the box (m), `friction_radius` the c of its outline under uniform
    pressure (m); `length` is that of each path (m). At least one field of `paths` has an axis.
    """
    face, offset, angle, speed, acceleration = np.broadcast_arrays(
        paths.face, paths.offset, paths.angle, paths.speed, paths.acceleration
    )
    half, n = np.asarray(half_extents, float), len(face)
    along = face % 2  # the axis of the normal
    sign = np.where(face < 2, 1.0, -1.0)
    normal = sign[:, None] * np.eye(2)[along]
    tangent = np.stack([-normal[:, 1], normal[:, 0]], 1)
    point = -half[along][:, None] * normal + (offset * half[1 - along])[:, None] * tangent
    ramp = speed / acceleration
    run_up = 0.5 * speed * ramp
    duration = np.where(
        run_up > length,
        np.sqrt(2 * length / np.where(np.isinf(acceleration), 1.0, acceleration)),
        (length + run_up) / speed,
    )
    motion = StraightMotion(
        start=point - (tip_radius + CLEARANCE) * normal,
        direction=np.cos(angle)[:, None] * normal + np.sin(angle)[:, None] * tangent,
        speed=speed.astype(float),
        ramp=ramp,
        duration=duration,
    )
    setup = PushSetup(
        motion=motion,
        pose=np.zeros((n, 3)),
        half_extents=np.tile(half, (n, 1)),
        friction_radius=np.full(n, float(friction_radius)),
        shape=np.zeros(n, np.int32),
    )
    return Pushes(setup, point, normal, face.astype(np.int32), offset, angle)


def candidates(
    limits: PusherLimits,
    half_extents: Float[AnyArray, "3"],
    friction_radius: float,
    *,
    offsets: int = 3,
    angles: int = 2,
    speeds: int = 2,
    tip_radius: float = 0.005,
) -> Pushes:
    """A grid of pushes of a box within the limits: faces × offsets × angles × speeds.

    Contact points (`offsets`) and `angles` are evenly spaced, one angle being along the normal;
    logarithms of `speeds` are, one speed being the highest. The rest is as in `straight_pushes`.
    """

    def spread(count: int, most: float) -> np.ndarray:
        return np.linspace(-most, most, count) if count > 1 else np.zeros(1)

    low, high = limits.speed
    speed = np.geomspace(low, high, speeds) if speeds > 1 else np.array([high])
    grid = np.meshgrid(
        np.asarray(limits.faces, np.int32),
        spread(offsets, limits.contact),
        spread(angles, limits.angle),
        speed,
        indexing="ij",
    )
    face, offset, angle, speed = (g.ravel() for g in grid)
    paths = Paths(face, offset, angle, speed, limits.acceleration)
    return straight_pushes(
        half_extents, friction_radius, paths, length=limits.length, tip_radius=tip_radius
    )


def predicted(
    scene: Scene,
    z: Float[AnyArray, "n p"],
    pushes: Pushes,
    centroid: Float[AnyArray, "2"],
    settings: SysidSettings,
    *,
    samples: int,
) -> PushRecord:
    """What would be measured without noise if the unknowns were `z`.

    `z` are coordinates at each push, `centroid` is that of the outline (object frame, m). Records
    are padded to `samples`, their last one repeated, so that one compiled program serves every set
    of pushes.
    """
    with jax.enable_x64(True):
        to = jax.vmap(partial(to_parameters, centroid=jnp.asarray(centroid), settings=settings))
        parameters = jax.tree.map(np.asarray, to(jnp.asarray(z), setup=pushes.setup)[0])
        size, parts = _SIMULATED, []
        for first in range(0, len(pushes), size):
            rows = np.minimum(np.arange(first, first + size), len(pushes) - 1)
            some, of = jax.tree.map(lambda x: np.asarray(x)[rows], (pushes, parameters))  # noqa: B023
            record = simulate(
                scene, of, some.setup.motion, contact_point=some.contact_point,
                contact_normal=some.contact_normal, pose=some.setup.pose,
            )  # fmt: skip
            parts.append(_padded(record, min(size, len(pushes) - first), samples))
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def _padded(record: PushRecord, rows: int, samples: int) -> PushRecord:
    t = record.time.shape[1]
    if t > samples:
        raise ValueError(f"samples={samples}: a push has {t}; give at least as many")

    def longer(x: AnyArray) -> np.ndarray:
        x = np.asarray(x)[:rows]
        if x.ndim < 2 or x.shape[1] != t:
            return x
        return np.pad(x, ((0, 0), (0, samples - t), *[(0, 0)] * (x.ndim - 2)), mode="edge")

    signals = {k: longer(getattr(record, k)) for k in PushRecord.__dataclass_fields__}
    fixed = {k: np.asarray(getattr(record, k))[:rows] for k in ("contact_point", "contact_normal")}
    return PushRecord(**{**signals, **fixed})


def expected_information(
    scene: Scene,
    z: Float[AnyArray, "n p"],
    pushes: Pushes,
    centroid: Float[AnyArray, "2"],
    settings: SysidSettings,
    *,
    samples: int,
) -> Float[np.ndarray, "n p p"]:
    """Fisher information of the data of pushes that have not been made, if the unknowns were `z`.

    The information is zero for a push that loses contact or does not move the object, since such a
    push is not used. Arguments as in `predicted`; `z` is clipped to the bounds.
    """
    with jax.enable_x64(True):
        inside = np.clip(np.asarray(z, float), *(np.asarray(b) for b in bounds(settings)))
        record = predicted(scene, inside, pushes, centroid, settings, samples=samples)
        seen = observed(record, settings)
        problem = SysidProblem.of(scene, seen, pushes.setup, settings, centroid=centroid)
        found = equations_at(problem, inside)
    return np.asarray(found.hessian) - np.eye(inside.shape[1])


def target_slopes(
    settings: SysidSettings, scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
) -> Float[np.ndarray, "4 p"]:
    """Derivatives of log m, log I_zz and the CoM (half extents) by the coordinates, times `scale`.

    With the default a 1 % error of mass, of I_zz and of a half extent in the CoM weigh alike.
    """
    names, beliefs = settings.estimated, settings.beliefs
    slope = np.zeros((4, len(names)))
    for column, name in enumerate(names):
        if name in _TARGETS:
            slope[_TARGETS.index(name), column] = getattr(beliefs, name).spread
    slope[1] += slope[0]  # I_zz is m times a ratio
    return np.asarray(scale)[:, None] * slope


def uncertainty(
    information: Float[AnyArray, "*n p p"],
    targets: Float[AnyArray, "k p"],
    criterion: Criterion = "A",
) -> Float[np.ndarray, "*n"]:
    """Size of the targets' covariance S I⁻¹ Sᵀ: its trace (A) or log-determinant (D).

    The other unknowns are nuisance parameters: they are marginalised, and their own variance does
    not count (Pukelsheim 2006, Optimal Design of Experiments, ch. 3 and 6).
    """
    if criterion not in ("A", "D"):
        raise ValueError(f"criterion={criterion!r}: choose 'A' or 'D'")
    s = np.asarray(targets)
    covariance = s @ np.linalg.solve(
        np.asarray(information), np.broadcast_to(s.T, (*np.shape(information)[:-2], *s.T.shape))
    )
    if criterion == "A":
        return np.asarray(np.trace(covariance, axis1=-2, axis2=-1))
    return np.asarray(np.linalg.slogdet(covariance)[1])


def choose(
    known: Float[AnyArray, "p p"],
    information: Float[AnyArray, "*d n p p"],
    targets: Float[AnyArray, "k p"],
    criterion: Criterion = "A",
) -> tuple[int, Float[np.ndarray, " n"]]:
    """The candidate after which the targets are expected to be known best.

    Args:
      known: information so far, belief included (positive definite).
      information: that each of n candidates would add; with a leading axis at d draws of the
        belief, over which the uncertainty is averaged.
      targets: what is wanted, see `target_slopes`.
      criterion: see `uncertainty`.

    Returns:
      The number of the candidate, and the expected uncertainty after each.
    """
    scores = uncertainty(np.asarray(known) + np.asarray(information), targets, criterion)
    scores = scores.reshape(-1, scores.shape[-1]).mean(0)
    return int(np.argmin(scores)), scores
