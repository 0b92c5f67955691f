"""One joint and the link behind it: motion goes outward, wrenches and inertias come back.

What recursions along arms and along free-floating trees are made of. In and out: components (see
`spatial/components.py`) in the axes of the link, or of the link before.
"""

from mjx_inertia.robots.chain import Body, Joint, shift_origin
from mjx_inertia.spatial.components import (
    Component,
    Mat3,
    Vec3,
    add,
    apply,
    cross,
    dot,
    minus,
    once,
    plus,
    scale,
    symmetric_change,
    times,
    transpose,
)


def link_acceleration(
    joint: Joint, omega: Vec3, alpha: Vec3, linear: Vec3, speed: Component, acceleration: Component
) -> tuple[Vec3, Vec3, Vec3]:
    """Velocity and acceleration of a link from those of the link before, in its own axes."""
    back = transpose(joint.rotation)
    omega, alpha, linear = once(apply(back, omega)), apply(back, alpha), apply(back, linear)
    own_speed, own_acceleration = scale(speed, joint.axis), scale(acceleration, joint.axis)
    if joint.prismatic:
        linear = add(linear, own_acceleration, scale(2.0, cross(omega, own_speed)))
    else:
        alpha = add(alpha, own_acceleration, cross(omega, own_speed))
        omega = add(omega, own_speed)
    return once((omega, alpha, linear))


def acceleration_gradient(omega: Vec3, alpha: Vec3) -> Mat3:
    """[α]× + [ω]×²: the acceleration of a link's point grows with its place as this matrix."""
    x, y, z = omega
    xx, yy, zz = times(x, x), times(y, y), times(z, z)
    xy, xz, yz = times(x, y), times(x, z), times(y, z)
    return (
        (times(-1.0, plus(yy, zz)), minus(xy, alpha[2]), plus(xz, alpha[1])),
        (plus(xy, alpha[2]), times(-1.0, plus(xx, zz)), minus(yz, alpha[0])),
        (minus(xz, alpha[1]), plus(yz, alpha[0]), times(-1.0, plus(xx, yy))),
    )


def newton_euler_wrench(
    body: Body, omega: Vec3, alpha: Vec3, linear: Vec3, gradient: Mat3
) -> tuple[Vec3, Vec3]:
    """Force and moment about the frame's origin that a link's motion takes: Newton and Euler."""
    force = add(scale(body.mass, linear), apply(gradient, body.moment))
    gyroscopic = cross(omega, once(apply(body.inertia, omega)))
    moment = add(apply(body.inertia, alpha), gyroscopic, cross(body.moment, linear))
    return force, moment


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
