"""Joint positions that bring the hand to a pose, and joint motions that carry it along a path.

In: a `Robot`, its hand's pose or path as a function of s. Out: joint positions, with derivatives
in s along a path. Redundancy is resolved by one criterion for each question: where to start, by the
distance from the joints' limits; along the path, by the least joint speed at every instant
(q' = Jᵀ (J Jᵀ)⁻¹ ξ), whose derivatives are exact. Written for one grasp.
"""

import dataclasses
import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int
from scipy.stats import qmc

from mjx_inertia.robots import Robot
from mjx_inertia.robots.links import Frame, joints_at, unstack
from mjx_inertia.robots.recursions import hand_frame, jacobian_columns, link_frames
from mjx_inertia.spatial import Pose
from mjx_inertia.spatial.small_cholesky import cholesky
from mjx_inertia.spatial.unrolled import (
    Component,
    Matrix,
    SymmetricMatrix,
    Vector,
    components,
    computed_once,
    minus,
    rotation_axis,
    stacked,
)

HandPath = Callable[[Int[Array, ""], Float[Array, ""]], tuple[Pose, Array, Array]]
_LENGTH = 0.1  # m that count as much as a radian in what is minimised and damped
_TINY = 1e-12  # keeps a singular configuration finite; its conditioning tells


@dataclasses.dataclass(frozen=True)
class ReachSettings:
    """How poses are reached."""

    starts: int = 8  # joint positions from which the search for the first pose sets out
    iterations: int = 30  # of each search for the first pose
    later_iterations: int = 10  # from there on, from each pose to the next; these are not damped
    damping: float = 1e-3  # of the search, relative to the size of J Jᵀ
    # share of the way to the middle of the limits that the redundant joints go in one iteration
    centring: float = 0.1
    position_tolerance: float = 1e-5  # m
    angle_tolerance: float = 1e-4  # rad
    # least conditioning √(det J Jᵀ), translations over 0.1 m, of a pose that counts as reached with
    # room to move
    singular: float = 1e-2


@struct.dataclass
class JointPath:
    """Joint positions at k waypoints and their derivatives in s."""

    q: Float[Array, "k n"]  # rad (m where prismatic)
    dq_ds: Float[Array, "k n"]
    d2q_ds2: Float[Array, "k n"]
    error: Float[Array, "k 2"]  # of the hand's pose, m and rad
    conditioning: Float[Array, " k"]  # √(det J Jᵀ), translations over 0.1 m


def reach(arm: Robot, stops: Pose, settings: ReachSettings) -> Float[Array, " n"]:
    """Joint positions at which the hand is at the first of some poses, or as near as was found.

    `stops` are poses T_world_hand with one leading axis: where the hand sets out, and where it must
    come to. Damped least squares from several starts, within the limits. The redundant joints move
    towards the middle of their ranges. Each solution is continued to the other poses by least joint
    displacement. Among the starts that reach every pose, the one farthest from the joint limits is
    taken. Starts are compared in single precision. The search from the best one is repeated in the
    precision of `stops`.
    """
    low, high = _finite_limits(arm)
    # centring stops before the end, so that the pose is met to the last digit
    count = settings.iterations
    shares = jnp.where(jnp.arange(count) < 0.8 * count, 1.0, 0.0)
    towards = functools.partial(_search, arm, settings=settings)

    single = jax.tree.map(lambda x: jax.lax.stop_gradient(x).astype(jnp.float32), stops)

    def score(q: Float[Array, " n"]) -> tuple[Float[Array, ""], Float[Array, " n"]]:
        def visit(q: Array, to: Pose) -> tuple[Array, Array]:
            return towards(q, to, jnp.zeros(settings.later_iterations))

        found, first = towards(q, jax.tree.map(lambda x: x[0], single), shares)
        _, later = jax.lax.scan(visit, found, jax.tree.map(lambda x: x[1:], single))
        return jnp.minimum(first, jnp.min(later, initial=jnp.inf)), found

    # starts spread over the joint ranges; the best one again in full precision
    sites = qmc.Halton(arm.dof, scramble=False).random(settings.starts + 1)[1:]
    starts = jnp.asarray(low + sites * (high - low), stops.translation.dtype)
    scores, found = jax.vmap(score)(starts.astype(jnp.float32))
    best = jnp.argmax(jnp.where(jnp.isfinite(scores), scores, -jnp.inf))
    stop = jax.tree.map(lambda x: x[0], stops)
    q, own = towards(starts[best], stop, shares)
    # a search that rounding sends elsewhere ends where the one in single precision did
    near = jnp.clip(jax.lax.stop_gradient(found[best]).astype(q.dtype), low, high)
    return jnp.where(own > -1.0, q, near)


