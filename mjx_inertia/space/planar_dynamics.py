"""The planar robot in closed form and in inertial axes, as chapter 7 of the thesis states it.

In: `PlanarSettings` and states with any leading axes. Out: the terms of Eqs 7.1 to 7.11, corrected
as in errata 21 to 24. Every mass moves as m Jᵀ(J ẍ + J̇ ẋ): the formulas share nothing with the
recursions of `robots`, which are tested against them. `xp` is the array library, so
that the same formulas run in NumPy.
"""

from types import ModuleType
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from mjx_inertia.space.planar_model import PlanarSettings, link_moments

Array = Any  # of `xp`
_TURN = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])  # of positive joints about z
_BEFORE = np.kron(np.eye(2), np.tril(np.ones((3, 3))))  # links and the joints that turn them
_STRICTLY_BEFORE = _BEFORE - np.eye(6)


class PlanarTerms(NamedTuple):
    """Terms of Eqs 7.1 and 7.4, inertial axes; coordinates: x, y, θ of the base and six joints."""

    H: Array  # (..., 9, 9) mass matrix
    J: Array  # (..., 6, 9) Jacobian of the right and the left hand: x, y and angle of each
    hands: Array  # (..., 2, 3) x, y and angle of the hands against the base's origin
    bodies: Array  # (..., 6, 3, 9) Jacobians of the links' middles
    arms: Array  # (..., 6, 2) the links from joint to joint, m
    shoulders: Array  # (..., 6, 2) where the arm of each link begins, against the base's origin, m


class VelocityTerms(NamedTuple):
    """What the rates of the coordinates cause."""

    c: Array  # (..., 9) Coriolis and centrifugal forces of Eq. 7.1.
    Jdot_xdot: Array  # (..., 6) acceleration of the hands at zero acceleration of the coordinates


class ReducedTerms(NamedTuple):
    """Terms of Eqs 7.5 to 7.8."""

    J_g: Array  # (..., 6, 6) Generalised Jacobian
    H_el: Array  # (..., 6, 6) reduced mass matrix
    c_el: Array  # (..., 6) reduced velocity forces


def planar_terms(s: PlanarSettings, theta: Array, q: Array, xp: ModuleType = jnp) -> PlanarTerms:
    """The robot alone at base attitude `theta` (...) and joints `q` (..., 6)."""
    length = np.tile(s.link_length, 2)
    angle = theta[..., None] + (_TURN * q) @ _BEFORE.T
    arms = xp.stack([-xp.sin(angle), xp.cos(angle)], -1) * length[:, None]
    across = xp.stack([xp.cos(theta), xp.sin(theta)], -1)[..., None, :]
    up = xp.stack([-xp.sin(theta), xp.cos(theta)], -1)[..., None, :]
    side = np.repeat([1.0, -1.0], 3)[:, None] * s.shoulder[0]
    shoulders = side * across + s.shoulder[1] * up
    joint = shoulders + _STRICTLY_BEFORE @ arms
    bodies = _columns(joint + arms / 2.0, joint, _BEFORE, xp)
    tips = (joint + arms)[..., [2, 5], :]
    of_hands = _columns(tips, joint, _BEFORE[[2, 5]], xp)
    mass, moment = np.tile(s.link_mass, 2), np.tile(link_moments(s), 2)
    weight = np.stack([mass, mass, moment], -1)
    rows = bodies.reshape(*theta.shape, 18, 9)
    H = xp.swapaxes(rows * weight.reshape(18, 1), -1, -2) @ rows
    base = np.diag([s.base_mass, s.base_mass, s.base_mass * s.base_side**2 / 6.0] + [0.0] * 6)
    hands = xp.concatenate([tips, angle[..., [2, 5], None]], -1)
    J = of_hands.reshape(*theta.shape, 6, 9)
    return PlanarTerms(H + base, J, hands, bodies, arms, shoulders)


