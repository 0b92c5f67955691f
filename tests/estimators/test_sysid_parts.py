"""The parts of identification without any simulation: unknowns, residuals, search, judgement."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.dataset import SensorNoise
from mjx_inertia.estimators.sysid import (
    Belief,
    Beliefs,
    NormalEquations,
    SysidSettings,
    explain_identifiability,
    from_planar_values,
    identifiability,
    observe,
    planar_values,
    to_coordinate,
    to_parameters,
    to_value,
    with_belief,
)
from mjx_inertia.estimators.sysid.levenberg_marquardt import (
    is_minimum,
    levenberg_marquardt_start,
    levenberg_marquardt_step,
)
from mjx_inertia.estimators.sysid.normal_equations import DIVERGED, small_residual
from mjx_inertia.estimators.sysid.observation import (
    WIDTH,
    sample_residual,
    signal_values,
    standard_deviation,
    weights,
)
from mjx_inertia.estimators.sysid.unknowns import (
    ESTIMATED,
    LOGARITHMIC,
    SensorErrors,
    beyond_bounds,
    bounds,
)
from mjx_inertia.pushing import PushRecord, PushSetup, PushStatus, StraightMotion
from mjx_inertia.pushing.rollout import Sample

pytestmark = pytest.mark.float64

SETTINGS = SysidSettings()
EVERY_NAME = tuple(Beliefs.__dataclass_fields__)
SAMPLES = 40


def turn(angle):
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def setup_at(pose):
    motion = StraightMotion(np.zeros(2), np.array([1.0, 0.0]), *np.array([0.06, 0.0, 1.0]))
    half = np.array([0.06, 0.04, 0.05])
    return PushSetup(motion, np.asarray(pose), half, np.array(0.04), np.array(0))


# --- unknowns


@pytest.mark.parametrize("name", EVERY_NAME)
def test_values_and_coordinates_are_each_other_s_inverse(name):
    beliefs = Beliefs()
    belief = getattr(beliefs, name)
    value = np.linspace(belief.low, belief.high, 17)
    np.testing.assert_allclose(
        to_value(name, to_coordinate(name, value, beliefs), beliefs), value, rtol=1e-12, atol=1e-15
    )
    assert float(to_value(name, np.zeros(()), beliefs)) == pytest.approx(belief.center)
    one = float(to_value(name, np.ones(()), beliefs))
    if name in LOGARITHMIC:
        assert np.log(one / belief.center) == pytest.approx(belief.spread)
    else:
        assert one - belief.center == pytest.approx(belief.spread)


def test_values_outside_the_bounds_are_taken_to_them():
    low, high = bounds(SETTINGS)
    for i, name in enumerate(SETTINGS.estimated):
        assert float(to_coordinate(name, np.array(1e6), SETTINGS.beliefs)) == float(high[i])
        assert float(to_coordinate(name, np.array(-1e6), SETTINGS.beliefs)) == float(low[i])


def test_walls_stand_beyond_the_bounds_only():
    low, high = (np.asarray(b) for b in bounds(SETTINGS))
    inside = np.random.default_rng(0).uniform(low, high)
    np.testing.assert_array_equal(beyond_bounds(inside, SETTINGS), 0.0)
    np.testing.assert_allclose(beyond_bounds(high + 0.02, SETTINGS), 1.0)
    np.testing.assert_allclose(beyond_bounds(low - 0.04, SETTINGS), -2.0)


@pytest.mark.parametrize("seed", range(4))
def test_planar_values_and_back_at_any_pose(seed):
    rng = np.random.default_rng(seed)
    z = jnp.asarray(rng.uniform(-1.0, 1.0, len(ESTIMATED)))
    setup = setup_at([*rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)])
    centroid, point = rng.uniform(-0.01, 0.01, 2), rng.uniform(-0.3, 0.3, 2)
    normal = turn(rng.uniform(-np.pi, np.pi))[0]
    where = setup, centroid, point, normal, SETTINGS
    mean = planar_values(z, *where)
    other = z + rng.uniform(-0.5, 0.5, len(z))
    back = np.asarray(from_planar_values(mean, other, *where))
    np.testing.assert_allclose(back[:4], z[:4], atol=1e-10)  # mass, I_zz and CoM are known now
    np.testing.assert_array_equal(back[4:], other[4:])
    parameters, _ = to_parameters(z, setup, centroid, SETTINGS)
    assert float(mean[0]) == float(parameters.mass)
    assert float(mean[1]) == float(parameters.inertia[2])
    com = setup.pose[:2] + turn(setup.pose[2]) @ np.asarray(parameters.com[:2])
    across = np.array([-normal[1], normal[0]])
    np.testing.assert_allclose(point + mean[2] * normal + mean[3] * across, com, atol=1e-12)


def test_planar_values_do_not_depend_on_the_world_frame():
    rng = np.random.default_rng(5)
    z, point, shift = (
        jnp.asarray(rng.normal(size=7)),
        rng.uniform(-0.1, 0.1, 2),
        np.array([0.4, -0.2]),
    )
    pose, normal, centroid = np.array([0.02, 0.03, 0.4]), turn(0.3)[0], np.array([0.002, 0.001])
    R = turn(2.0)
    moved = np.append(R @ pose[:2] + shift, pose[2] + 2.0)
    here = planar_values(z, setup_at(pose), centroid, point, normal, SETTINGS)
    there = planar_values(z, setup_at(moved), centroid, R @ point + shift, R @ normal, SETTINGS)
    np.testing.assert_allclose(there, here, atol=1e-12)


def test_a_start_is_clipped_and_a_missing_one_changes_nothing():
    where = setup_at(np.zeros(3)), np.zeros(2), np.zeros(2), np.array([1.0, 0.0]), SETTINGS
    z = jnp.linspace(-0.3, 0.3, 7)
    far = np.asarray(from_planar_values(jnp.array([1e3, 1e-9, 5.0, -5.0]), z, *where))
    low, high = (np.asarray(b) for b in bounds(SETTINGS))
    assert far[0] == high[0] and far[1] == low[1]
    np.testing.assert_allclose(far[2:4], [0.9 / 0.5, -0.9 / 0.5])  # inside the outline
    nothing = from_planar_values(jnp.array([jnp.nan, 1.0, 0.0, 0.0]), z, *where)
    np.testing.assert_array_equal(nothing, z)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"estimated": ("mass", "colour")}, "sysid.estimated has 'colour'"),
        ({"estimated": ("mass", "mass")}, "name each unknown once"),
        ({"estimated": ()}, "name each unknown once"),
        ({"channels": ("force", "smell")}, "sysid.channels has 'smell'"),
        ({"uniform_density": True}, r"fixes \['com_x', 'com_y', 'inertia'\]"),
        ({"block": 0}, "sysid.block=0"),
        ({"iterations": 0}, "iterations=0"),
        ({"beliefs": Beliefs(mass=Belief(1.0, 1.0, 2.0, 3.0))}, "sysid.beliefs.mass"),
        ({"beliefs": Beliefs(friction=Belief(0.3, 0.0, 0.1, 1.0))}, "sysid.beliefs.friction"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        SysidSettings(**changes)


# --- normal equations and the search


def equations_of(residual, z):
    """Normal equations of a residual function at z."""
    r, jacobian = residual(z), jax.jacfwd(residual)(z)
    return NormalEquations(0.5 * r @ r, jacobian.T @ r, jacobian.T @ jacobian)


@pytest.mark.parametrize("seed", range(3))
def test_the_small_residual_has_the_same_normal_equations(seed):
    rng = np.random.default_rng(seed)
    r, jacobian = rng.normal(size=50), rng.normal(size=(50, 6)) * 10.0 ** np.arange(-2, 4)
    n = NormalEquations(*map(jnp.asarray, (0.5 * r @ r, jacobian.T @ r, jacobian.T @ jacobian)))
    small, slope = small_residual(n)
    assert small.shape == (7,) and slope.shape == (7, 6)
    np.testing.assert_allclose(0.5 * small @ small, n.cost, rtol=1e-10)
    np.testing.assert_allclose(slope.T @ small, n.gradient, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(slope.T @ slope, n.hessian, rtol=1e-8, atol=1e-8)


def test_the_belief_is_a_standard_normal_and_a_wall():
    high = np.asarray(bounds(SETTINGS)[1])
    nothing = NormalEquations(jnp.zeros(()), jnp.zeros(7), jnp.zeros((7, 7)))
    inside = with_belief(nothing, jnp.asarray(0.1 * high), SETTINGS)
    np.testing.assert_allclose(inside.cost, 0.005 * high @ high)
    np.testing.assert_allclose(inside.gradient, 0.1 * high)
    np.testing.assert_array_equal(inside.hessian, np.eye(7))
    beyond = jnp.asarray(high + np.linspace(0.01, 0.03, 7))
    whole = equations_of(lambda z: jnp.append(z, beyond_bounds(z, SETTINGS)), beyond)
    for ours, reference in zip(
        jax.tree.leaves(with_belief(nothing, beyond, SETTINGS)), jax.tree.leaves(whole), strict=True
    ):
        np.testing.assert_allclose(ours, reference, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("field", ["cost", "gradient", "hessian"])
def test_a_simulation_that_is_not_finite_costs_more_than_any_other(field):
    data = NormalEquations(jnp.ones(()), jnp.ones(7), jnp.eye(7))
    spoiled = data.replace(**{field: getattr(data, field) * jnp.nan})
    found = with_belief(spoiled, jnp.full(7, 0.1), SETTINGS)
    assert float(found.cost) == DIVERGED
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(found))


def rosenbrock(z):
    return jnp.stack([10.0 * (z[1] - z[0] ** 2), 1.0 - z[0]])


def run(evaluate, z, most=60):
    """The search, the points that it stood at and those that it asked for."""
    progress, path, asked = levenberg_marquardt_start(jnp.asarray(z)), [], []
    advance, evaluate = jax.jit(levenberg_marquardt_step), jax.jit(evaluate)
    for _ in range(most):
        asked.append(np.asarray(progress.ask))
        progress = advance(progress, evaluate(progress.ask))
        path.append((np.asarray(progress.z), float(progress.cost)))
        if bool(progress.done):
            break
    return progress, path, asked


def test_the_search_finds_the_minimum_of_rosenbrock_s_valley():
    progress, path, _ = run(lambda z: equations_of(rosenbrock, z), [-1.2, 1.0])
    assert bool(progress.done) and len(path) < 60
    away = np.asarray(progress.z) - 1.0
    assert 0.5 * away @ np.asarray(progress.hessian) @ away < 1e-3  # 0.04 standard deviations
    costs = np.array([cost for _, cost in path])
    assert (np.diff(costs) <= 0).all()
    np.testing.assert_allclose(progress.cost, 0.5 * np.sum(np.square(rosenbrock(progress.z))))
    np.testing.assert_allclose(progress.hessian, equations_of(rosenbrock, progress.z).hessian)


def test_the_search_never_goes_to_where_the_simulation_diverges():
    """From the flat tail of an exponential a full step overshoots into what is not finite."""

    def curved(z):
        return jnp.stack([jnp.exp(z[0]) - 1.0, z[1] - z[0]])

    def evaluate(z):
        good = equations_of(curved, z)
        bad = NormalEquations(jnp.asarray(DIVERGED), z, jnp.eye(2))
        return jax.tree.map(lambda g, b: jnp.where(z[0] < 0.2, g, b), good, bad)

    progress, path, asked = run(evaluate, [-4.0, -4.0])
    assert any(z[0] > 0.2 for z in asked)
    assert all(cost < 1.0 and z[0] < 0.2 for z, cost in path)
    np.testing.assert_allclose(progress.z, 0.0, atol=0.05)


def test_a_linear_problem_needs_two_evaluations():
    rng = np.random.default_rng(0)
    A, b = rng.normal(size=(20, 4)), rng.normal(size=20)
    progress, path, _ = run(lambda z: equations_of(lambda z: A @ z - b, z), np.zeros(4), most=12)
    np.testing.assert_allclose(progress.z, np.linalg.lstsq(A, b)[0], atol=0.03)
    assert bool(progress.done) and len(path) <= 4


@pytest.mark.parametrize("slope", [0.3, 5.0])
def test_a_search_stalls_at_a_kink_and_knows_how_much_it_may_still_gain(slope):
    """The cost slope |z - 1|, with a curvature of one in the linear model."""

    def evaluate(z):
        side = jnp.where(z < 1.0, -slope, slope)
        return NormalEquations(1.0 + slope * jnp.abs(z[0] - 1.0), side, jnp.eye(1))

    progress, path, _ = run(evaluate, [1.0 - 1e-4], most=6)
    assert not progress.done and path[0][1] - path[-1][1] < 1e-3
    assert float(progress.decrement) == pytest.approx(0.5 * slope**2)
    assert bool(is_minimum(progress)) == (slope < 1.0)


# --- what a push can tell


def test_a_steady_push_shows_the_product_of_mass_and_friction_only():
    rate = np.array([[30.0, 30.0, 0.0], [0.0, 0.0, 20.0]])  # of the force, of the moment
    result = identifiability(rate.T @ rate)
    sentence = explain_identifiability(result, ("mass", "friction", "com_y"))
    assert sentence.startswith(
        ("mass and table friction cannot be told apart", "table friction and mass cannot be told")
    )
    assert "product" in sentence
    assert float(result.told) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(np.abs(result.weakest), [0.5**0.5, 0.5**0.5, 0.0], atol=1e-9)
    # the sum is known, the difference as well as it was believed; the third unknown by itself
    variance = np.asarray(result.covariance)
    assert variance[0, 0] == pytest.approx(0.5, rel=1e-2)
    assert np.array([1, 1, 0]) @ variance @ np.array([1, 1, 0]) == pytest.approx(2 / 1801)
    assert variance[2, 2] == pytest.approx(1 / 401)


def test_single_unknowns_and_informative_pushes():
    names = ("mass", "inertia", "tip_friction")
    assert explain_identifiability(identifiability(np.diag([50.0, 40.0, 30.0])), names) == ""
    sentences = {
        1: "I_zz cannot be told from this push: the push hardly turns the object",
        2: "tip friction cannot be told from this push: the tip does not slide along the object",
        0: "mass cannot be told from this push",
    }
    for i, sentence in sentences.items():
        fisher = np.full(3, 50.0)
        fisher[i] = 0.1
        known = identifiability(np.diag(fisher))
        assert explain_identifiability(known, names) == sentence
        several = sentence.replace("this push", "these pushes").replace(
            "push hardly turns", "pushes hardly turn"
        )
        assert explain_identifiability(known, names, pushes=2) == several
    two = identifiability(np.diag([50.0, 0.1, 0.2]))
    assert explain_identifiability(two, names).startswith(
        ("I_zz and tip friction cannot be told from", "tip friction and I_zz cannot be told from")
    )
    lost = identifiability(np.full((3, 3), np.nan))
    np.testing.assert_array_equal(lost.covariance, np.eye(3))
    assert float(lost.told) == 0.0
    assert float(identifiability(np.diag([1.0, 4.0, 100.0])).condition) == pytest.approx(100.0)


# --- observations


def record(seed=0, length=SAMPLES):
    rng = np.random.default_rng(seed)
    pose = np.array([0.1, -0.2, 0.3]) + 0.01 * np.cumsum(rng.normal(size=(SAMPLES, 3)), 0)
    tip = 0.001 * np.cumsum(np.abs(rng.normal(size=(SAMPLES, 2))), 0)
    return PushRecord(
        time=0.01 * np.arange(SAMPLES),
        force=rng.normal(size=(SAMPLES, 2)) + 3.0,
        moment=0.1 * rng.normal(size=SAMPLES),
        pose=pose,
        twist=0.1 * rng.normal(size=(SAMPLES, 3)),
        tip_position=tip,
        tip_velocity=np.gradient(tip, 0.01, axis=0),
        contact_point=pose[0, :2] + np.array([-0.05, 0.02]),
        contact_normal=np.array([1.0, 0.0]),
        length=np.array(length),
        status=np.array(int(PushStatus.OK)),
    )


def samples_of(r):
    """The record's own signals in the form that a simulation gives."""
    return [
        Sample(
            *(jnp.asarray(x[k]) for x in (r.force, r.moment, r.pose, r.twist)), *np.zeros((2, 2))
        )
        for k in range(SAMPLES)
    ]