def _search(
    arm: Robot,
    q: Float[Array, " n"],
    stop: Pose,
    shares: Float[Array, " i"],
    settings: ReachSettings,
) -> tuple[Float[Array, " n"], Float[Array, ""]]:
    """Where damped least squares end, and how far from the limits, as a share of the half range.

    `shares` says for each iteration how much damping and centring it has. An end that is not at
    the pose has a score below -1.
    """
    low, high = _finite_limits(arm)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    # floats, which have no precision of their own
    middles, ends = Vector(middle.tolist()), list(zip(low.tolist(), high.tolist(), strict=True))
    wanted = Frame(components(stop.rotation), components(stop.translation))

    def iteration(q: Vector, share: Array) -> tuple[Vector, None]:
        hand, jacobian = _hand(arm, q)
        away = computed_once(settings.centring * share * (middles - q))
        # what the way to the middle does to the hand is taken back with its error
        error = _scaled(pose_error(wanted, hand))
        left = computed_once(error - jacobian @ away)
        step = _least_squares(jacobian, left, settings.damping * share + _TINY)
        moved = q + away + step
        clipped = Vector(jnp.clip(x, *end) for x, end in zip(moved, ends, strict=True))
        return computed_once(clipped), None

    found, _ = jax.lax.scan(iteration, Vector(unstack(q)), shares.astype(q.dtype))
    error = _scaled(pose_error(wanted, _hand(arm, found)[0]))
    size = error @ error
    q = stacked(found, q.dtype)
    margin = jnp.min(1.0 - jnp.abs(q - middle.astype(q.dtype)) / half.astype(q.dtype))
    return q, jnp.where(size < settings.angle_tolerance**2, margin, -1.0 - size)


def follow_path(
    arm: Robot,
    q: Float[Array, " n"],
    hand: HandPath,
    move: Int[Array, " k"],
    s: Float[Array, " k"],
) -> JointPath:
    """Carries the hand along a path from joint positions `q`.

    Between waypoints, each at s of a move, the least joint speed is integrated by the fourth-order
    Runge-Kutta method; one Newton step on the pose removes the drift. `hand` gives T_world_hand,
    its twist per unit of s and the derivative of that twist.
    """

    def step(
        carry: tuple[Vector, Vector, Array, Array], to: tuple[Array, Array]
    ) -> tuple[tuple[Vector, Vector, Array, Array], tuple[Array, ...]]:
        (q, first, number, s), (next_number, next_s) = carry, to
        h = jnp.where(next_number == number, next_s - s, 0.0)

        def stage(carry: tuple[Vector, Vector], now: tuple[Array, Array]) -> tuple:
            (slope, total), (ahead, weight) = carry, now
            twist = _scaled(components(hand(number, s + ahead * h)[1]))
            slope = _joint_slope(arm, _along(q, ahead * h, slope), twist)
            return (slope, _along(total, weight, slope)), None

        # the first stage is the slope at the last waypoint, which is known
        stages = jnp.array([0.5, 0.5, 1.0]), jnp.array([2.0, 2.0, 1.0]) / 6.0
        total = computed_once(Vector(x / 6.0 for x in first))
        (_, mean), _ = jax.lax.scan(stage, (first, total), stages)
        place, xi, bend_xi = hand(next_number, next_s)
        wanted = Frame(components(place.rotation), components(place.translation))
        q = _along(q, h, mean)
        found, jacobian = _hand(arm, q)
        error = _scaled(pose_error(wanted, found))
        q = computed_once(q + _least_squares(jacobian, error, _TINY))
        twist, change = _scaled(components(xi)), _scaled(components(bend_xi))
        # d/ds of Jᵀ (J Jᵀ)⁻¹ ξ, along q' itself
        slope = _joint_slope(arm, q, twist)
        _, bend = jax.jvp(functools.partial(_joint_slope, arm), (q, twist), (slope, change))
        found, jacobian = _hand(arm, q)
        error = stacked(pose_error(wanted, found), xi.dtype)
        sizes = jnp.stack([jnp.linalg.norm(error[:3]), jnp.linalg.norm(error[3:])])
        arrays = (stacked(x, xi.dtype) for x in (q, slope, bend))
        return (q, slope, next_number, next_s), (*arrays, sizes, _conditioning(jacobian))

    # the first waypoint is where the path begins: a step of no length, whatever its slope
    start, still = Vector(unstack(q)), Vector(unstack(jnp.zeros_like(q)))
    _, found = jax.lax.scan(step, (start, still, move[0], s[0]), (move, s))
    return JointPath(*found)


