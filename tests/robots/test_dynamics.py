"""What must hold of any arm's dynamics: power, skew symmetry, derivatives, batches, compilation."""

import os
import subprocess
import sys
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference_models import states
from small_arms import small_arm

from mjx_inertia.robots import (
    baxter,
    gravity_torque,
    hand_jacobian,
    hand_pose,
    inverse_dynamics,
    mass_matrix,
    over_states,
)
from mjx_inertia.robots.dynamics import bias_force, coriolis_matrix, jacobian_rate_product

COUNT = 100


@pytest.fixture
def arm(tmp_path):
    return small_arm(tmp_path)


def test_coriolis_matrix_is_skew_with_the_rate_of_the_mass_matrix(arm):
    q, qd, _ = map(jnp.asarray, states(4, COUNT))

    @jax.jit
    @jax.vmap
    def residuals(q, qd):
        matrix = coriolis_matrix(arm, q, qd)
        rate = jax.jvp(partial(mass_matrix, arm), (q,), (qd,))[1]
        skew = rate - 2.0 * matrix
        coriolis = bias_force(arm, q, qd) - gravity_torque(arm, q)
        return skew + skew.T, matrix @ qd - coriolis

    for residual in residuals(q, qd):
        np.testing.assert_allclose(residual, 0.0, atol=1e-11)


def test_power_of_the_joints_is_the_rate_of_the_energy(arm):
    q, qd, qdd = map(jnp.asarray, states(4, COUNT))

    def kinetic(q, qd):
        return 0.5 * qd @ mass_matrix(arm, q) @ qd

    @jax.jit
    @jax.vmap
    def powers(q, qd, qdd):
        rate = jax.jvp(kinetic, (q, qd), (qd, qdd))[1] + gravity_torque(arm, q) @ qd
        return rate, inverse_dynamics(arm, q, qd, qdd) @ qd

    rate, power = powers(q, qd, qdd)
    np.testing.assert_allclose(rate, power, rtol=0, atol=1e-10 * abs(power).max())


def test_the_jacobian_is_the_derivative_of_the_hand(arm):
    q, qd, _ = map(jnp.asarray, states(4, COUNT))
    point = jnp.array([0.1, -0.2, 0.3])

    @jax.jit
    @jax.vmap
    def compared(q, qd):
        def place(q):
            return hand_pose(arm, q).apply(point)

        velocity = jax.jvp(place, (q,), (qd,))[1]
        turning = jax.jvp(lambda q: hand_pose(arm, q).rotation, (q,), (qd,))[1]
        spin = turning @ hand_pose(arm, q).rotation.T
        twist = hand_jacobian(arm, q, point) @ qd
        drift = jax.jvp(lambda q: hand_jacobian(arm, q, point) @ qd, (q,), (qd,))[1]
        expected = jnp.array([*velocity, spin[2, 1], spin[0, 2], spin[1, 0]])
        return twist - expected, jacobian_rate_product(arm, q, qd, point) - drift

    for residual in compared(q, qd):
        np.testing.assert_allclose(residual, 0.0, atol=1e-11)


@pytest.mark.slow  # two programs of derivatives to compile
def test_derivatives_in_the_state_and_in_every_figure_of_the_arm(arm):
    q, qd, qdd = (jnp.asarray(x[0]) for x in states(4, 1))

    def cost(figures, q, qd, qdd):
        changed = arm.replace(**figures)
        torque = inverse_dynamics(changed, q, qd, qdd)
        place = hand_pose(changed, q).translation
        return jnp.sum(torque**2) + jnp.sum(mass_matrix(changed, q) ** 2) + jnp.sum(place)

    figures = {
        "links": jax.tree.map(jnp.asarray, arm.links),
        "T_parent_joint": jax.tree.map(jnp.asarray, arm.T_parent_joint),
        "T_link_hand": jax.tree.map(jnp.asarray, arm.T_link_hand),
        "armature": jnp.asarray(arm.armature),
        "gravity": jnp.asarray(arm.gravity),
    }
    at = (figures, q, qd, qdd)
    rng = np.random.default_rng(0)
    along = jax.tree.map(lambda x: jnp.asarray(rng.normal(size=x.shape)), at)
    # a tensor stays symmetric: of entries below the diagonal none is read
    tensor = along[0]["links"].inertia
    along[0]["links"] = along[0]["links"].replace(inertia=tensor + tensor.swapaxes(1, 2))
    value = jax.jit(cost)
    forward = jax.jit(lambda at, along: jax.jvp(cost, at, along)[1])(at, along)
    slopes = jax.jit(jax.grad(cost, argnums=(0, 1, 2, 3)))(*at)
    reverse = sum(
        jnp.vdot(s, a) for s, a in zip(*map(jax.tree.leaves, (slopes, along)), strict=True)
    )
    step = 1e-6
    ahead, back = (
        value(*jax.tree.map(lambda x, d, h=h: x + h * d, at, along)) for h in (step, -step)
    )
    assert float(forward) == pytest.approx(float(ahead - back) / (2 * step), rel=1e-6)
    assert float(reverse) == pytest.approx(float(forward), rel=1e-10)


def test_single_precision_loses_no_more_than_its_digits(arm):
    state = states(4, COUNT)
    function = jax.jit(jax.vmap(partial(inverse_dynamics, arm)))
    exact = function(*map(jnp.asarray, state))
    with jax.enable_x64(False):
        single = function(*(jnp.asarray(x, jnp.float32) for x in state))
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, exact, rtol=0, atol=3e-6 * abs(exact).max())


@pytest.mark.parametrize("count", [1, 7, 16, 33])
def test_blocks_give_what_vmap_gives(arm, count):
    q, qd, _ = map(jnp.asarray, states(4, count))

    def one(q, qd, scale):
        return {"matrix": scale * mass_matrix(arm, q), "speed": qd @ qd}

    scale = jnp.arange(count, dtype=q.dtype)
    blocks = jax.jit(over_states(one, block=8))(q, qd, scale)
    expected = jax.jit(jax.vmap(one))(q, qd, scale)
    np.testing.assert_allclose(blocks["matrix"], expected["matrix"], atol=1e-12)
    np.testing.assert_allclose(blocks["speed"], expected["speed"], atol=1e-12)


def test_blocks_are_shared_over_devices():
    program = """
import jax, jax.numpy as jnp
from mjx_inertia import runtime
runtime.configure(devices=2)
from mjx_inertia.robots import over_states
x = jnp.arange(21.0).reshape(7, 3)
result = jax.jit(over_states(lambda x: jnp.stack([x[0] + x[1], x[2]]), block=2))(x)
assert (result == jnp.stack([x[:, 0] + x[:, 1], x[:, 2]], 1)).all()
print(len(result.sharding.device_set))
"""
    environment = os.environ | {"JAX_PLATFORMS": "cpu"}
    ran = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert ran.stdout.strip() == "2"


def test_a_batch_compiles_once():
    arm, traces = baxter(), []

    def one(q):
        traces.append(q)
        return hand_pose(arm, q).translation

    run = jax.jit(over_states(one, block=4))
    for seed in range(3):
        run(jnp.asarray(states(7, 9, seed)[0]))
    assert len(traces) == 1


def test_states_of_another_length_are_told(arm):
    with pytest.raises(ValueError, match=r"`q` has shape \(3,\), but small has 4 joints"):
        bias_force(arm, jnp.zeros(3), jnp.zeros(3))
    with pytest.raises(ValueError, match="share one leading axis"):
        over_states(lambda a, b: a + b)(jnp.zeros(3), jnp.zeros(4))
