"""Eqs 7.9 to 7.11 along motions that both hands follow, against Newton's law of the object."""

import jax
import jax.numpy as jnp
import numpy as np
import planned
import pytest

from mjx_inertia.space import PlanarSettings, planar_dynamics
from mjx_inertia.space.capture import MOMENTA, with_capture
from mjx_inertia.space.dual_arm import dual_arm_grasp_map, object_dynamics, object_to_joints
from mjx_inertia.space.dynamics import generalized_jacobian
from mjx_inertia.space.instant import node

pytestmark = pytest.mark.long

OBJECT = np.array([10.0, 10.0, 0.64])  # kg, kg m²
EIGHT = 8


@pytest.fixture(scope="module")
def states():
    """Positions, rates and accelerations on the way of some decisions, one row a state."""
    rows = np.random.default_rng(4).uniform(-0.5, 0.5, (EIGHT, 6))
    with jax.enable_x64(True):
        found = planned.evaluated(planned.consistent)(rows)[0]
    assert np.all(found.status == 0)
    motion = (found.motion.q, found.motion.qd, found.motion.qdd)
    return tuple(x[:, ::2].reshape(-1, 6) for x in motion)


@pytest.fixture(scope="module")
def terms(states):
    """Everything that the tests read, for both models of momentum."""
    m = planned.consistent()

    def one(q, qd, qdd):
        found, G = {}, dual_arm_grasp_map(m.robot, m.capture, q)
        for momentum in MOMENTA:
            J_g = generalized_jacobian(with_capture(m.robot, m.capture, momentum), q)
            twist = jnp.linalg.pinv(G.T) @ (J_g @ qd)
            found[momentum] = {
                "slip": G.T @ twist - J_g @ qd,
                "twist": twist,
                "rates": object_to_joints(m.robot, m.capture, q, momentum) @ twist,
                "dynamics": object_dynamics(m.robot, m.capture, q, twist, momentum),
                "node": node(m.robot, m.capture, q, qd, qdd, momentum),
            }
        return found

    with jax.enable_x64(True):
        return jax.tree.map(np.asarray, jax.jit(jax.vmap(one))(*states))


def in_base(instant, wrench):
    """A wrench in the object's axes, in those of the base."""
    return np.einsum("nij,nj->ni", instant.object_rotation, wrench)


@pytest.mark.parametrize("momentum", MOMENTA)
def test_the_object_moves_as_newton_and_equation_7_9_say(momentum, terms):
    """Λ_tot ẍ + μ_tot = F_tot (errata 24), ẍ from the object's own wrench."""
    found = terms[momentum]
    instant, dynamics = found["node"], found["dynamics"]
    acceleration = in_base(instant, instant.object_wrench) / OBJECT
    ours = np.einsum("nij,nj->ni", dynamics.inertia, acceleration) + dynamics.velocity_wrench
    total = in_base(instant, instant.total_wrench)
    assert np.max(np.abs(ours - total)) < 1e-10 * np.max(np.abs(total))
    # velocity forces are no small part of that: the test would see them missing
    assert np.max(np.abs(dynamics.velocity_wrench)) > 1e-3 * np.max(np.abs(total))


@pytest.mark.parametrize("momentum", MOMENTA)
def test_joints_follow_the_object(momentum, states, terms):
    """J_g q̇ = Gᵀ ẋ has a solution on such a motion, and B finds the rates from it."""
    found = terms[momentum]
    assert np.max(np.abs(found["slip"])) < 1e-12
    np.testing.assert_allclose(found["rates"], states[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("momentum", MOMENTA)
def test_inertia_at_the_object(momentum, states, terms):
    """Eq. 7.10 by the closed form; symmetric and positive definite."""
    ours = terms[momentum]["dynamics"].inertia
    assert np.max(np.abs(ours - np.swapaxes(ours, 1, 2))) < 1e-11 * np.max(np.abs(ours))
    assert np.min(np.linalg.eigvalsh(ours)) > 0.0
    q, zero = states[0], np.zeros(len(states[0]))
    planar = planned.planar_matrices(q, zero, with_object=momentum == "system")
    velocity = planar_dynamics.velocity_terms(PlanarSettings(), planar, np.zeros((len(q), 9)), np)
    J_a = planar_dynamics.planar_momentum_map(planar, np)
    reduced = planar_dynamics.reduced_terms(planar, velocity, J_a, np)
    place = planned.held_by_hands(planar)[:, 0, :2]
    G = planar_dynamics.planar_grasp_map(place, planar.hands, np)
    B = np.linalg.solve(reduced.J_g, np.swapaxes(G, 1, 2))
    wanted = np.swapaxes(B, 1, 2) @ reduced.H_el @ B
    if momentum == "robot":
        wanted = wanted + np.diag(OBJECT)
    np.testing.assert_allclose(ours, wanted, rtol=1e-9, atol=1e-9)


def test_an_unknown_model_of_momentum():
    m = planned.consistent()
    with pytest.raises(ValueError, match="`momentum` is 'none': expected system or robot"):
        object_dynamics(m.robot, m.capture, jnp.zeros(6), jnp.zeros(3), "none")
