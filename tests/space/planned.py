"""The planar manoeuvres that several tests share, planned and compiled once in a process."""

import functools

import jax
import numpy as np

from mjx_inertia.space import (
    AS_PRINTED,
    OBJECTIVES,
    ManoeuvreSettings,
    PlanarSettings,
    costs,
    course,
    planar_dynamics,
    planar_manoeuvre,
)
from mjx_inertia.space.instant import node
from mjx_inertia.space.manoeuvre import motion_at

# costs that a planar robot has
NAMES = tuple(
    name
    for name in OBJECTIVES
    if not name.endswith(("force_z", "moment_x", "moment_y", "_turn_x", "_turn_y", "e_z", "d_z"))
)
BATCH = 64  # decisions in one call
SAMPLES = 5001  # of a motion of 50 s at 100 Hz, both ends included
SAMPLED = 4  # decisions that are sampled


@functools.cache
def consistent():
    """Some joints follow from the grasp; the system has no momentum."""
    with jax.enable_x64(True):
        return planar_manoeuvre(ManoeuvreSettings())


@functools.cache
def printed():
    """Every joint has its polynomial; base and arms have no momentum, as the thesis prints it."""
    with jax.enable_x64(True):
        return planar_manoeuvre(AS_PRINTED)


@functools.cache
def evaluated(manoeuvre):
    """A function of `BATCH` decisions: their courses, and their costs in the order of `NAMES`."""
    m = manoeuvre()

    def one(decision):
        found = course(m, decision)
        return found, costs(m, found, NAMES)

    run = jax.jit(jax.vmap(one))

    def many(decisions):
        padded = np.zeros((BATCH, m.size))
        padded[: len(decisions)] = decisions
        return jax.tree.map(lambda x: np.asarray(x)[: len(decisions)], run(padded))

    return many


@functools.cache
def sampled(manoeuvre):
    """A function of `SAMPLED` decisions: the motion and the nodes at every sample."""
    m = manoeuvre()
    tau = np.linspace(0.0, 1.0, SAMPLES)

    def one(decision):
        motion = motion_at(m, tau, decision)
        state = (motion.q, motion.qd, motion.qdd)
        nodes = jax.vmap(lambda *q: node(m.robot, m.capture, *q, m.momentum))(*state)
        return motion, nodes

    run = jax.jit(jax.vmap(one))
    return lambda decisions: jax.tree.map(np.asarray, run(decisions))


def planar_matrices(q, theta, with_object):
    """Terms of Eqs 7.1 and 7.4 by the closed form, in NumPy, with the object's mass or without."""
    settings = PlanarSettings()
    terms = planar_dynamics.planar_terms(settings, theta, q, np)
    if with_object:
        still = np.zeros((*theta.shape, 9))
        terms = terms._replace(
            H=terms.H + planar_dynamics.object_terms(settings, terms, still, np)[0]
        )
    return terms


def held_by_hands(terms):
    """Centre (x, y) and angle of the sphere as each hand has it, against the base's origin."""
    angle = terms.hands[..., 2]
    ahead = np.stack([-np.sin(angle), np.cos(angle)], -1)
    turn = angle - np.array([1.0, -1.0]) * np.pi / 2.0  # the right hand points along -x of it
    place = terms.hands[..., :2] + PlanarSettings().object_radius * ahead
    return np.concatenate([place, turn[..., None]], -1)


def wrapped(angle):
    """The same angle between -π and π."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def sampled_clearance(q):
    """Of one configuration: capsules of the links, the box of the base, the ball of the object."""
    shares = np.linspace(0.0, 1.0, 61)[:, None]
    terms = planar_matrices(q, np.zeros(()), with_object=False)
    starts = _joints(terms)
    links = [start + shares * arm for start, arm in zip(starts, terms.arms, strict=True)]
    ball = held_by_hands(terms)[0, :2]
    settings = PlanarSettings()
    radius = settings.link_radius
    found = [
        np.min(np.linalg.norm(links[i][:, None] - links[j], axis=-1)) - 2.0 * radius
        for i in range(6)
        for j in range(i + 1, 6)
        if j != i + 1 or i == 2
        if (i, j) != (2, 5)  # both hold the object
    ]
    for i in (0, 1, 3, 4):
        away = np.min(np.linalg.norm(links[i] - ball, axis=-1))
        found.append(away - radius - settings.object_radius)
    found += [np.min(_to_base(links[i])) - radius for i in (1, 2, 4, 5)]
    return min([*found, float(_to_base(ball)) - settings.object_radius])


def _joints(terms):
    """Where each link begins, against the base's origin."""
    first = [terms.shoulders[3 * k] for k in (0, 1)]
    return [first[i // 3] + terms.arms[3 * (i // 3) : i].sum(0) for i in range(6)]


def _to_base(points):
    """Distance to the square, negative inside."""
    beyond = np.abs(points) - PlanarSettings().base_side / 2.0
    inside = np.minimum(np.max(beyond, -1), 0.0)
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=-1) + inside
