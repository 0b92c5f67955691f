"""Joints that follow from the others because both hands hold one object.

The closed chain ties as many joints as the hands' relative pose has freedoms: three in the plane,
six in space. In: the motion of the leading joints. Out: that of the following ones, exact to
rounding, with their rates and accelerations (J_g q̇ = Gᵀ ẋ with the object's motion ẋ left free;
thesis Sec. 7.2.1, errata 27). Newton's method from each node to the next stays on the branch on
which the motion starts.
"""

from collections.abc import Sequence

import jax
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.robots import Robot
from mjx_inertia.robots.links import joints_at, unstack
from mjx_inertia.robots.recursions import (
    Matrix,
    Row,
    ancestors,
    jacobian_columns,
    linear_combination,
    link_frames,
    negate,
    select_axes,
)
from mjx_inertia.space.capture import Capture, held_frames
from mjx_inertia.space.trajectory import JointMotion
from mjx_inertia.spatial.components import (
    multiply,
    once,
    stacked,
    subtract,
    transpose,
    turn_axis,
)
from mjx_inertia.spatial.small_cholesky import factorize, inner, solve_lower, solve_upper

_ITERATIONS = 6  # of Newton's method from one node to the next


def following_joints(robot: Robot, leading: Sequence[int]) -> tuple[int, ...]:
    """The joints that are not in `leading`.

    Raises:
      ValueError: `leading` names a joint twice or one that there is not, not as many remain as the
        closed chain ties, or one of them moves both hands alike.
    """
    if len(set(leading)) != len(leading) or not set(leading) <= set(range(robot.dof)):
        raise ValueError(
            f"`leading` is {tuple(leading)}: name joints from 0 to {robot.dof - 1}, each once"
        )
    rest = tuple(i for i in range(robot.dof) if i not in leading)
    if len(rest) != len(robot.axes):
        raise ValueError(
            f"`leading` {tuple(leading)} leaves {len(rest)} of {robot.dof} joints to follow; two "
            f"hands that hold one object tie {len(robot.axes)}"
        )
    right, left = (set(ancestors(robot, hand)) for hand in robot.hands)
    if idle := [i for i in rest if i not in right ^ left]:
        raise ValueError(
            f"`leading` {tuple(leading)} leaves joint {idle[0]} to follow, which does not move one "
            "hand against the other; let it lead"
        )
    return rest


def closure_error(
    robot: Robot, capture: Capture, q: Float[Array, " n"]
) -> tuple[Float[Array, " k"], Float[Array, "k n"]]:
    """How far the object in the second hand is from that in the first, and its Jacobian.

    Distance (m) and rotation (rad, to first order) in axes of the base.
    """
    apart, rows = _gap(robot, capture, unstack(q))
    return stacked(apart, q.dtype), stacked(rows, q.dtype).T


def close_chain(
    robot: Robot, capture: Capture, q: Float[Array, " n"], following: Sequence[int]
) -> Float[Array, " n"]:
    """`q` with the following joints moved until the hands hold the object alike: Newton's method.

    Its derivative is that of the closed position; where no such position is near it does not close.
    """
    near = jax.lax.fori_loop(
        0,
        _ITERATIONS,
        lambda _, q: _newton(robot, capture, q, following),
        jax.lax.stop_gradient(q),
    )
    near = jax.lax.stop_gradient(near)
    index = np.array(following)
    return _newton(robot, capture, q.at[index].set(near[index]), following)


def closed_chain_motion(
    robot: Robot,
    capture: Capture,
    motion: JointMotion,
    start: Float[Array, " n"],
    following: Sequence[int],
) -> JointMotion:
    """The motion with that of the following joints put in, node after node.

    Args:
      robot: the tree.
      capture: the object.
      motion: of all joints; the entries of following ones are ignored.
      start: joint positions at the start, closed.
      following: joints that follow.
    """
    index = np.array(following)

    def onward(near: Float[Array, " f"], q: Float[Array, " n"]) -> tuple[Array, Array]:
        closed = close_chain(robot, capture, q.at[index].set(near), following)
        return closed[index], closed

    _, q = jax.lax.scan(onward, start[index], motion.q)
    rates = jax.vmap(lambda q, qd, qdd: _rates(robot, capture, q, qd, qdd, following))
    qd, qdd = rates(q, motion.qd, motion.qdd)
    return JointMotion(q, qd, qdd)


def _rates(
    robot: Robot,
    capture: Capture,
    q: Float[Array, " n"],
    qd: Float[Array, " n"],
    qdd: Float[Array, " n"],
    following: Sequence[int],
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    index = np.array(following)
    qd, qdd = qd.at[index].set(0.0), qdd.at[index].set(0.0)
    _, rows = _gap(robot, capture, unstack(q))

    def with_following(rate: Float[Array, " n"], drift: Float[Array, " k"]) -> Float[Array, " n"]:
        moved = _solved([rows[i] for i in following], negate(unstack(drift)))
        return rate.at[index].set(stacked(moved, q.dtype))

    def drift(q: Float[Array, " n"], qd: Float[Array, " n"]) -> Float[Array, " k"]:
        return stacked(
            linear_combination(_gap(robot, capture, unstack(q))[1], unstack(qd)), q.dtype
        )

    full = with_following(qd, drift(q, qd))
    _, change = jax.jvp(drift, (q, full), (full, qdd))
    return full, with_following(qdd, change)


def _newton(
    robot: Robot, capture: Capture, q: Float[Array, " n"], following: Sequence[int]
) -> Float[Array, " n"]:
    apart, rows = _gap(robot, capture, unstack(q))
    # the derivative of a step at the solution is right with its matrix held constant
    held = [unstack(jax.lax.stop_gradient(stacked(rows[i], q.dtype))) for i in following]
    step = _solved(held, negate(apart))
    return q.at[np.array(following)].add(stacked(step, q.dtype))


def _gap(robot: Robot, capture: Capture, q: Row) -> tuple[Row, Matrix]:
    """The gap, and a row for each joint of its change."""
    links = link_frames(robot, joints_at(robot, q))
    first, second = held_frames(robot, capture, links)
    columns = zip(
        jacobian_columns(robot, links, second.origin, 1),
        jacobian_columns(robot, links, first.origin, 0),
        strict=True,
    )
    rows = [
        once(select_axes(robot, subtract(v[0], w[0]), subtract(v[1], w[1]))) for v, w in columns
    ]
    turn = turn_axis(multiply(second.rotation, transpose(first.rotation)))
    return once(select_axes(robot, subtract(second.origin, first.origin), turn)), rows


def _solved(columns: Matrix, vector: Row) -> Row:
    """Solution x of Σ x_i columns_i = vector, of least norm: with Cholesky's factor of K Kᵀ."""
    rows = list(zip(*columns, strict=True))
    square = [[once(inner(rows[i], rows[j])) for j in range(i + 1)] for i in range(len(rows))]
    factor = factorize(square)
    weights = solve_upper(factor, solve_lower(factor, vector))
    return tuple(once(inner(column, weights)) for column in columns)
