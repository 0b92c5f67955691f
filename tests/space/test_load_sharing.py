"""How the hands share a load: equilibrium, least wrenches, torques that cause the motion."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from planned import consistent

from mjx_inertia.space.dual_arm import (
    distribute_wrench,
    dual_arm_grasp_map,
    hand_wrenches,
    shared_load_torques,
)
from mjx_inertia.space.dynamics import floating_base_inverse_dynamics, hand_jacobians
from mjx_inertia.space.instant import node
from mjx_inertia.space.manoeuvre import motion_at

pytestmark = pytest.mark.long

SQUEEZE = np.array([3.0, -1.0, 0.5, -2.0, 4.0, 1.5])


@functools.cache
def shared():
    """At some instants of a manoeuvre: grasp map, wrenches, and what acts on robot and object."""
    m = consistent()
    robot, capture = m.robot, m.capture

    squeeze = jnp.asarray(SQUEEZE)

    def one(q, qd, qdd):
        instant = node(robot, capture, q, qd, qdd)
        hands = hand_wrenches(robot, capture, q, instant)
        squeezed = hand_wrenches(robot, capture, q, instant, squeeze)
        base = instant.base_twist, instant.base_acceleration
        torques = [shared_load_torques(robot, q, (qd, qdd), instant, w) for w in (hands, squeezed)]
        alone = floating_base_inverse_dynamics(robot, q, base, (qd, qdd))
        jacobians = hand_jacobians(robot, q)
        grasp = dual_arm_grasp_map(robot, capture, q)
        load = distribute_wrench(grasp, grasp @ squeeze)
        return instant, (hands, squeezed), torques, alone, jacobians, (grasp, load)

    def at_times(coefficients):
        motion = motion_at(m, np.linspace(0.05, 0.95, 19), coefficients)
        return jax.vmap(one)(motion.q, motion.qd, motion.qdd)

    return jax.tree.map(np.asarray, jax.jit(at_times)(jnp.linspace(-0.5, 0.5, m.size)))


def turned(rotation, wrench):
    return np.concatenate(
        [np.einsum("tij,tj->ti", rotation[:, :2, :2], wrench[:, :2]), wrench[:, 2:]], 1
    )


def test_the_hands_together_exert_what_moves_the_object():
    instant, wrenches, _, _, _, (grasp, _) = shared()
    wanted = turned(instant.object_rotation, instant.object_wrench)
    for hands in wrenches:
        total = np.einsum("tij,tj->ti", grasp, hands.reshape(-1, 6))
        np.testing.assert_allclose(total, wanted, rtol=0, atol=1e-12)


def test_nothing_is_squeezed_unless_asked():
    """The least wrenches are orthogonal to all that has no effect; k adds such a part only."""
    _, (least, squeezed), _, _, _, (grasp, load) = shared()
    rows = np.linalg.svd(grasp)[2][:, :3]
    inside = least.reshape(-1, 6)
    projected = np.einsum("tki,tkj,tj->ti", rows, rows, inside)
    np.testing.assert_allclose(projected, inside, rtol=0, atol=1e-12)
    np.testing.assert_allclose((squeezed - least).reshape(-1, 6), SQUEEZE - load, atol=1e-10)


def test_base_and_robot_obey_their_laws_with_the_hands_reactions():
    """The wrench that the robot alone takes at its base is what the hands' reactions are."""
    instant, (hands, _), torques, alone, (of_base, of_joints), _ = shared()
    reaction = np.einsum("thki,thk->ti", of_base, hands)
    np.testing.assert_allclose(alone.base + reaction, 0.0, atol=1e-11)
    passed = np.einsum("thki,thk->ti", of_joints, hands)
    np.testing.assert_allclose(torques[0] - passed, alone.joints, atol=1e-11)
    # all torques that cause one motion differ by what squeezes only
    assert abs(torques[1] - torques[0]).max() > 0.1
    assert np.isfinite(instant.torque).all()
