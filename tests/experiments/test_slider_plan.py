"""Widely drawn pushes: the tip swings as its equation says, and the plan keeps to its ranges."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjx_inertia.objects import friction_radius
from parts.slider_plan import SlidersProtocol, SwingingMotion, sliders_plan

PROTOCOL = SlidersProtocol(pushes=400)
PLAN = sliders_plan(PROTOCOL, seed=0)


def _motion(hold: float = 5e-4) -> SwingingMotion:
    scalars = {
        "speed": 0.1, "ramp": 0.05, "duration": 0.7, "lead": 0.1, "travel": 0.55,
        "hold": hold, "frequency": 75.0, "damping": 0.1,
    }  # fmt: skip
    arrays = {name: jnp.asarray(value) for name, value in scalars.items()}
    return SwingingMotion(start=jnp.zeros(2), direction=jnp.array([0.6, 0.8]), **arrays)


@pytest.mark.parametrize("hold", [0.0, 5e-4, 8e-3])
def test_the_tip_obeys_the_equation_of_a_drawn_swinging_mass(hold: float):
    """Against numerical integration, held for nothing, within the ramp, and beyond it."""
    motion = _motion(hold)
    time = np.linspace(0.0, 0.7, 141)
    driven = np.asarray(motion.driven(jnp.asarray(time)))
    start = float(motion.lead + motion.held())

    def acceleration(t: float, state: np.ndarray) -> np.ndarray:
        drive, drive_speed = _drive(t)
        pull = 75.0**2 * (drive - hold - state[0]) + 2 * 0.1 * 75.0 * (drive_speed - state[1])
        return np.array([state[1], pull])

    assert _drive(start)[0] == pytest.approx(hold, abs=1e-6)
    after = time[time > start]
    solved = solve_ivp(
        acceleration, (start, 0.7), [0.0, 0.0], t_eval=after, max_step=1e-3, rtol=1e-8
    )
    way = np.asarray(motion.way(jnp.asarray(time)))
    np.testing.assert_allclose(way[time > start], solved.y[0], atol=2e-6)
    np.testing.assert_array_equal(way[time <= start - 1e-4], 0.0)
    np.testing.assert_allclose(driven, [_drive(t)[0] for t in time], atol=1e-6)


def _drive(time: float) -> tuple[float, float]:
    """Way and speed of the drive of `_motion`."""
    t = np.clip(time - 0.1, 0.0, 0.55)
    if t < 0.05:
        return t**2, 2.0 * t
    if t < 0.5:
        return 0.1 * (t - 0.025), 0.1
    return 0.05 - (0.55 - t) ** 2, 2.0 * (0.55 - t)


def test_velocities_add_up_to_the_way():
    motion, step = _motion(), 0.005
    times = jnp.arange(140) * step
    velocity = jax.vmap(lambda t: motion.velocity(t, step))(times)
    total = np.asarray(velocity).sum(0) * step
    way = float(motion.way(jnp.asarray(140 * step)))
    np.testing.assert_allclose(total, way * np.array([0.6, 0.8]), atol=1e-6)
    assert way == pytest.approx(0.05 - 5e-4, abs=4e-4)  # the probe stays bent, and still swings


def test_every_draw_keeps_to_its_interval():
    parameters, motion = PLAN.pushes.parameters, PLAN.pushes.motion
    assert isinstance(motion, SwingingMotion)
    drawn = {
        "mass": parameters.mass, "friction": parameters.friction, "speed": motion.speed,
        "edge": 2.0 * np.asarray(parameters.half_extents)[:, :2], "damping": motion.damping,
        "probe_mass": PLAN.instrument.probe_mass, "stiffness": PLAN.instrument.stiffness,
    }  # fmt: skip
    for name, values in drawn.items():
        low, high = getattr(PROTOCOL, name)
        assert low <= np.min(values) < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < np.max(values) <= high
    assert (np.diff(motion.duration) >= 0.0).all()
    correlation = np.corrcoef(np.log(parameters.mass), PLAN.pushes.conditions.size)[0, 1]
    assert abs(correlation) < 0.15  # a large object is no heavier


def test_plan_is_consistent_with_the_object_it_pushes():
    i, pushes = 37, PLAN.pushes
    x, y, _ = np.asarray(pushes.parameters.half_extents)[i]
    outline = np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
    com = np.asarray(pushes.parameters.com)[i, :2]
    factor = pushes.parameters.friction_radius[i] / friction_radius(outline, com)
    assert PROTOCOL.radius_factor[0] <= factor <= PROTOCOL.radius_factor[1]
    np.testing.assert_allclose(pushes.truth.com[i], com - pushes.contact_point[i])
    assert pushes.contact_point[i, 0] == pytest.approx(-x)
    assert abs(pushes.contact_point[i, 1]) <= 0.8 * y


def test_same_seed_same_plan():
    again = sliders_plan(PROTOCOL, seed=0)
    for one, other in zip(jax.tree.leaves(PLAN), jax.tree.leaves(again), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_probe_that_bends_by_the_whole_path_is_refused():
    with pytest.raises(ValueError, match="stiffer probe"):
        sliders_plan(SlidersProtocol(pushes=50, stiffness=(50.0, 60.0)), seed=0)
