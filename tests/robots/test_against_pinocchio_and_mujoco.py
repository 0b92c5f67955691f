"""Kinematics and dynamics against Pinocchio and C MuJoCo at random states."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pinocchio
import pytest
from arm_dynamics import dynamics
from reference_models import (
    assert_same,
    baxter_urdf,
    by_mujoco,
    by_pinocchio,
    lwa4d_urdf,
    mujoco_of,
    states,
)

from mjx_inertia.robots import (
    baxter,
    inverse_dynamics,
    lwa4d,
    mass_matrix,
)

ARMS = {
    "baxter left": (lambda: baxter("left", "bare"), lambda: baxter_urdf("left")),
    "baxter right": (lambda: baxter("right", "bare"), lambda: baxter_urdf("right")),
    "lwa4d": (lwa4d, lambda: lwa4d_urdf("mesh_estimate")),
    "lwa4d commented": (
        lambda: lwa4d("upstream_commented"),
        lambda: lwa4d_urdf("upstream_commented"),
    ),
}
STATES = states(7)


@pytest.mark.long
@pytest.mark.parametrize("name", ARMS)
def test_published_arms_are_those_of_pinocchio(name):
    arm, urdf = (make() for make in ARMS[name])
    ours, more = dynamics(arm, STATES)
    model = pinocchio.buildModelFromXML(urdf)
    assert_same(ours, by_pinocchio(model, "flange", *STATES))
    np.testing.assert_allclose(more["acceleration"], STATES[2], atol=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("make", [baxter, lambda: lwa4d(hand="parallel_jaw")])
def test_generated_mjcf_is_the_arm(make):
    arm = make()
    arm = arm.replace(armature=np.linspace(0.01, 0.2, 7))
    ours, more = dynamics(arm, STATES)
    model = mujoco_of(arm)
    assert_same(ours, by_mujoco(model, "hand", *STATES))
    data = mujoco.MjData(model)
    data.qpos[:] = STATES[0][0]
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(more["links"].translation[0], data.xpos[2:], atol=1e-12)
    frames = data.xmat[2:].reshape(-1, 3, 3)
    np.testing.assert_allclose(more["links"].rotation[0], frames, atol=1e-12)


@pytest.mark.long
def test_a_known_arm_is_folded_to_the_same_numbers():
    arm = baxter("left", "bare")
    q, qd, qdd = map(jnp.asarray, STATES)
    folded = jax.vmap(lambda *s: (inverse_dynamics(arm, *s), mass_matrix(arm, s[0])))
    ours, _ = dynamics(arm, STATES)
    torque, matrix = jax.jit(folded)(q, qd, qdd)
    np.testing.assert_allclose(torque, ours.torque, rtol=0, atol=1e-11)
    np.testing.assert_allclose(matrix, ours.mass_matrix, rtol=0, atol=1e-12)
