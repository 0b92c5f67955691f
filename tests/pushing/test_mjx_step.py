"""The differentiable step on scenes that are no pushes: values of MuJoCo, derivatives that hold."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from mjx_inertia.pushing import differentiable_step
from mjx_inertia.pushing.quiet_mjx import mjx

STEPS = 50
HEAD = """
<mujoco>
  <option timestep="0.004" cone="elliptic" iterations="100" ls_iterations="50" tolerance="0"
    impratio="2"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1"/>
"""
# A ball that rolls and slides on a contact of condim 6 and runs into the limit of a joint, while an
# equality drives it sideways.
BALL = f"""{HEAD}
    <body name="cart" pos="0 0 0.1">
      <joint name="x" type="slide" axis="1 0 0" range="-1 0.12" limited="true"/>
      <joint name="y" type="slide" axis="0 1 0" damping="0.1"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="roll" axis="0 1 0"/>
      <inertial pos="0.01 0.02 -0.01" mass="2" diaginertia="0.01 0.012 0.014"/>
      <geom name="a" size="0.1"/>
    </body>
  </worldbody>
  <contact><pair geom1="floor" geom2="a" condim="6" friction="0.3 0.3 0.02 0.01 0.01"/></contact>
  <equality><joint joint1="y" joint2="x" polycoef="0 0.2 0.05 0 0"/></equality>
</mujoco>
"""
# A free body on feet of condim 3, 4 and 6 (MJX has no elliptic cone of condim 1); beside it a hinge
# swings into its limit and drives a slide.
FEET = f"""{HEAD}
    <body name="cart" pos="0 0 0.1">
      <freejoint/>
      <inertial pos="0.01 -0.02 0.03" mass="2" diaginertia="0.02 0.03 0.04"/>
      <geom name="a" size="0.1" pos="0.2 0 0"/>
      <geom name="b" size="0.1" pos="-0.2 0.2 0"/>
      <geom name="c" size="0.1" pos="-0.2 -0.2 0"/>
    </body>
    <body pos="0 0 2">
      <joint name="hinge" axis="0 1 0" range="-60 20" limited="true" damping="0.02"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0" mass="1"/>
    </body>
    <body pos="0 1 2">
      <joint name="slide" type="slide" axis="1 0 0"/>
      <geom size="0.05" mass="0.5"/>
    </body>
  </worldbody>
  <contact>
    <pair geom1="floor" geom2="a" condim="3" friction="0.5 0.5 0 0 0"/>
    <pair geom1="floor" geom2="b" condim="4" friction="0.4 0.4 0.02 0 0"/>
    <pair geom1="floor" geom2="c" condim="6" friction="0.6 0.5 0.02 0.01 0.01"/>
  </contact>
  <equality><joint joint1="slide" joint2="hinge" polycoef="0 0.2 0.05 0 0"/></equality>