def velocity_terms(
    s: PlanarSettings, terms: PlanarTerms, rates: Array, xp: ModuleType = jnp
) -> VelocityTerms:
    """Forces and accelerations that rates (..., 9) of the coordinates cause, robot alone."""
    spin = rates[..., 2:3] + (_TURN * rates[..., 3:]) @ _BEFORE.T
    pulled = -(spin**2)[..., None] * terms.arms  # every point is pulled to what it turns about
    pulls = -(rates[..., 2] ** 2)[..., None, None] * terms.shoulders + _STRICTLY_BEFORE @ pulled
    force = np.tile(s.link_mass, 2)[:, None] * (pulls + pulled / 2.0)
    c = (terms.bodies[..., :2, :] * force[..., None]).sum((-3, -2))
    tips = (pulls + pulled)[..., [2, 5], :]
    bias = xp.concatenate([tips, xp.zeros_like(tips[..., :1])], -1)
    return VelocityTerms(c, bias.reshape(*rates.shape[:-1], 6))


def planar_momentum_map(terms: PlanarTerms, xp: ModuleType = jnp) -> Array:
    """J_a (..., 3, 6) of Eq. 7.3: twist of the base for joint rates without momentum."""
    return -xp.linalg.solve(terms.H[..., :3, :3], terms.H[..., :3, 3:])


def reduced_terms(
    terms: PlanarTerms, velocity: VelocityTerms, J_a: Array, xp: ModuleType = jnp
) -> ReducedTerms:
    """Eqs 7.5, 7.7 and 7.8 of a robot without momentum."""
    H_bm, H_m = terms.H[..., :3, 3:], terms.H[..., 3:, 3:]
    back = xp.swapaxes(J_a, -1, -2)
    c_el = velocity.c[..., 3:] + (back @ velocity.c[..., :3, None])[..., 0]
    J_g = terms.J[..., 3:] + terms.J[..., :3] @ J_a
    return ReducedTerms(J_g, H_m + xp.swapaxes(H_bm, -1, -2) @ J_a, c_el)


def planar_grasp_map(place: Array, hands: Array, xp: ModuleType = jnp) -> Array:
    """G (..., 3, 6): wrenches of both hands to one about `place` (..., 2); Murray et al. 1994."""
    levers = hands[..., :2] - place[..., None, :]
    one = xp.ones_like(levers[..., 0])
    zero = xp.zeros_like(one)
    x, y = levers[..., 0], levers[..., 1]
    rows = [[one, zero, zero], [zero, one, zero], [-y, x, one]]
    blocks = xp.stack([xp.stack(r, -1) for r in rows], -2)  # (..., 2, 3, 3)
    return xp.concatenate([blocks[..., 0, :, :], blocks[..., 1, :, :]], -1)


def object_terms(
    s: PlanarSettings, terms: PlanarTerms, rates: Array, xp: ModuleType = jnp
) -> tuple[Array, Array]:
    """H and c of the object alone, which the right hand carries.

    Args:
      s: figures.
      terms: of the robot.
      rates: (..., 9) of the coordinates.
      xp: array library.
    """
    angle = terms.hands[..., 0, 2]
    lever = s.object_radius * xp.stack([-xp.sin(angle), xp.cos(angle)], -1)
    turn = terms.J[..., 2, :]
    x, y = lever[..., 0, None], lever[..., 1, None]
    J = xp.stack([terms.J[..., 0, :] - y * turn, terms.J[..., 1, :] + x * turn, turn], -2)
    spin = (turn * rates).sum(-1)
    bias = velocity_terms(s, terms, rates, xp).Jdot_xdot[..., :2]
    pull = s.object_mass * (bias - (spin**2)[..., None] * lever)
    moment = 0.4 * s.object_mass * s.object_radius**2
    back = xp.swapaxes(J, -1, -2)
    H = (back * np.array([s.object_mass, s.object_mass, moment])) @ J
    return H, (back[..., :2] @ pull[..., None])[..., 0]


def _columns(place: Array, joint: Array, moved: Array, xp: ModuleType) -> Array:
    """Jacobians (..., l, 3, 9) of places (..., l, 2) that the joints `moved` (l, 6) turn."""
    to = place[..., :, None, :] - joint[..., None, :, :]  # (..., l, 6, 2)
    turns = moved * _TURN
    by_joint = xp.stack([-turns * to[..., 1], turns * to[..., 0], turns + 0.0 * to[..., 0]], -2)
    one, zero = xp.ones_like(place[..., 0]), xp.zeros_like(place[..., 0])
    x, y = place[..., 0], place[..., 1]
    rows = [[one, zero, -y], [zero, one, x], [zero, zero, one]]
    by_base = xp.stack([xp.stack(r, -1) for r in rows], -2)  # (..., l, 3, 3)
    return xp.concatenate([by_base, by_joint], -1)
