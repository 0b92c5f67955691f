"""The recursions along a robot's tree, in components: what the functions of arrays are made of.

In: a `Robot`, its joints at their positions (`joints_at`), and rows of components, one entry per
joint. Out: frames, Jacobians, torques, inertias. All is in the axes of the world where the base is
fixed, and in those of the base where it is free: nothing depends on where a free base is and how
fast it moves along. Its rows of twists and wrenches hold the entries `robot.axes` only.

Several recursions in one program share the joints. Each intermediate that more than one expression
reads is marked to be computed once; without that XLA's CPU compiler repeats such expressions inside
each other, and both the program and its compilation grow a hundredfold.
"""

from typing import NamedTuple

from jaxtyping import Array, Float

from mjx_inertia.robots.links import (
    Body,
    Frame,
    Joint,
    LinkMotion,
    acceleration_gradient,
    add_bodies,
    body_from_parameters,
    body_in_parent,
    compose_frames,
    frame_of,
    joint_momentum,
    joints_at,
    link_acceleration,
    link_bodies,
    newton_euler_wrench,
    once_body,
    project_on_axis,
    unstack,
    wrench_in_parent,
)
from mjx_inertia.robots.robot import BASE, Robot
from mjx_inertia.spatial.components import (
    IDENTITY,
    ZERO,
    Component,
    Vec3,
    add,
    apply,
    components,
    cross,
    once,
    plus,
    scale,
    subtract,
    times,
    transpose,
)

Row = tuple[Component, ...]
Matrix = list[Row]
Columns = list[tuple[Vec3, Vec3]]  # linear, angular; one pair for each joint


class CompositeInertias(NamedTuple):
    """Mass matrix in blocks; those of a fixed base are empty."""

    joints: Matrix
    base: Matrix  # of the entries in `axes`
    coupling: Matrix  # one row of those entries for each joint
    whole: Body | None  # the tree as one body about the base's origin


class MotionForces(NamedTuple):
    """What a motion takes, and how the links move."""

    joints: Row  # torques
    base: Row  # wrench at the origin of a free base, entries in `axes`
    links: list[LinkMotion]


def zeros(robot: Robot) -> Row:
    """Zeros that are known: what stands still costs nothing."""
    return (0.0,) * robot.dof


def select_axes(robot: Robot, linear: Vec3, angular: Vec3) -> Row:
    """The entries of a twist or wrench that a robot can have."""
    both = (*linear, *angular)
    return tuple(both[i] for i in robot.axes)


def scatter_axes(robot: Robot, row: Row) -> tuple[Vec3, Vec3]:
    """A twist or wrench of the entries in `axes`; the others are zero."""
    both: list[Component] = [0.0] * 6
    for i, entry in zip(robot.axes, row, strict=True):
        both[i] = entry
    return (both[0], both[1], both[2]), (both[3], both[4], both[5])


def negate(row: Row) -> Row:
    """A row with every sign changed."""
    return tuple(times(-1.0, entry) for entry in row)


def linear_combination(rows: Matrix, factors: Row) -> Row:
    """Σ of the rows, each times its factor."""
    total: list[Component] = [0.0] * len(rows[0])
    for row, factor in zip(rows, factors, strict=True):
        total = [plus(t, times(factor, entry)) for t, entry in zip(total, row, strict=True)]
    return once(tuple(total))


def ancestors(robot: Robot, link: int) -> list[int]:
    """The joints that move a link, its own first."""
    path = []
    while link != BASE:
        path.append(link)
        link = robot.parents[link]
    return path


def link_frames(robot: Robot, joints: list[Joint]) -> list[Frame]:
    """The links in the world, or in a free base."""
    base = Frame(IDENTITY, ZERO) if robot.base is not None else frame_of(robot.T_world_base)
    frames: list[Frame] = []
    for joint, parent in zip(joints, robot.parents, strict=True):
        before = base if parent == BASE else frames[parent]
        frames.append(compose_frames(before, Frame(joint.rotation, joint.offset)))
    return frames