</mujoco>
"""
SCENES = [
    pytest.param(BALL, id="ball"),
    pytest.param(FEET, id="feet", marks=pytest.mark.slow),  # minutes to compile
]
SPEEDS = np.array([1.5, 0.2])  # m/s along x: slides throughout; comes to stick or roll
# factors on the initial velocity, on friction and on the mass of the cart; time constant of limits
THETA = np.array([1.0, 1.0, 1.0, 0.02])
# the mass hardly matters: its differences need a longer step, or they are rounding
STEP = np.array([1e-6, 1e-6, 1e-5, 1e-6]) * THETA
CHANGES = np.concatenate([np.zeros((1, 4)), np.diag(STEP), -np.diag(STEP)])


def scene(model: mujoco.MjModel, theta, speed):
    """MJX model and data at parameters theta; what MuJoCo derives from the mass follows it."""
    m, data = mjx.put_model(model), mjx.make_data(model)
    factor, friction, mass, time_constant = theta
    cart, dofs = model.body("cart").id, slice(0, model.body("cart").dofnum[0])
    m = m.replace(
        pair_friction=m.pair_friction * friction,
        jnt_solref=m.jnt_solref.at[:, 0].set(time_constant),
        body_mass=m.body_mass.at[cart].multiply(mass),
        body_inertia=m.body_inertia.at[cart].multiply(mass),
        body_subtreemass=m.body_subtreemass.at[cart].multiply(mass),
        body_invweight0=m.body_invweight0.at[cart].divide(mass),
        dof_invweight0=m.dof_invweight0.at[dofs].divide(mass),
    )
    return m, data.replace(qvel=data.qvel.at[0].set(speed * factor))


def path(step, model, theta, speed):
    """Positions and velocities over the steps, (STEPS, nq + nv)."""
    m, data = scene(model, theta, speed)

    def one(data, _):
        data = step(m, data)
        return data, jnp.concatenate([data.qpos, data.qvel])

    return jax.lax.scan(one, data, None, length=STEPS)[1]


def largest(jacobian):
    """Of each parameter; 1 where it has none: a limit never met, the mass of what slides alone."""
    scale = np.abs(jacobian).max(axis=0)
    assert (scale[:2] > 1e-3).all()
    return np.where(scale > 1e-9, scale, 1.0)


@pytest.fixture(scope="module")
def results():
    """By scene: model, path and forward derivative of its end, by speed and THETA + CHANGES."""
    done = {}

    def get(xml: str):
        if xml not in done:
            model = mujoco.MjModel.from_xml_string(xml)

            def slopes(theta, speed):
                # one linear map for all directions: the path itself is computed once
                return jax.vmap(
                    lambda d: jax.jvp(
                        lambda t: path(differentiable_step, model, t, speed), (theta,), (d,)
                    ),
                    out_axes=(None, 0),
                )(jnp.eye(4, dtype=theta.dtype))

            many = jax.vmap(jax.vmap(slopes, (0, None)), (None, 0))
            with jax.enable_x64(True):
                program = jax.jit(many)
                found, slope = map(np.asarray, program(THETA + CHANGES, SPEEDS))
            done[xml] = model, found, np.swapaxes(slope[..., -1, :], -1, -2)
        return done[xml]

    return get


@pytest.mark.parametrize("xml", SCENES)
@pytest.mark.long
def test_values_equal_those_of_c_mujoco(results, xml):
    """Over 50 steps with sliding, sticking, a limit hit and an equality: to 1e-8."""
    model, found, _ = results(xml)
    limited = np.flatnonzero(model.jnt_limited)[0]
    for speed, values in zip(SPEEDS, found[:, 0], strict=True):
        data = mujoco.MjData(model)
        data.qvel[0] = speed
        rows = []
        for _ in range(STEPS):
            mujoco.mj_step(model, data)
            rows.append(np.concatenate([data.qpos, data.qvel]))
        np.testing.assert_allclose(values, rows, rtol=1e-8, atol=1e-8)
    met = found[0, 0, :, model.jnt_qposadr[limited]].max()
    assert met > model.jnt_range[limited, 1]


@pytest.mark.slow
@pytest.mark.parametrize("xml", [BALL, FEET], ids=["ball", "feet"])
def test_values_equal_those_of_mjx(results, xml):
    """`mjx.step` with many iterations, over 50 steps: to 1e-7, where its solver stops."""
    model, found, _ = results(xml)
    with jax.enable_x64(True):
        theirs = jax.jit(jax.vmap(lambda s: path(mjx.step, model, THETA, s)))(SPEEDS)
    np.testing.assert_allclose(found[:, 0], theirs, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("xml", SCENES)
@pytest.mark.long
def test_forward_mode_equals_central_differences(results, xml):
    """Through `scan`, under `vmap`: to 1e-3 of the largest entry of each parameter."""
    _, found, forward = results(xml)
    for i in range(len(SPEEDS)):
        jacobian = forward[i, 0]
        scale = largest(jacobian)
        up, down = np.split(found[i, 1:, -1], 2)
        central = ((up - down) / (2 * STEP[:, None])).T
        assert (np.abs(jacobian - central) / scale).max() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("xml", [BALL, FEET], ids=["ball", "feet"])
def test_reverse_mode_equals_forward_mode(results, xml):
    """Through `scan`, under `vmap`: to 1e-8 of the largest entry of each parameter."""
    model, _, forward = results(xml)
    with jax.enable_x64(True):

        def reverse(speed):
            return jax.jacrev(lambda t: path(differentiable_step, model, t, speed)[-1])(THETA)

        found = np.asarray(jax.jit(jax.vmap(reverse))(SPEEDS))
    for i in range(len(SPEEDS)):
        assert (np.abs(found[i] - forward[i, 0]) <= 1e-8 * largest(forward[i, 0])).all()


@pytest.mark.slow  # another program to compile
def test_float32_is_finite_and_near(results):
    """Values within 1e-4 of those of float64, derivatives within 1 % of their largest entry."""
    model, found, forward = results(BALL)
    speed = np.float32(SPEEDS[1])
    with jax.enable_x64(False):

        def slope(theta, change):
            return jax.jvp(
                lambda t: path(differentiable_step, model, t, speed)[-1], (theta,), (change,)
            )

        program = jax.jit(jax.vmap(slope, (None, 0)))
        values, slopes = program(THETA.astype(np.float32), np.eye(4, dtype=np.float32)[:3])
    assert values.dtype == slopes.dtype == np.float32
    np.testing.assert_allclose(values[0], found[1, 0, -1], rtol=1e-4, atol=1e-4)
    for single, exact in zip(np.asarray(slopes), forward[1, 0].T, strict=False):
        np.testing.assert_allclose(single, exact, atol=0.01 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("change", "to", "said"),
    [
        ('cone="elliptic"', 'cone="pyramidal"', "elliptic"),
        ('cone="elliptic"', 'cone="elliptic" integrator="RK4"', "integrator"),
        ('damping="0.1"', 'frictionloss="0.1"', "frictionloss"),
    ],
)
def test_what_is_not_handled_is_named(change, to, said):
    assert change in BALL
    model = mujoco.MjModel.from_xml_string(BALL.replace(change, to))
    with pytest.raises(ValueError, match=said):
        jax.eval_shape(differentiable_step, mjx.put_model(model), mjx.make_data(model))
