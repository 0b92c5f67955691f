"""The quasi-static laws that a slow push obeys: load of a sliding object, and how it moves.

Thesis §3.6 (Mason 1986, Goyal et al. 1991, Lynch et al. 1992). In: pressure, friction, contact.
Out: loads and twists. One object; planar quantities at the CoM, world axes: a load is (f_x, f_y,
m), a twist (u_x, u_y, ω), `lever` runs from the CoM to the contact point, and the contact point
moves at (u_x - ω r_y, u_y + ω r_x).
"""

import enum

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float, Int

_TINY = 1e-12


class ContactMode(enum.IntEnum):
    """What the contact point does when the object is pushed."""

    STICKING = 0
    SLIDING_LEFT = 1  # along the tangent that lies 90° to the left of the inward normal
    SLIDING_RIGHT = 2
    SEPARATING = 3  # the tip moves away


@struct.dataclass
class PushedTwist:
    """How a pushed object moves: its twist, (m/s, m/s, rad/s), and a `ContactMode`."""

    twist: Float[Array, "3"]
    mode: Int[Array, ""]


def contact_velocity(twist: Float[Array, "3"], lever: Float[Array, "2"]) -> Float[Array, "2"]:
    """Velocity of the point at `lever`, m/s. Thesis Eq. 3.9 (errata 6)."""
    return jnp.stack([twist[0] - twist[2] * lever[1], twist[1] + twist[2] * lever[0]])


def frictional_load(
    twist: Float[Array, "3"],
    points: Float[Array, "n 2"],
    normal_force: Float[Array, " n"],
    friction: Float[Array, ""] | float,
) -> Float[Array, "3"]:
    """Load of the table on the object for any pressure distribution. Thesis Eq. 3.6.

    Args:
      twist: of the object at the CoM; it must move.
      points: of support, from the CoM, m.
      normal_force: on each, N.
      friction: coefficient.
    """
    velocity = twist[:2] + twist[2] * jnp.stack([-points[:, 1], points[:, 0]], -1)
    speed_sq = jnp.sum(velocity**2, -1)
    # a point at the centre of rotation does not slide and bears no definite load
    moves = speed_sq > _TINY * jnp.max(speed_sq)
    speed = jnp.sqrt(jnp.where(moves, speed_sq, 1.0))
    share = jnp.where(moves, -friction * normal_force / speed, 0.0)
    force = share[:, None] * velocity
    moment = jnp.sum(points[:, 0] * force[:, 1] - points[:, 1] * force[:, 0])
    return jnp.append(force.sum(0), moment)


def support_radius(
    points: Float[Array, "n 2"], normal_force: Float[Array, " n"]
) -> Float[Array, ""]:
    """C = m_max / f_max of a pressure distribution, m: mean distance from the CoM. Errata 5."""
    return jnp.sum(jnp.linalg.norm(points, axis=-1) * normal_force) / jnp.sum(normal_force)


def ellipsoidal_limit_surface(
    load: Float[Array, "3"], max_force: Float[Array, ""] | float, c: Float[Array, ""] | float
) -> Float[Array, ""]:
    """Limit surface as an ellipsoid: 1 on it, below 1 where the object rests. Thesis Eq. 3.7."""
    return (load[0] ** 2 + load[1] ** 2 + (load[2] / c) ** 2) / max_force**2


def load_to_twist(load: Float[Array, "3"], c: Float[Array, ""] | float) -> Float[Array, "3"]:
    """Direction of motion under a load on the ellipsoid, not normalised. Thesis Eq. 3.8."""
    return load / jnp.stack([jnp.ones(()), jnp.ones(()), jnp.asarray(c) ** 2])


def sticking_twist(
    velocity: Float[Array, "2"], lever: Float[Array, "2"], c: Float[Array, ""] | float
) -> Float[Array, "3"]:
    """Twist of an object whose contact point moves at `velocity`. Thesis Eq. 3.10."""
    (x, y), (px, py) = lever, velocity
    scale = 1.0 / (c**2 + x**2 + y**2)
    ux = ((c**2 + x**2) * px + x * y * py) * scale
    uy = ((c**2 + y**2) * py + x * y * px) * scale
    return jnp.stack([ux, uy, (x * uy - y * ux) / c**2])


def motion_cone(
    lever: Float[Array, "2"],
    normal: Float[Array, "2"],
    tip_friction: Float[Array, ""] | float,
    c: Float[Array, ""] | float,
) -> Float[Array, "2 2"]:
    """Contact velocities under the two edges of the friction cone: left one, then right one.

    Args:
      lever: from the CoM to the contact, m.
      normal: inward unit normal.
      tip_friction: between tip and object.
      c: m_max / f_max, m.
    """
    left = jnp.stack([-normal[1], normal[0]])
    edges = jnp.stack([normal + tip_friction * left, normal - tip_friction * left])
    moments = lever[0] * edges[:, 1] - lever[1] * edges[:, 0]
    loads = jnp.concatenate([edges, moments[:, None]], -1)
    return jnp.stack([contact_velocity(load_to_twist(load, c), lever) for load in loads])


def pushed_twist(
    tip_velocity: Float[Array, "2"],
    lever: Float[Array, "2"],
    normal: Float[Array, "2"],
    tip_friction: Float[Array, ""] | float,
    c: Float[Array, ""] | float,
) -> PushedTwist:
    """Quasi-static motion of an object under a tip: sticking, sliding or separating.

    Inside the motion cone the contact sticks. Outside, the object moves as on the nearer edge of
    the cone, as fast as keeps the contact closed: u_o = k u_b, k = (u_p n)/(u_b n) (thesis §3.6).

    Args:
      tip_velocity: m/s.
      lever: from the CoM to the contact, m.
      normal: inward unit normal at the contact.
      tip_friction: between tip and object.
      c: m_max / f_max, m.
    """
    cone = motion_cone(lever, normal, tip_friction, c)

    def cross(a: Float[Array, "2"], b: Float[Array, "2"]) -> Float[Array, ""]:
        return a[0] * b[1] - a[1] * b[0]

    approach = tip_velocity @ normal
    beyond_left = cross(cone[0], tip_velocity) > 0
    beyond_right = cross(cone[1], tip_velocity) < 0
    edge = jnp.where(beyond_left, cone[0], cone[1])
    along = edge * approach / (edge @ normal)
    sliding = beyond_left | beyond_right
    velocity = jnp.where(approach > 0, jnp.where(sliding, along, tip_velocity), 0.0)
    mode = jnp.where(
        beyond_left,
        ContactMode.SLIDING_LEFT,
        jnp.where(beyond_right, ContactMode.SLIDING_RIGHT, ContactMode.STICKING),
    )
    mode = jnp.where(approach > 0, mode, ContactMode.SEPARATING)
    return PushedTwist(sticking_twist(velocity, lever, c), mode)