def frames_at(robot: Robot, q: Float[Array, " n"]) -> list[Frame]:
    """As `link_frames`, at joint positions."""
    return link_frames(robot, joints_at(robot, unstack(q)))


def hand_frame(robot: Robot, frames: list[Frame], hand: int = 0) -> Frame:
    """A hand, from the links."""
    return compose_frames(frames[robot.hands[hand]], frame_of(robot.T_link_hand[hand]))


def hand_point(
    robot: Robot, frames: list[Frame], point: Float[Array, "3"] | None, hand: int = 0
) -> Vec3:
    """A point of a hand, given in its frame; its origin if None."""
    T = hand_frame(robot, frames, hand)
    if point is None:
        return T.origin
    return once(add(T.origin, apply(T.rotation, components(point))))


def jacobian_columns(robot: Robot, frames: list[Frame], place: Vec3, hand: int = 0) -> Columns:
    """The Jacobian's columns of a place (m) on a hand, or on what it holds."""
    ahead = ancestors(robot, robot.hands[hand])
    columns: Columns = []
    for i, (frame, axis) in enumerate(zip(frames, components(robot.axis), strict=True)):
        if i not in ahead:
            columns.append((ZERO, ZERO))
            continue
        along = once(apply(frame.rotation, axis))
        if robot.prismatic[i]:
            columns.append((along, ZERO))
        else:
            columns.append((once(cross(along, subtract(place, frame.origin))), along))
    return columns


def base_jacobian_rows(robot: Robot, place: Vec3) -> Matrix:
    """A row for each entry of a free base's twist, the twist at `place` that it causes."""
    rows: Matrix = []
    for i in robot.axes:
        unit = IDENTITY[i % 3]
        linear, angular = (unit, ZERO) if i < 3 else (cross(unit, place), unit)
        rows.append(select_axes(robot, linear, angular))
    return rows


def jacobian_rate_twist(columns: Columns, qd: Row) -> tuple[Vec3, Vec3]:
    """J̇ q̇: acceleration of the place on the hand, and of its turning, at q̈ = 0.

    A joint turns the axes and levers of all behind it, ċ = ω × c with ω of the joints before, and
    the lever of its own turns with the hand's velocity relative to it.
    """
    caused = [
        (once(scale(speed, linear)), once(scale(speed, angular)))
        for speed, (linear, angular) in zip(qd, columns, strict=True)
    ]
    # velocity of the place that each joint and those behind it cause
    behind = [ZERO]
    for own, _ in reversed(caused):
        behind.append(once(add(behind[-1], own)))
    omega, linear, angular = ZERO, ZERO, ZERO
    for (own, turn), relative in zip(caused, reversed(behind[1:]), strict=True):
        linear = add(linear, cross(omega, own), cross(turn, relative))
        angular = add(angular, cross(omega, turn))
        omega, linear, angular = once((add(omega, turn), linear, angular))
    return linear, angular


