"""The recursions along a free-floating tree, in components and in the axes of the base.

In: a `SpaceRobot`, joint positions, rates and accelerations as rows of components. Out: composite
inertias, momentum, wrench and torques, hands. A row of a twist or wrench holds the entries
`robot.axes` only. The acceleration of the base is that of its origin, R_baseᵀ p̈, and not the
derivative of R_baseᵀ ṗ: so nothing here depends on how fast the base moves along.
"""

from typing import NamedTuple

from mjx_inertia.robots.chain import (
    Body,
    Frame,
    Joint,
    add_bodies,
    body_from,
    body_from_parameters,
    once_body,
)
from mjx_inertia.robots.link_motion import (
    acceleration_gradient,
    body_in_parent,
    joint_momentum,
    link_acceleration,
    newton_euler_wrench,
    project_on_axis,
    wrench_in_parent,
)
from mjx_inertia.space.robot import BASE, Capture, SpaceRobot
from mjx_inertia.spatial import InertialParameters, Pose
from mjx_inertia.spatial.components import (
    IDENTITY,
    ZERO,
    Component,
    Vec3,
    add,
    apply,
    components,
    cross,
    multiply,
    once,
    plus,
    scale,
    subtract,
    times,
)

Row = tuple[Component, ...]
Matrix = list[Row]


class TreeInertias(NamedTuple):
    """Composite inertias of the whole tree: thesis Eq. 7.1."""

    base: Matrix  # H_b of the entries in `axes`
    coupling: Matrix  # H_bm: one row of those entries for each joint
    joints: Matrix  # H_m
    whole: Body  # the tree as one body about the base's origin


class TreeForces(NamedTuple):
    """What a motion takes: wrench at the base's origin (entries in `axes`) and torques."""

    base: Row
    joints: Row


def select_axes(robot: SpaceRobot, linear: Vec3, angular: Vec3) -> Row:
    """The entries of a twist or wrench that a robot can have."""
    both = (*linear, *angular)
    return tuple(both[i] for i in robot.axes)


def scatter_axes(robot: SpaceRobot, row: Row) -> tuple[Vec3, Vec3]:
    """A twist or wrench of the entries in `axes`; the others are zero."""
    both: list[Component] = [0.0] * 6
    for i, entry in zip(robot.axes, row, strict=True):
        both[i] = entry
    return (both[0], both[1], both[2]), (both[3], both[4], both[5])


def negate(row: Row) -> Row:
    """A row with every sign changed."""
    return tuple(times(-1.0, entry) for entry in row)


def tree_bodies(robot: SpaceRobot, capture: Capture | None) -> tuple[Body, list[Body]]:
    """The base and the links about the origins of their frames.

    Args:
      robot: the tree.
      capture: the object fixed to the first hand's link; no object if None.
    """
    entries = zip(
        components(robot.links.mass),
        components(robot.links.com),
        components(robot.links.inertia),
        strict=True,
    )
    links = [body_from(*entry) for entry in entries]
    if capture is not None:
        i = robot.hands[0]
        T_link_obj = frame_of(robot.T_link_hand, 0), frame_of(capture.T_hand_obj, 0)
        links[i] = once_body(add_bodies(links[i], _placed(capture.inertial, *T_link_obj)))
    return body_from_parameters(robot.base), links


def frames(robot: SpaceRobot, joints: list[Joint]) -> list[Frame]:
    """The links in the base."""
    result: list[Frame] = []
    for joint, parent in zip(joints, robot.parents, strict=True):
        before = _parent_frame(result, parent)
        origin = once(add(before.origin, apply(before.rotation, joint.offset)))
        result.append(Frame(once(multiply(before.rotation, joint.rotation)), origin))
    return result


def hand_frames(robot: SpaceRobot, links: list[Frame]) -> list[Frame]:
    """Both hands in the base."""
    return [
        compose_frames(_parent_frame(links, link), frame_of(robot.T_link_hand, k))
        for k, link in enumerate(robot.hands)
    ]


