"""How near the robot comes to itself and to what it holds.

In: a robot, an object, joint positions. Out: the least distance between parts that must not touch.
Links are capsules from their joint to the next (or to the hand), the base is a box, the object a
ball. Neighbours in the tree and what a hand holds may touch. Distance to the base is taken at some
points along a link, so it is too large by less than a tenth of a link's length near an edge.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.robots import BASE, Robot
from mjx_inertia.robots.recursions import frames_at, hand_frame
from mjx_inertia.space.capture import Capture, held_frames
from mjx_inertia.spatial.components import root, stacked
from mjx_inertia.spatial.extremes import greatest, least

_POINTS = 9  # of a link against the base


def clearance(robot: Robot, capture: Capture, q: Float[Array, " n"]) -> Float[Array, ""]:
    """Least distance (m) between parts that must not touch; negative where they overlap."""
    start, end = _segments(robot, q)
    links = frames_at(robot, q)
    ball = stacked(held_frames(robot, capture, links)[0].origin, q.dtype)
    pairs = np.array(_link_pairs(robot), int).reshape(-1, 2)
    between = jax.vmap(segment_distance)(
        start[pairs[:, 0]], end[pairs[:, 0]], start[pairs[:, 1]], end[pairs[:, 1]]
    )
    free = np.array([i for i in range(robot.dof) if i not in robot.hands], int)
    to_ball = jax.vmap(lambda a, b: _point_distance(ball, a, b))(start[free], end[free])
    loose = np.array([i for i in range(robot.dof) if robot.parents[i] != BASE], int)
    share = np.linspace(0.0, 1.0, _POINTS)[:, None, None]
    points = start[loose] + share * (end[loose] - start[loose])
    to_base = _box_distance(points, np.array(robot.base_size) / 2.0, robot.planar)
    own = _box_distance(ball, np.array(robot.base_size) / 2.0, robot.planar)
    return least(
        jnp.concatenate(
            [
                between - 2.0 * robot.radius,
                to_ball - robot.radius - capture.radius,
                to_base.ravel() - robot.radius,
                own[None] - capture.radius,
            ]
        )
    )


def _segments(
    robot: Robot, q: Float[Array, " n"]
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
    """Ends of the links' axes in the base, m."""
    links = frames_at(robot, q)
    ends = []
    for i, link in enumerate(links):
        children = [k for k, parent in enumerate(robot.parents) if parent == i]
        if i in robot.hands:
            ends.append(hand_frame(robot, links, robot.hands.index(i)).origin)
        elif children:
            ends.append(links[children[0]].origin)
        else:
            ends.append(link.origin)
    starts = [link.origin for link in links]
    return stacked(starts, q.dtype), stacked(ends, q.dtype)


def _link_pairs(robot: Robot) -> list[tuple[int, int]]:
    """Links that must not touch: no neighbours, and not the two that hold the object."""
    still = np.linalg.norm(np.asarray(robot.T_parent_joint.translation), axis=1) < 2 * robot.radius

    def near(i: int, j: int) -> bool:
        """Whether j is reached from i over links that are shorter than they are thick."""
        parent = robot.parents[j]
        if parent == i:
            return True
        return parent not in (BASE, i) and bool(still[j]) and near(i, parent)

    n = robot.dof
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n) if not near(i, j)]
    return [pair for pair in pairs if set(pair) != set(robot.hands)]


def _point_distance(
    point: Float[Array, "3"], a: Float[Array, "3"], b: Float[Array, "3"]
) -> Float[Array, ""]:
    along = b - a
    share = jnp.dot(point - a, along) / jnp.maximum(jnp.dot(along, along), 1e-12)
    return jnp.asarray(root(jnp.sum((point - a - jnp.clip(share, 0.0, 1.0) * along) ** 2)))


def segment_distance(
    a: Float[Array, "3"], b: Float[Array, "3"], c: Float[Array, "3"], d: Float[Array, "3"]
) -> Float[Array, ""]:
    """Between the segments ab and cd: at an end of one, or between inner points of both."""
    ends = [
        _point_distance(a, c, d),
        _point_distance(b, c, d),
        _point_distance(c, a, b),
        _point_distance(d, a, b),
    ]
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = (jnp.dot(x, y) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    square = uu * vv - uv**2
    parallel = square < 1e-9 * jnp.maximum(uu * vv, 1e-12)
    safe = jnp.where(parallel, 1.0, square)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inside = ~parallel & (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0)
    inner = root(jnp.sum((w + s * u - t * v) ** 2))
    return least(jnp.stack([*ends, jnp.where(inside, inner, jnp.inf)]))


def _box_distance(
    points: Float[Array, "*n 3"], half: Float[np.ndarray, "3"], planar: bool
) -> Float[Array, "*n"]:
    """To a box about the origin, negative inside."""
    beyond = jnp.abs(points) - jnp.asarray(half)
    if planar:
        beyond = beyond[..., :2]
    outside = root(jnp.sum(jnp.maximum(beyond, 0.0) ** 2, -1))
    return outside + jnp.minimum(greatest(jnp.moveaxis(beyond, -1, 0)), 0.0)