def newton_euler(
    robot: Robot, joints: list[Joint], qd: Row, qdd: Row, base: LinkMotion | None = None
) -> MotionForces:
    """Forces of a motion; Luh, Walker and Paul 1980, with inertias about the frames' origins.

    Args:
      robot: the robot.
      joints: at their positions.
      qd: joint velocities.
      qdd: joint accelerations.
      base: motion of the base; at rest if None.
    """
    # a base at rest falls upwards instead of the links being pulled down
    if base is None:
        turn = transpose(components(robot.T_world_base.rotation))
        base = LinkMotion(ZERO, ZERO, scale(-1.0, apply(turn, components(robot.gravity))))
    slope = once(acceleration_gradient(base))
    # outward: motion of each link, and the wrench that it takes
    motions, slopes, wrenches = [], [], []
    for i, (joint, body) in enumerate(zip(joints, link_bodies(robot), strict=True)):
        parent = robot.parents[i]
        before, gradient = (base, slope) if parent == BASE else (motions[parent], slopes[parent])
        at_joint = once(add(before.linear, apply(gradient, joint.offset)))
        motion = link_acceleration(joint, before._replace(linear=at_joint), qd[i], qdd[i])
        motions.append(motion)
        slopes.append(once(acceleration_gradient(motion)))
        wrenches.append(newton_euler_wrench(body, motion, slopes[i]))
    # inward: torques, and what each link passes on to the one before
    total = (ZERO, ZERO)
    if robot.base is not None:
        total = newton_euler_wrench(body_from_parameters(robot.base), base, slope)
    drives = components(robot.armature)
    torques: list[Component] = [0.0] * robot.dof
    for i in reversed(range(robot.dof)):
        own = once(wrenches[i])
        torques[i] = once(plus(project_on_axis(joints[i], *own), times(drives[i], qdd[i])))
        parent = robot.parents[i]
        if parent == BASE and robot.base is None:
            continue
        force, moment = wrench_in_parent(joints[i], *own)
        if parent == BASE:
            total = once((add(total[0], force), add(total[1], moment)))
        else:
            before = wrenches[parent]
            wrenches[parent] = (add(before[0], force), add(before[1], moment))
    return MotionForces(tuple(torques), select_axes(robot, *total), motions)


def composite_inertias(robot: Robot, joints: list[Joint]) -> CompositeInertias:
    """The mass matrix, armature included: the composite rigid body algorithm.

    Featherstone 2008, Table 6.2 and Sec. 9.3.
    """
    n, drives, composite = robot.dof, components(robot.armature), link_bodies(robot)
    whole = None if robot.base is None else body_from_parameters(robot.base)
    matrix: list[list[Component]] = [[0.0] * n for _ in range(n)]
    coupling: Matrix = [()] * n
    for i in reversed(range(n)):
        # momentum of all that joint i moves at unit speed, felt by the joints before it
        force, moment = once(joint_momentum(joints[i], composite[i]))
        matrix[i][i] = once(plus(drives[i], project_on_axis(joints[i], force, moment)))
        j = i
        while (parent := robot.parents[j]) != BASE:
            force, moment = once(wrench_in_parent(joints[j], force, moment))
            j = parent
            matrix[i][j] = matrix[j][i] = once(project_on_axis(joints[j], force, moment))
        if whole is not None:
            coupling[i] = select_axes(robot, *once(wrench_in_parent(joints[j], force, moment)))
        # the link and all behind it join the link before
        if (parent := robot.parents[i]) != BASE:
            carried = body_in_parent(joints[i], composite[i])
            composite[parent] = once_body(add_bodies(composite[parent], carried))
        elif whole is not None:
            whole = once_body(add_bodies(whole, body_in_parent(joints[i], composite[i])))
    base = [] if whole is None else _base_matrix(robot, whole)
    return CompositeInertias([tuple(row) for row in matrix], base, coupling, whole)


def center_of_mass(robot: Robot, frames: list[Frame]) -> Vec3:
    """Of the links, their payload and a free base, m."""
    mass, moment = 0.0, ZERO
    if robot.base is not None:
        body = body_from_parameters(robot.base)
        mass, moment = body.mass, body.moment
    for body, link in zip(link_bodies(robot), frames, strict=True):
        mass = plus(mass, body.mass)
        own = add(scale(body.mass, link.origin), apply(link.rotation, body.moment))
        moment = add(moment, own)
    return scale(1.0 / mass, moment)


def _base_matrix(robot: Robot, whole: Body) -> Matrix:
    """Spatial inertia of the whole tree at the base's origin."""
    rows: Matrix = []
    for i in robot.axes:
        unit = IDENTITY[i % 3]
        if i < 3:
            rows.append(select_axes(robot, scale(whole.mass, unit), cross(whole.moment, unit)))
        else:
            rows.append(select_axes(robot, cross(unit, whole.moment), apply(whole.inertia, unit)))
    return rows