def held_frames(robot: SpaceRobot, capture: Capture, links: list[Frame]) -> list[Frame]:
    """The object in the base as each hand has it."""
    return [
        compose_frames(hand, frame_of(capture.T_hand_obj, k))
        for k, hand in enumerate(hand_frames(robot, links))
    ]


def compose_frames(before: Frame, frame: Frame) -> Frame:
    """A frame given in another, in what the other is given in."""
    origin = once(add(before.origin, apply(before.rotation, frame.origin)))
    return Frame(once(multiply(before.rotation, frame.rotation)), origin)


def hand_jacobian_columns(robot: SpaceRobot, links: list[Frame], hand: int, place: Vec3) -> Matrix:
    """J_e: a row for each joint, the twist at `place` (m, base) of what a hand holds."""
    ahead = ancestors(robot, robot.hands[hand])
    nothing = select_axes(robot, ZERO, ZERO)
    rows: Matrix = []
    for i, (frame, axis) in enumerate(zip(links, components(robot.axis), strict=True)):
        if i not in ahead:
            rows.append(nothing)
            continue
        along = once(apply(frame.rotation, axis))
        if robot.prismatic[i]:
            rows.append(select_axes(robot, along, ZERO))
        else:
            turning = once(cross(along, subtract(place, frame.origin)))
            rows.append(select_axes(robot, turning, along))
    return rows


def base_jacobian_columns(robot: SpaceRobot, place: Vec3) -> Matrix:
    """J_b: a row for each entry of the base's twist, the twist at `place` that it causes."""
    rows: Matrix = []
    for i in robot.axes:
        unit = IDENTITY[i % 3]
        if i < 3:
            rows.append(select_axes(robot, unit, ZERO))
        else:
            rows.append(select_axes(robot, cross(unit, place), unit))
    return rows


def center_of_mass(base: Body, bodies: list[Body], links: list[Frame]) -> Vec3:
    """Of the whole tree, in the base, m."""
    mass, moment = base.mass, base.moment
    for body, link in zip(bodies, links, strict=True):
        mass = plus(mass, body.mass)
        own = add(scale(body.mass, link.origin), apply(link.rotation, body.moment))
        moment = add(moment, own)
    return scale(1.0 / mass, moment)


def ancestors(robot: SpaceRobot, link: int) -> list[int]:
    """The joints that move a link, its own first."""
    path = []
    while link != BASE:
        path.append(link)
        link = robot.parents[link]
    return path


def composite_inertias(
    robot: SpaceRobot, joints: list[Joint], base: Body, bodies: list[Body]
) -> TreeInertias:
    """H_b, H_bm and H_m: the composite rigid body algorithm (Featherstone 2008, Sec. 9.3)."""
    n = robot.dof
    drives = components(robot.armature)
    matrix: list[list[Component]] = [[0.0] * n for _ in range(n)]
    coupling: Matrix = [()] * n
    composite = list(bodies)
    whole = base
    for i in reversed(range(n)):
        force, moment = once(joint_momentum(joints[i], composite[i]))
        matrix[i][i] = once(plus(drives[i], project_on_axis(joints[i], force, moment)))
        j = i
        while j != BASE:
            force, moment = once(wrench_in_parent(joints[j], force, moment))
            j = robot.parents[j]
            if j != BASE:
                matrix[i][j] = matrix[j][i] = once(project_on_axis(joints[j], force, moment))
        coupling[i] = select_axes(robot, force, moment)
        carried = body_in_parent(joints[i], composite[i])
        if (parent := robot.parents[i]) == BASE:
            whole = once_body(add_bodies(whole, carried))
        else:
            composite[parent] = once_body(add_bodies(composite[parent], carried))
    return TreeInertias(_base_matrix(robot, whole), coupling, [tuple(r) for r in matrix], whole)


