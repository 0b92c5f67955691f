"""The recursions along an arm, in components: what the functions of arrays are made of.

In: an `Arm` and rows of components, one per joint (see `spatial/components.py`). Out: rows of
components. Several of them in one program share what they have in common. Each intermediate that
more than one expression reads is marked to be computed once; without that XLA's CPU compiler
repeats such expressions inside each other, and both the program and its compilation grow a
hundredfold.
"""

from jaxtyping import Array, Float

from mjx_inertia.robots.arm import Arm
from mjx_inertia.robots.chain import Frame, add_bodies, joints_at, link_bodies, once_body
from mjx_inertia.robots.link_motion import (
    acceleration_gradient,
    body_in_parent,
    joint_momentum,
    link_acceleration,
    newton_euler_wrench,
    project_on_axis,
    wrench_in_parent,
)
from mjx_inertia.spatial.components import (
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
    transpose,
)

Row = tuple[Component, ...]
Columns = list[tuple[Vec3, Vec3]]  # linear, angular; one pair for each joint


def zeros(arm: Arm) -> Row:
    """Zeros that are known: what stands still costs nothing."""
    return (0.0,) * arm.dof


def link_frames(arm: Arm, q: Row) -> list[Frame]:
    """The links in the world."""
    rotation = components(arm.T_world_base.rotation)
    origin = components(arm.T_world_base.translation)
    frames = []
    for joint in joints_at(arm, q):
        origin = once(add(origin, apply(rotation, joint.offset)))
        rotation = once(multiply(rotation, joint.rotation))
        frames.append(Frame(rotation, origin))
    return frames


def hand_frame(arm: Arm, last: Frame) -> Frame:
    """The hand in the world, from the last link there."""
    rotation = components(arm.T_link_hand.rotation)
    offset = components(arm.T_link_hand.translation)
    origin = once(add(last.origin, apply(last.rotation, offset)))
    return Frame(once(multiply(last.rotation, rotation)), origin)


def hand_point(arm: Arm, last: Frame, point: Float[Array, "3"] | None) -> Vec3:
    """A point of the hand, given in its frame (its origin if None), in the world."""
    hand = hand_frame(arm, last)
    if point is None:
        return hand.origin
    return once(add(hand.origin, apply(hand.rotation, components(point))))


def jacobian_columns(arm: Arm, frames: list[Frame], place: Vec3) -> Columns:
    """The Jacobian's columns, in world axes, of the place `place` (m, world) on the hand."""
    columns: Columns = []
    for frame, axis, slides in zip(frames, components(arm.axis), arm.prismatic, strict=True):
        along = once(apply(frame.rotation, axis))
        if slides:
            columns.append((along, ZERO))
        else:
            columns.append((once(cross(along, subtract(place, frame.origin))), along))
    return columns


def jacobian_rate_twist(columns: Columns, qd: Row) -> tuple[Vec3, Vec3]:
    """J̇ q̇: acceleration of the place on the hand, and of its turning, at q̈ = 0.

    A joint turns the axes and levers of all behind it, ċ = ω × c with ω of the joints before, and
    the lever of its own turns with the hand's velocity relative to it.
    """
    caused = [
        (once(scale(speed, linear)), once(scale(speed, angular)))
        for speed, (linear, angular) in zip(qd, columns, strict=True)
    ]
    behind = [ZERO]  # velocity of the place that this joint and those behind it cause
    for own, _ in reversed(caused):
        behind.append(once(add(behind[-1], own)))
    omega, linear, angular = ZERO, ZERO, ZERO
    for (own, turn), relative in zip(caused, reversed(behind[1:]), strict=True):
        linear = add(linear, cross(omega, own), cross(turn, relative))
        angular = add(angular, cross(omega, turn))
        omega, linear, angular = once((add(omega, turn), linear, angular))
    return linear, angular


def newton_euler(arm: Arm, q: Row, qd: Row, qdd: Row) -> Row:
    """Joint torques that give the accelerations `qdd`.

    Luh, Walker and Paul 1980, with inertias about the frames' origins.
    """
    joints, bodies = joints_at(arm, q), link_bodies(arm)
    base = transpose(components(arm.T_world_base.rotation))
    # the base falls upwards instead of the links being pulled down
    linear = scale(-1.0, apply(base, components(arm.gravity)))
    omega, alpha, gradient = ZERO, ZERO, (ZERO, ZERO, ZERO)
    wrenches: list[tuple[Vec3, Vec3]] = []
    for joint, body, speed, acceleration in zip(joints, bodies, qd, qdd, strict=True):
        linear = once(add(linear, apply(gradient, joint.offset)))
        omega, alpha, linear = link_acceleration(joint, omega, alpha, linear, speed, acceleration)
        gradient = once(acceleration_gradient(omega, alpha))
        wrenches.append(newton_euler_wrench(body, omega, alpha, linear, gradient))
    drives = components(arm.armature)
    torques: list[Component] = [0.0] * arm.dof
    force, moment = ZERO, ZERO
    for i in reversed(range(arm.dof)):
        f, n = wrenches[i]
        if i + 1 < arm.dof:
            carried = wrench_in_parent(joints[i + 1], force, moment)
            f, n = add(f, carried[0]), add(n, carried[1])
        force, moment = once((f, n))
        along = project_on_axis(joints[i], force, moment)
        torques[i] = once(plus(along, times(drives[i], qdd[i])))
    return tuple(torques)


def composite_bodies(arm: Arm, q: Row) -> list[Row]:
    """Rows of the joint-space mass matrix, armature included.

    Featherstone 2008, Table 6.2.
    """
    joints, bodies = joints_at(arm, q), link_bodies(arm)
    drives = components(arm.armature)
    matrix: list[list[Component]] = [[0.0] * arm.dof for _ in range(arm.dof)]
    composite = bodies[-1]
    for i in reversed(range(arm.dof)):
        force, moment = once(joint_momentum(joints[i], composite))
        matrix[i][i] = once(plus(drives[i], project_on_axis(joints[i], force, moment)))
        for j in reversed(range(i)):
            force, moment = once(wrench_in_parent(joints[j + 1], force, moment))
            matrix[i][j] = matrix[j][i] = once(project_on_axis(joints[j], force, moment))
        if i:
            composite = once_body(add_bodies(bodies[i - 1], body_in_parent(joints[i], composite)))
    return [tuple(entries) for entries in matrix]