def instrument(mass=0.0, bias=(0.0, 0.0), delay=0.0, pose=(0.0, 0.0, 0.0)):
    return SensorErrors(*(jnp.asarray(x, float) for x in (mass, bias, delay, pose)))


def test_weights_are_inverse_standard_deviations_inside_the_push():
    settings = SysidSettings(noise=SensorNoise(0.06, 2.0), channels=("force", "yaw"))
    values = np.full((SAMPLES, WIDTH), -5.0)
    sigma = standard_deviation(values, settings.noise)
    np.testing.assert_allclose(sigma[0], 0.1 + 2 * np.array(
        [0.02, 0.02, 2e-4, 2e-4, 2e-4, 2e-3, 1e-4, 1e-4, 1e-3]
    ))  # fmt: skip
    found = np.asarray(weights(values, np.array(25), settings))
    fitted = [0, 1, 8]
    np.testing.assert_allclose(found[:25, fitted], 1 / np.asarray(sigma)[:25, fitted])
    assert not found[25:].any() and not np.delete(found, fitted, 1).any()
    exact = standard_deviation(np.zeros((3, WIDTH)), SensorNoise(0.05, 0.0))
    assert (np.asarray(exact) > 0).all()  # a signal of nothing is not known without error


@pytest.mark.parametrize("field", ["force", "moment", "pose", "twist", "contact_point"])
def test_a_push_that_is_not_finite_has_no_weight(field):
    good = record(length=30)
    assert int(observe(good, SETTINGS).length) == 30
    broken = np.array(getattr(good, field))
    broken.reshape(-1)[1] = np.nan
    seen = observe(good.replace(**{field: broken}), SETTINGS)
    assert int(seen.length) == 0 and not np.asarray(seen.weight).any()
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(seen))