def tree_newton_euler(
    robot: SpaceRobot,
    joints: list[Joint],
    base: Body,
    bodies: list[Body],
    motion: tuple[Row, Row],
    rates: tuple[Row, Row],
) -> tuple[TreeForces, list[tuple[Vec3, Vec3, Vec3]]]:
    """Forces of a motion, and ω, α and acceleration of every link's origin, in the link's axes.

    Luh, Walker and Paul 1980, from a base that moves.

    Args:
      robot: the tree.
      joints: at their positions.
      base: inertia of the base.
      bodies: of the links.
      motion: twist and acceleration of the base.
      rates: of the joints, and their accelerations.
    """
    _, omega = scatter_axes(robot, motion[0])
    linear, alpha = scatter_axes(robot, motion[1])
    gradient = once(acceleration_gradient(omega, alpha))
    force, moment = newton_euler_wrench(base, omega, alpha, linear, gradient)
    states, gradients, wrenches = [], [], []
    for i, (joint, body) in enumerate(zip(joints, bodies, strict=True)):
        parent = robot.parents[i]
        at, slope = (
            ((omega, alpha, linear), gradient)
            if parent == BASE
            else (states[parent], gradients[parent])
        )
        carried = once(add(at[2], apply(slope, joint.offset)))
        state = link_acceleration(joint, at[0], at[1], carried, rates[0][i], rates[1][i])
        states.append(state)
        gradients.append(once(acceleration_gradient(state[0], state[1])))
        wrenches.append(newton_euler_wrench(body, *state, gradients[i]))
    drives = components(robot.armature)
    torques: list[Component] = [0.0] * robot.dof
    for i in reversed(range(robot.dof)):
        own = once(wrenches[i])
        torques[i] = once(plus(project_on_axis(joints[i], *own), times(drives[i], rates[1][i])))
        passed = wrench_in_parent(joints[i], *own)
        if (parent := robot.parents[i]) == BASE:
            force, moment = once((add(force, passed[0]), add(moment, passed[1])))
        else:
            before = wrenches[parent]
            wrenches[parent] = (add(before[0], passed[0]), add(before[1], passed[1]))
    return TreeForces(select_axes(robot, force, moment), tuple(torques)), states


def linear_combination(rows: Matrix, factors: Row) -> Row:
    """Σ of the rows, each times its factor."""
    total: list[Component] = [0.0] * len(rows[0])
    for row, factor in zip(rows, factors, strict=True):
        total = [plus(t, times(factor, entry)) for t, entry in zip(total, row, strict=True)]
    return once(tuple(total))


def dot_rows(rows: Matrix, vector: Row) -> Row:
    """Inner product of each row with a vector."""
    result = []
    for row in rows:
        total: Component = 0.0
        for a, b in zip(row, vector, strict=True):
            total = plus(total, times(a, b))
        result.append(total)
    return once(tuple(result))


def _base_matrix(robot: SpaceRobot, whole: Body) -> Matrix:
    rows: Matrix = []
    for i in robot.axes:
        unit = IDENTITY[i % 3]
        if i < 3:
            rows.append(select_axes(robot, scale(whole.mass, unit), cross(whole.moment, unit)))
        else:
            rows.append(select_axes(robot, cross(unit, whole.moment), apply(whole.inertia, unit)))
    return rows


def _parent_frame(links: list[Frame], parent: int) -> Frame:
    return Frame(IDENTITY, ZERO) if parent == BASE else links[parent]


def frame_of(poses: Pose, k: int) -> Frame:
    """Pose k as components."""
    return Frame(components(poses.rotation[k]), components(poses.translation[k]))


def _placed(params: InertialParameters, T_link_hand: Frame, T_hand_obj: Frame) -> Body:
    """A body in the axes and about the origin of the link that holds it."""
    frame = compose_frames(T_link_hand, T_hand_obj)
    # a joint that has been turned is a frame in a frame
    fixed = Joint(frame.rotation, frame.origin, ZERO, False)
    return body_in_parent(fixed, body_from_parameters(params))