def pose_error(wanted: Frame, found: Frame) -> Vector:
    """How the hand must move, m and rotation vector (rad), world axes; exact for small turns."""
    relative = Matrix(wanted.rotation) @ Matrix(found.rotation).T
    # sin(θ) times the axis; atan2 keeps the angle exact where the sine is small
    axis = computed_once(rotation_axis(relative))
    sine = computed_once(jnp.sqrt(jnp.maximum(axis @ axis, 1e-30)))
    angle = jnp.arctan2(sine, 0.5 * minus(relative.trace(), 1.0))
    offset = Vector(wanted.origin) - found.origin
    return computed_once(Vector((*offset, *(computed_once(angle / sine) * axis))))


def conditioning(arm: Robot, q: Float[Array, " n"]) -> Float[Array, ""]:
    """√(det J Jᵀ), translations over 0.1 m: zero at a singular configuration (Yoshikawa 1985)."""
    return _conditioning(_hand(arm, Vector(unstack(q)))[1])


def _conditioning(jacobian: Matrix) -> Float[Array, ""]:
    inverse = cholesky(_damped_gram(jacobian, _TINY)).inverse_diagonal
    product = jnp.prod(jnp.stack([jnp.asarray(x) for x in inverse]))
    return jnp.nan_to_num(1.0 / product, nan=0.0, posinf=0.0)


def _hand(arm: Robot, q: Vector) -> tuple[Frame, Matrix]:
    """The hand in the world, and its Jacobian, translations over 0.1 m."""
    frames = link_frames(arm, joints_at(arm, q))
    hand = hand_frame(arm, frames)
    columns = jacobian_columns(arm, frames, hand.origin)
    return hand, Matrix(_scaled(Vector((*v, *w))) for v, w in columns).T


def _scaled(twist: Vector) -> Vector:
    """Translations over 0.1 m."""
    return computed_once(Vector((*(1.0 / _LENGTH * twist[:3]), *twist[3:])))


def _along(q: Vector, length: Component, direction: Vector) -> Vector:
    return computed_once(q + length * direction)


def _joint_slope(arm: Robot, q: Vector, scaled: Vector) -> Vector:
    """Joint speeds of least norm that give the hand a twist: Jᵀ (J Jᵀ)⁻¹ ξ."""
    return _least_squares(_hand(arm, q)[1], scaled, _TINY)


def _least_squares(jacobian: Matrix, scaled: Vector, damping: float | Array) -> Vector:
    """Jᵀ (J Jᵀ + λ)⁻¹ ξ with λ relative to the mean of J Jᵀ's diagonal."""
    weights = cholesky(_damped_gram(jacobian, damping)).solve(scaled)
    return computed_once(jacobian.T @ weights)


def _damped_gram(jacobian: Matrix, damping: float | Array) -> SymmetricMatrix:
    gram = computed_once(jacobian.gram())
    extra = computed_once(damping * gram.trace() / len(gram))
    return computed_once(gram + extra * SymmetricMatrix.identity(len(gram)))


def _finite_limits(arm: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Limits of the joints, half a turn to both sides where there are none."""
    low, high = np.asarray(arm.lower, float), np.asarray(arm.upper, float)
    return np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