def test_what_lies_beyond_the_push_does_not_matter_and_a_bad_status_does():
    good = record(length=30)
    force = np.array(good.force)
    force[35] = np.nan
    assert int(observe(good.replace(force=force), SETTINGS).length) == 30
    lost = observe(good.replace(status=np.array(int(PushStatus.LOST_CONTACT))), SETTINGS)
    assert int(lost.length) == 0 and not np.asarray(lost.weight).any()


def test_signals_are_taken_at_the_contact():
    """A force at the contact point has no moment there, and a spin about it leaves it at rest."""
    start, arm, pose = (
        np.array([0.1, 0.2, 0.5]),
        np.array([-0.04, 0.03]),
        np.array([[0.3, 0.1, 1.7]]),
    )
    lever = turn(1.2) @ arm
    force, spin = np.array([2.0, -1.0]), 0.7
    moment = np.array([lever[0] * force[1] - lever[1] * force[0]])
    twist = np.array([[spin * lever[1], -spin * lever[0], spin]])
    values = signal_values(force[None], moment, twist, pose, start, arm)
    expected = [[2.0, -1.0, 0.0, 0.0, 0.0, spin, 0.2, -0.1, 1.2]]
    np.testing.assert_allclose(values, expected, atol=1e-12)


def test_a_simulation_that_gives_the_measured_signals_has_no_residual():
    r = record()
    seen = observe(r, SETTINGS)
    for k, sample in enumerate(samples_of(r)):
        gap = sample_residual(seen, np.array(k), sample, instrument())
        np.testing.assert_allclose(gap, 0.0, atol=1e-9)
    other = samples_of(r)[7].replace(pose=jnp.asarray(r.pose[7]) + jnp.array([0.0, 0.01, 0.0]))
    gap = np.asarray(sample_residual(seen, np.array(7), other, instrument()))
    assert np.flatnonzero(gap).tolist() == [7]
    assert gap[7] == pytest.approx(-0.01 * float(seen.weight[7, 7]))


