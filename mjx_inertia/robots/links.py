"""One joint and the link behind it, in components: what the recursions along a robot are made of.

Motion goes outward along a tree, wrenches and inertias come back. In: a `Robot` and joint
positions. Out: joints at their positions, bodies about the origins of their frames, and what one
joint does to them, in the axes of the link or of the link before. What is known of the robot while
a program is traced becomes Python floats, and zeros and ones among them cost nothing.
"""

import functools
from typing import NamedTuple

from jaxtyping import Array, Float

from mjx_inertia.robots.robot import Robot
from mjx_inertia.spatial import InertialParameters, Pose
from mjx_inertia.spatial.components import (
    Component,
    Mat3,
    Vec3,
    add,
    apply,
    axis_rotation,
    components,
    cross,
    dot,
    minus,
    mirrored,
    multiply,
    once,
    plus,
    scale,
    symmetric_change,
    times,
    transpose,
    upper_half,
)


class Body(NamedTuple):
    """Inertia of a rigid body about the origin of a frame, in its axes; such inertias add."""

    mass: Component  # kg
    moment: Vec3  # first moment, mass times centre of mass, kg m
    inertia: Mat3  # inertia tensor about the origin, kg m²


class Frame(NamedTuple):
    """A frame in another: its axes there as columns, and its origin there (m)."""

    rotation: Mat3
    origin: Vec3


class LinkMotion(NamedTuple):
    """Velocity and acceleration of a link in its own axes."""

    omega: Vec3  # angular velocity, rad/s
    alpha: Vec3  # angular acceleration, rad/s²
    linear: Vec3  # acceleration of the frame's origin, m/s²


class Joint(NamedTuple):
    """A joint at its position, and the link behind it."""

    rotation: Mat3  # from the link's axes to those of the link before
    offset: Vec3  # origin of the link's frame in that of the link before, m
    axis: Vec3  # unit vector in the link's frame
    prismatic: bool  # slides rather than turns


def unstack(vector: Float[Array, " n"]) -> tuple[Component, ...]:
    """Entries of a vector, each a component."""
    return tuple(vector[i] for i in range(vector.shape[0]))


def joints_at(robot: Robot, q: Vec3 | tuple[Component, ...]) -> list[Joint]:
    """The joints at positions `q` (rad; m where prismatic)."""
    rotations = components(robot.T_parent_joint.rotation)
    offsets = components(robot.T_parent_joint.translation)
    joints = []
    for rotation, offset, axis, slides, position in zip(
        rotations, offsets, components(robot.axis), robot.prismatic, q, strict=True
    ):
        if slides:
            along = once(add(offset, scale(position, apply(rotation, axis))))
            joints.append(Joint(rotation, along, axis, True))
        else:
            turned = once(multiply(rotation, axis_rotation(axis, position)))
            joints.append(Joint(turned, offset, axis, False))
    return joints


def frame_of(T: Pose) -> Frame:
    """A pose as components."""
    return Frame(components(T.rotation), components(T.translation))


def compose_frames(before: Frame, frame: Frame) -> Frame:
    """A frame given in another, in what the other is given in."""
    origin = once(add(before.origin, apply(before.rotation, frame.origin)))
    return Frame(once(multiply(before.rotation, frame.rotation)), origin)


def link_bodies(robot: Robot) -> list[Body]:
    """The links, what the first hand holds included, about the origins of their frames."""
    masses, coms = components(robot.links.mass), components(robot.links.com)
    tensors = components(robot.links.inertia)
    bodies = [body_from(*figures) for figures in zip(masses, coms, tensors, strict=True)]
    if robot.payload is not None:
        i = robot.hands[0]
        bodies[i] = once_body(add_bodies(bodies[i], body_from_parameters(robot.payload)))
    return bodies


def body_from_parameters(params: InertialParameters) -> Body:
    """One body about the origin of its frame."""
    return body_from(*map(components, (params.mass, params.com, params.inertia)))


def add_bodies(a: Body, b: Body) -> Body:
    """Two bodies in one frame as one."""
    inertia = _sum(a.inertia, b.inertia)
    return Body(plus(a.mass, b.mass), add(a.moment, b.moment), inertia)


def shift_origin(body: Body, offset: Vec3) -> Body:
    """The body about the origin of a frame with the same axes in which its own lies at `offset`."""
    # with m c' = m c + m r: I + (m c·r + r·m c') 1 - r m cᵀ - m c' rᵀ (parallel axes)
    moment = once(add(body.moment, scale(body.mass, offset)))
    tensor = _sum(body.inertia, _shift(body.moment, offset), _shift(offset, moment))
    return Body(body.mass, moment, tensor)


