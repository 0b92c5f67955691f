"""Everything that one instant of a motion without momentum shows, computed together.

In: a robot, what it holds, joint positions, rates and accelerations. Out: `Node`: motion of the
base, torques, wrenches on the object, how well the hands agree. Written in components: the parts
that no cost reads are left out when it is compiled.

Two models of momentum. "system": base, arms and object have none together. "robot": as thesis Eqs
7.2 to 7.8 are printed, base and arms have none, and the object is added in Eq. 7.10 alone; the
object's pull on the base is missed.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.robots.links import (
    Frame,
    Joint,
    LinkMotion,
    acceleration_gradient,
    body_from_parameters,
    compose_frames,
    frame_of,
    joints_at,
    link_acceleration,
    newton_euler_wrench,
    unstack,
)
from mjx_inertia.robots.recursions import (
    CompositeInertias,
    Matrix,
    Row,
    base_jacobian_rows,
    composite_inertias,
    hand_frame,
    jacobian_columns,
    linear_combination,
    link_frames,
    negate,
    newton_euler,
    scatter_axes,
    select_axes,
)
from mjx_inertia.robots.robot import Robot, check_joints
from mjx_inertia.space.capture import Capture, held_frames, with_capture
from mjx_inertia.spatial.components import (
    ZERO,
    Component,
    Vec3,
    add,
    apply,
    components,
    cross,
    dot,
    minus,
    multiply,
    once,
    plus,
    root,
    stacked,
    subtract,
    times,
    transpose,
    turn_axis,
)
from mjx_inertia.spatial.small_cholesky import Factor, factorize, inner, solve_lower, solve_upper


@struct.dataclass
class Node:
    """One instant; vectors of k entries hold the `axes` of the robot."""

    base_twist: Float[Array, " k"]  # of the base, in its axes
    base_acceleration: Float[Array, " k"]  # of its origin (m/s²) and angular (rad/s²), in its axes
    # of the joints that move robot and object, the object in the first hand, N m (N)
    torque: Float[Array, " n"]
    # F_tot of Eq. 7.9 in the object's axes about its CoM, N and N m.
    total_wrench: Float[Array, " k"]
    # the part that moves the object, Λ_ob ẍ + μ_ob, which the hands exert on it
    object_wrench: Float[Array, " k"]
    # distance (m) and angle (rad) between the object as one and as the other hand has it
    closure: Float[Array, "2"]
    object_rotation: Float[Array, "3 3"]  # of the object in the base
    object_place: Float[Array, "3"]  # of the object's frame in the base, m
    manipulability: Float[Array, ""]  # √det J_g J_gᵀ, which vanishes where J_g is singular


class _Tree(NamedTuple):
    """A robot at joint positions."""

    inertias: CompositeInertias
    factor: Factor  # of H_b
    links: list[Frame]


def node(
    robot: Robot,
    capture: Capture,
    q: Float[Array, " n"],
    qd: Float[Array, " n"],
    qdd: Float[Array, " n"],
    momentum: str = "system",
    with_total: bool = True,
) -> Node:
    """The instant at joint positions `q`, rates `qd` and accelerations `qdd`.

    Near a singular J_g the total wrench means nothing: it is huge, or not finite. Without it
    (`with_total`; it and manipulability are NaN) a robot in space compiles in half the time.
    """
    check_joints(robot, q=q, qd=qd, qdd=qdd)
    moving, joints = with_capture(robot, capture, momentum), joints_at(robot, unstack(q))
    matrix, links = composite_inertias(moving, joints), link_frames(robot, joints)
    tree = _Tree(matrix, factorize(matrix.base), links)
    # base twist from zero momentum, Eq. 7.3
    twist = negate(_solved(tree.factor, linear_combination(matrix.coupling, unstack(qd))))
    # forces while the base does not accelerate; its acceleration makes up for its wrench
    still = LinkMotion(scatter_axes(robot, twist)[1], ZERO, ZERO)
    forces = newton_euler(moving, joints, unstack(qd), unstack(qdd), still)
    acceleration = negate(_solved(tree.factor, forces.base))
    # torques, Eq. 7.6
    felt = [once(inner(row, acceleration)) for row in matrix.coupling]
    torque = once(tuple(plus(a, b) for a, b in zip(forces.joints, felt, strict=True)))
    held = held_frames(robot, capture, links)
    load = _object_wrench(robot, capture, forces.links[robot.hands[0]], links, acceleration)
    total, manipulability = (np.nan,) * len(robot.axes), np.nan
    if with_total:
        total, manipulability = _total_wrench(robot, capture, tree, held[0], torque)
    if momentum == "robot":
        total = tuple(plus(a, b) for a, b in zip(total, load, strict=True))
    vectors = (twist, acceleration, torque, total, load, _closure(*held))
    rotation, place = stacked(held[0].rotation, q.dtype), stacked(held[0].origin, q.dtype)
    a, b, c, d, e, f = (stacked(vector, q.dtype) for vector in vectors)
    return Node(a, b, c, d, e, f, rotation, place, jnp.asarray(manipulability, q.dtype))


def _solved(factor: Factor, vector: Row) -> Row:
    return tuple(solve_upper(factor, solve_lower(factor, vector)))


def _total_wrench(
    robot: Robot, capture: Capture, tree: _Tree, held: Frame, torque: Row
) -> tuple[Row, Component]:
    """G J_g⁻ᵀ τ about the object's CoM in its axes, and √det J_g J_gᵀ.

    With more joints than the hands have freedoms, the dynamically consistent inverse of J_g takes
    the place of J_g⁻¹ (Khatib 1987): F = (J H_el⁻¹ Jᵀ)⁻¹ J H_el⁻¹ τ.
    """
    hands = [hand_frame(robot, tree.links, k) for k in (0, 1)]
    reaction = [negate(_solved(tree.factor, c)) for c in tree.inertias.coupling]  # of J_a
    jacobian: Matrix = []  # columns of J_g, one for each joint
    per_hand = [
        (
            base_jacobian_rows(robot, hand.origin),
            jacobian_columns(robot, tree.links, hand.origin, k),
        )
        for k, hand in enumerate(hands)
    ]
    for j, moved in enumerate(reaction):
        column: list[Component] = []
        for of_base, of_joints in per_hand:
            own = select_axes(robot, *of_joints[j])
            pairs = zip(own, linear_combination(of_base, moved), strict=True)
            column += [once(plus(x, y)) for x, y in pairs]
        jacobian.append(tuple(column))
    reduced = [
        [
            once(plus(tree.inertias.joints[i][j], inner(tree.inertias.coupling[i], reaction[j])))
            for j in range(i + 1)
        ]
        for i in range(robot.dof)
    ]
    factor = factorize(reduced)
    rows = [tuple(column[i] for column in jacobian) for i in range(len(jacobian[0]))]
    weighted = [solve_lower(factor, entry) for entry in rows]
    mobility = factorize(_products(weighted))
    right = [once(inner(entry, solve_lower(factor, torque))) for entry in weighted]
    wrenches = solve_upper(mobility, solve_lower(mobility, right))
    plain = factorize(_products(rows))
    volume: Component = 1.0
    for entry in plain.inverse_diagonal:
        volume = volume / entry
    k = len(robot.axes)
    com = _com(capture, held)
    force, moment = ZERO, ZERO
    for hand, own in zip(hands, (wrenches[:k], wrenches[k:]), strict=True):
        f, n = scatter_axes(robot, tuple(own))
        force = add(force, f)
        moment = add(moment, n, cross(subtract(hand.origin, com), f))
    back = transpose(held.rotation)
    return once(select_axes(robot, apply(back, force), apply(back, moment))), volume


def _products(rows: Matrix | list[list[Component]]) -> list[list[Component]]:
    """Lower half of the inner products of rows with one another."""
    return [[once(inner(rows[i], rows[j])) for j in range(i + 1)] for i in range(len(rows))]


def _object_wrench(
    robot: Robot,
    capture: Capture,
    motion: LinkMotion,
    links: list[Frame],
    acceleration: Row,
) -> Row:
    """Newton's and Euler's laws of the object, which the first hand carries.

    Args:
      robot: the tree.
      capture: the object.
      motion: of that hand's link while the base does not accelerate.
      links: in the base.
      acceleration: of the base.
    """
    link = links[robot.hands[0]]
    linear, angular = scatter_axes(robot, acceleration)
    back = transpose(link.rotation)
    # the link, with the base's acceleration added
    moved = add(linear, cross(angular, link.origin))
    alpha = add(motion.alpha, apply(back, angular))
    motion = LinkMotion(motion.omega, alpha, add(motion.linear, apply(back, moved)))
    gradient = once(acceleration_gradient(motion))
    # the object, as behind a joint that does not move
    rotation, offset = _object_in_link(robot, capture)
    at_object = once(add(motion.linear, apply(gradient, offset)))
    fixed = Joint(rotation, offset, ZERO, False)
    motion = link_acceleration(fixed, motion._replace(linear=at_object), 0.0, 0.0)
    body = body_from_parameters(capture.inertial)
    force, moment = newton_euler_wrench(body, motion, acceleration_gradient(motion))
    about_com = subtract(moment, cross(components(capture.inertial.com), force))
    return once(select_axes(robot, force, about_com))


def _object_in_link(robot: Robot, capture: Capture) -> Frame:
    return compose_frames(frame_of(robot.T_link_hand[0]), frame_of(capture.T_hand_obj[0]))


def _com(capture: Capture, held: Frame) -> Vec3:
    return add(held.origin, apply(held.rotation, components(capture.inertial.com)))


def _closure(first: Frame, second: Frame) -> Row:
    """Distance and angle between two frames."""
    apart = subtract(second.origin, first.origin)
    turn = multiply(transpose(first.rotation), second.rotation)
    sine = turn_axis(turn)
    trace = plus(turn[0][0], plus(turn[1][1], turn[2][2]))  # 1 + 2 cos φ
    angle = jnp.arctan2(times(2.0, root(dot(sine, sine))), minus(trace, 1.0))
    return root(dot(apart, apart)), angle