def test_an_instrument_is_taken_away_from_what_was_measured():
    r, bias, mass = record(), np.array([0.4, -0.3]), 0.7
    change = np.diff(r.tip_velocity, axis=0, prepend=r.tip_velocity[:1]) / 0.01
    carried = mass * change + bias
    lever = np.stack(
        [turn(p - r.pose[0, 2]) @ (r.contact_point - r.pose[0, :2]) for p in r.pose[:, 2]]
    )
    moment = r.moment + lever[:, 0] * carried[:, 1] - lever[:, 1] * carried[:, 0]
    seen = observe(r.replace(force=r.force + carried, moment=moment), SETTINGS)
    for k, sample in enumerate(samples_of(r)):
        gap = sample_residual(seen, np.array(k), sample, instrument(mass, bias))
        np.testing.assert_allclose(gap, 0.0, atol=1e-8)


def test_a_late_force_is_compared_with_the_motion_it_belongs_to():
    r = record()
    late = r.replace(
        force=np.concatenate([r.force[:1], r.force[:-1]]),
        moment=np.concatenate([r.moment[:1], r.moment[:-1]]),
    )
    seen = observe(late, SETTINGS)
    for k, sample in enumerate(samples_of(r)[:-1]):
        gap = sample_residual(seen, np.array(k), sample, instrument(delay=0.01))
        np.testing.assert_allclose(gap, 0.0, atol=1e-8)
