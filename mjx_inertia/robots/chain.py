"""An arm as components: what kinematics and dynamics compute with.

In: an `Arm` and joint positions. Out: one `Joint` per joint with the turned and shifted frame and
the inertia of its link about the frame's origin. What is known of the arm while a program is traced
becomes Python floats, and zeros and ones among them cost nothing.
"""

import functools
from typing import NamedTuple, Protocol, runtime_checkable

from jaxtyping import Array, Float

from mjx_inertia.robots.arm import Arm
from mjx_inertia.spatial import AnyArray, InertialParameters, Pose
from mjx_inertia.spatial.components import (
    Component,
    Mat3,
    Vec3,
    add,
    apply,
    axis_rotation,
    components,
    mirrored,
    multiply,
    once,
    plus,
    scale,
    times,
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


class Joint(NamedTuple):
    """A joint at its position, and the link behind it."""

    rotation: Mat3  # from the link's axes to those of the link before
    offset: Vec3  # origin of the link's frame in that of the link before, m
    axis: Vec3  # unit vector in the link's frame
    prismatic: bool  # slides rather than turns


@runtime_checkable
class Jointed(Protocol):
    """What has n joints: an `Arm`, or a tree of links."""

    @property
    def T_parent_joint(self) -> Pose:
        """N poses of the joints, each in the link before, at joint position zero."""
        ...

    @property
    def axis(self) -> Float[AnyArray, "n 3"]:
        """N unit vectors in the joints' frames."""
        ...

    @property
    def prismatic(self) -> tuple[bool, ...]:
        """Which joints slide."""
        ...


def unstack(vector: Float[Array, " n"]) -> tuple[Component, ...]:
    """Entries of a vector, each a component."""
    return tuple(vector[i] for i in range(vector.shape[0]))


def joints_at(robot: Jointed, q: Vec3 | tuple[Component, ...]) -> list[Joint]:
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


def link_bodies(arm: Arm) -> list[Body]:
    """The links, what the hand holds included, about the origins of their frames."""
    masses, coms = components(arm.links.mass), components(arm.links.com)
    tensors = components(arm.links.inertia)
    bodies = [body_from(*figures) for figures in zip(masses, coms, tensors, strict=True)]
    if arm.payload is not None:
        bodies[-1] = once_body(add_bodies(bodies[-1], body_from_parameters(arm.payload)))
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


def _shift(first: Vec3, offset: Vec3) -> Mat3:
    """(first·offset) 1 - offset firstᵀ, of which the upper half is right."""
    x, y, z = (times(f, o) for f, o in zip(first, offset, strict=True))
    xy, xz, yz = (times(-1.0, times(offset[i], first[j])) for i, j in ((0, 1), (0, 2), (1, 2)))
    return mirrored((plus(y, z), xy, xz, plus(x, z), yz, plus(x, y)))


def _sum(*matrices: Mat3) -> Mat3:
    halves = zip(*map(upper_half, matrices), strict=True)
    xx, xy, xz, yy, yz, zz = (functools.reduce(plus, entries) for entries in halves)
    return mirrored((xx, xy, xz, yy, yz, zz))
