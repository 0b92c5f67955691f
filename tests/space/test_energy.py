"""The joints' work is the kinetic energy of robot and object: there is nothing else."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from planned import consistent, evaluated

from mjx_inertia.space import CourseStatus, planar_robot
from mjx_inertia.space.capture import with_capture
from mjx_inertia.space.dynamics import inertias, reduced_inertia
from mjx_inertia.space.instant import node
from mjx_inertia.space.planar_model import planar_capture

pytestmark = pytest.mark.long


def test_power_of_the_joints_is_the_rate_of_the_energy():
    robot, held = planar_robot(), planar_capture()
    both = with_capture(robot, held)

    def energy(q, qd):
        return 0.5 * qd @ reduced_inertia(inertias(both, q)) @ qd

    def one(q, qd, qdd):
        _, rate = jax.jvp(energy, (q, qd), (qd, qdd))
        return rate, node(robot, held, q, qd, qdd, with_total=False).torque @ qd

    rng = np.random.default_rng(0)
    q, qd, qdd = jnp.asarray(rng.uniform(-2.0, 2.0, (3, 1000, robot.dof)))
    rate, power = map(np.asarray, jax.jit(jax.vmap(one))(q, qd, qdd))
    np.testing.assert_allclose(power, rate, rtol=0, atol=1e-11 * abs(rate).max())


def test_a_manoeuvre_takes_no_work_in_all():
    """From rest to rest, as closely as the nodes resolve it."""
    m = consistent()
    decisions = np.random.default_rng(1).uniform(-2.0, 2.0, (64, m.size))
    courses, _ = evaluated(consistent)(decisions)
    kept = courses.status == CourseStatus.OK
    assert kept.sum() >= 3
    power = np.sum(courses.nodes.torque * courses.motion.qd, -1)[kept]
    work, size = power @ m.rule.weights, abs(power) @ m.rule.weights
    assert (abs(work) / size).max() < 1e-4
    assert np.median(abs(work) / size) < 1e-5
