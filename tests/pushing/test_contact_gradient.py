"""Derivatives of a push in sustained contact against central differences, in float64."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.objects import cube
from mjx_inertia.pushing import SceneSettings, StraightMotion, build_scene, object_parameters
from mjx_inertia.pushing.rollout import initial_state, rollout

SAMPLES = 40  # at 100 Hz
NAMES = ("mass", "I_zz", "com_x", "com_y", "friction", "tip_friction", "tip_time_constant")
VALUE = np.array([2.0, 0.0075, 0.004, -0.006, 0.4, 0.3, 0.02])
SIZE = np.where(np.abs(VALUE) < 0.007, 0.01, VALUE)  # what a relative step refers to
GROUPS = {"force": [0, 1], "moment": [2], "position": [3, 4], "yaw": [5], "twist": [6, 7, 8]}


def signals(scene, theta):
    """Force, moment, pose and twist, (SAMPLES, 9); the path is oblique, the tip sticks."""
    nominal = object_parameters(scene.object_model, friction=0.4)
    parameters = nominal.replace(
        mass=theta[0],
        inertia=jnp.asarray(nominal.inertia).at[2].set(theta[1]),
        com=jnp.asarray(nominal.com).at[:2].set(theta[2:4]),
        friction=theta[4],
        tip_friction=theta[5],
        tip_time_constant=theta[6],
    )
    motion = StraightMotion(
        start=jnp.array([-0.08 - 1e-5, 0.02]),
        direction=jnp.array([np.cos(0.1), np.sin(0.1)]),
        speed=jnp.array(0.04),
        ramp=jnp.array(0.0),
        duration=jnp.array(9.0),
    )
    state = initial_state(scene, jnp.zeros(3), motion.start)
    _, s = rollout(scene, parameters, motion, state, jnp.int32(0), SAMPLES)
    return jnp.concatenate([s.force, s.moment[:, None], s.pose, s.twist], 1)


@pytest.mark.parametrize(
    "table", ["limit_surface", pytest.param("corners", marks=pytest.mark.slow)]
)
def test_derivatives_of_every_signal_equal_central_differences(table):
    """To 1e-3 of the largest entry of each signal's sensitivity to each parameter.

    One program gives values and derivatives, of all parameters and steps at once. Of three steps
    the mean of the two that agree best is the reference: small ones meet rounding, large ones
    kinks and curvature.
    """
    steps = np.array([1e-3, 1e-4, 1e-5])
    p = len(VALUE)
    with jax.enable_x64(True):
        scene = build_scene(cube(0.15, 2.0), SceneSettings(table=table, solver_iterations=100))
        program = jax.jit(
            jax.vmap(lambda t, d: jax.jvp(lambda x: signals(scene, x), (t,), (d,))),
            compiler_options={"xla_backend_optimization_level": 1},
        )
        signs = np.array([0.0, *steps, *-steps])
        theta = VALUE + signs[:, None, None] * np.diag(SIZE)
        along = np.tile(np.eye(p), (len(signs), 1))
        values, slopes = map(np.asarray, program(theta.reshape(-1, p), along))
    values = values.reshape(len(signs), p, SAMPLES, -1)
    slopes = slopes[:p]
    assert np.isfinite(slopes).all()
    k = len(steps)
    central = (values[1 : k + 1] - values[k + 1 :]) / (2 * steps[:, None, None, None])
    central /= SIZE[:, None, None]
    checked = 0
    for i, name in enumerate(NAMES):
        for signal, index in GROUPS.items():
            d, scale = central[:, i][..., index], np.abs(central[1, i][:, index]).max()
            if scale * SIZE[i] < 1e-6 * np.abs(values[0, i][:, index]).max():
                continue  # a sticking tip does not feel its friction
            gap = np.abs(np.diff(d, axis=0)).max(axis=(1, 2))
            best = 0.5 * (d[gap.argmin()] + d[gap.argmin() + 1])
            error = np.abs(slopes[i][:, index] - best).max() / scale
            assert error < 1e-3, (name, signal, error, gap / scale)
            checked += 1
    assert checked >= 25