def once_body(body: Body) -> Body:
    """The same body, each component computed in one place."""
    mass, moment, half = once((body.mass, body.moment, upper_half(body.inertia)))
    return Body(mass, moment, mirrored(half))


def body_from(mass: Component, com: Vec3, tensor: Mat3) -> Body:
    """A body from its mass, centre of mass and tensor about it."""
    moment = scale(mass, com)
    # parallel axes: Featherstone 2008, Eq. 2.63
    return Body(mass, moment, _sum(tensor, _shift(moment, com)))


def link_acceleration(
    joint: Joint, before: LinkMotion, speed: Component, acceleration: Component
) -> LinkMotion:
    """Motion of a link from that of the link before, whose `linear` is at the joint."""
    back = transpose(joint.rotation)
    omega, alpha = once(apply(back, before.omega)), apply(back, before.alpha)
    linear = apply(back, before.linear)
    own_speed, own_acceleration = scale(speed, joint.axis), scale(acceleration, joint.axis)
    if joint.prismatic:
        linear = add(linear, own_acceleration, scale(2.0, cross(omega, own_speed)))
    else:
        alpha = add(alpha, own_acceleration, cross(omega, own_speed))
        omega = add(omega, own_speed)
    return LinkMotion(*once((omega, alpha, linear)))


def acceleration_gradient(motion: LinkMotion) -> Mat3:
    """[α]× + [ω]×²: the acceleration of a link's point grows with its place as this matrix."""
    (x, y, z), alpha, _ = motion
    xx, yy, zz = times(x, x), times(y, y), times(z, z)
    xy, xz, yz = times(x, y), times(x, z), times(y, z)
    return (
        (times(-1.0, plus(yy, zz)), minus(xy, alpha[2]), plus(xz, alpha[1])),
        (plus(xy, alpha[2]), times(-1.0, plus(xx, zz)), minus(yz, alpha[0])),
        (minus(xz, alpha[1]), plus(yz, alpha[0]), times(-1.0, plus(xx, yy))),
    )


def newton_euler_wrench(body: Body, motion: LinkMotion, gradient: Mat3) -> tuple[Vec3, Vec3]:
    """Force and moment about the frame's origin that a link's motion takes: Newton and Euler."""
    force = add(scale(body.mass, motion.linear), apply(gradient, body.moment))
    gyroscopic = cross(motion.omega, once(apply(body.inertia, motion.omega)))
    lever = cross(body.moment, motion.linear)
    return force, add(apply(body.inertia, motion.alpha), gyroscopic, lever)


def wrench_in_parent(joint: Joint, force: Vec3, moment: Vec3) -> tuple[Vec3, Vec3]:
    """A wrench at the link of `joint` as one at the link before."""
    force = once(apply(joint.rotation, force))
    return force, add(apply(joint.rotation, moment), cross(joint.offset, force))


def joint_momentum(joint: Joint, body: Body) -> tuple[Vec3, Vec3]:
    """Momentum and angular momentum about the origin of a body that a joint moves at unit speed."""
    if joint.prismatic:
        return scale(body.mass, joint.axis), cross(body.moment, joint.axis)
    return cross(joint.axis, body.moment), apply(body.inertia, joint.axis)


def project_on_axis(joint: Joint, force: Vec3, moment: Vec3) -> Component:
    return dot(joint.axis, force if joint.prismatic else moment)


def body_in_parent(joint: Joint, body: Body) -> Body:
    """A body that `joint` carries, about the origin and in the axes of the link before."""
    moment = once(apply(joint.rotation, body.moment))
    turned = Body(body.mass, moment, symmetric_change(joint.rotation, body.inertia))
    return shift_origin(turned, joint.offset)


def _shift(first: Vec3, offset: Vec3) -> Mat3:
    """(first·offset) 1 - offset firstᵀ, of which the upper half is right."""
    x, y, z = (times(f, o) for f, o in zip(first, offset, strict=True))
    xy, xz, yz = (times(-1.0, times(offset[i], first[j])) for i, j in ((0, 1), (0, 2), (1, 2)))
    return mirrored((plus(y, z), xy, xz, plus(x, z), yz, plus(x, y)))


def _sum(*matrices: Mat3) -> Mat3:
    halves = zip(*map(upper_half, matrices), strict=True)
    xx, xy, xz, yy, yz, zz = (functools.reduce(plus, entries) for entries in halves)
    return mirrored((xx, xy, xz, yy, yz, zz))
