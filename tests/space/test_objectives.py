"""Costs of a manoeuvre against sums over samples at 100 Hz, as Eqs 7.17 to 7.21 are printed."""

import jax
import jax.numpy as jnp
import numpy as np
import planned
import pytest

from mjx_inertia.space import (
    BASE_DRIFT,
    BOUND,
    HANDS,
    OBJECTIVES,
    THESIS,
    WRENCH,
    costs,
    course,
    planar_robot,
    problem,
)
from mjx_inertia.space.default_manoeuvres import TARGET
from mjx_inertia.space.manoeuvre import RESOLVED
from mjx_inertia.space.objectives import violation, with_object_at_target
from mjx_inertia.space.planar_model import planar_capture

pytestmark = pytest.mark.long

KINDS = {"consistent": planned.consistent, "printed": planned.printed}
SAMPLE_TIME = 0.01


@pytest.fixture(scope="module", params=KINDS)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def rows(kind):
    """Decisions that succeed; the first is the straight quintic."""
    scale = {"consistent": 0.5, "printed": 2.0}[kind]
    found = np.random.default_rng(2).uniform(-scale, scale, (4, KINDS[kind]().size))
    found[0] = 0.0
    return found


@pytest.fixture(scope="module")
def found(kind, rows):
    """Courses, and their costs by name."""
    with jax.enable_x64(True):
        courses, values = planned.evaluated(KINDS[kind])(rows)
    assert np.all(courses.status == 0)
    return courses, dict(zip(planned.NAMES, values.T, strict=True))


@pytest.fixture(scope="module")
def samples(kind, rows):
    with jax.enable_x64(True):
        return planned.sampled(KINDS[kind])(rows)


def test_wrench_costs_are_norms_of_sampled_signals(found, samples):
    """Eq. 7.17, √Σ F² over the 5,001 samples; and those of the wrench that moves the object."""
    _, values = found
    nodes = samples[1]
    parts = {"": nodes.total_wrench, "object_": nodes.object_wrench}
    for prefix, wrench in parts.items():
        square = np.sum(wrench**2, 1)
        for name, of_name in zip(WRENCH, square.T, strict=True):
            np.testing.assert_allclose(values[prefix + name], np.sqrt(of_name), rtol=1e-6)
        np.testing.assert_allclose(
            values[prefix + "force"], np.sqrt(square[:, :2].sum(1)), rtol=1e-6
        )
        np.testing.assert_allclose(values[prefix + "moment"], np.sqrt(square[:, 2]), rtol=1e-6)
        force = np.max(np.linalg.norm(wrench[..., :2], axis=-1), 1)
        np.testing.assert_allclose(values[f"peak_{prefix}force"], force, rtol=1e-3)
        moment = np.max(np.abs(wrench[..., 2]), 1)
        np.testing.assert_allclose(values[f"peak_{prefix}moment"], moment, rtol=1e-3)


def final_base(twist):
    """x, y, θ by the trapezoidal rule over the samples, in inertial axes."""
    middle = (twist[:, 1:] + twist[:, :-1]) / 2.0 * SAMPLE_TIME
    angle = np.concatenate([np.zeros((len(twist), 1)), np.cumsum(middle[..., 2], 1)], 1)
    c, s = np.cos(angle), np.sin(angle)
    x = np.sum(c * twist[..., 0] - s * twist[..., 1], 1) * SAMPLE_TIME
    y = np.sum(s * twist[..., 0] + c * twist[..., 1], 1) * SAMPLE_TIME
    return np.stack([x, y, angle[:, -1]], 1)


def test_base_and_hand_costs_are_integrals_over_the_samples(kind, found, samples):
    """Eqs 7.18 to 7.21; the two hands of one cost together."""
    m, (_, values) = KINDS[kind](), found
    base = final_base(samples[1].base_twist)
    for name, wanted in zip(BASE_DRIFT, np.abs(base).T, strict=True):
        np.testing.assert_allclose(values[name], wanted, rtol=1e-6)
    np.testing.assert_allclose(values["base_distance"], np.hypot(base[:, 0], base[:, 1]), rtol=1e-6)
    np.testing.assert_allclose(values["base_turn"], np.abs(base[:, 2]), rtol=1e-6)
    q_end = np.tile(np.asarray(m.q_end), (len(base), 1))
    reached = planned.planar_matrices(q_end, base[:, 2], with_object=False).hands
    reached[..., :2] += base[:, None, :2]
    # the hands hold the sphere at the target on both sides, and look at it along its x
    c, s = np.cos(TARGET[2]), np.sin(TARGET[2])
    side = np.array([1.0, -1.0])[:, None] * 0.4 * np.array([c, s])
    turn = TARGET[2] + np.array([1.0, -1.0]) * np.pi / 2.0
    wanted = np.concatenate([np.array(TARGET[:2]) + side, turn[:, None]], 1)
    error = reached - wanted
    error[..., 2] = planned.wrapped(error[..., 2])
    together = np.sqrt(np.sum(error**2, 1))
    for name, cost in zip(HANDS, together.T, strict=True):
        np.testing.assert_allclose(values[name], cost, rtol=1e-6)
    distance = np.hypot(together[:, 0], together[:, 1])
    np.testing.assert_allclose(values["hand_distance"], distance, rtol=1e-6)
    np.testing.assert_allclose(values["hand_turn"], together[:, 2], rtol=1e-6)


def test_further_costs(found, samples):
    courses, values = found
    motion, nodes = samples
    effort = np.sqrt(np.sum(nodes.torque**2, (1, 2)))
    np.testing.assert_allclose(values["effort"], effort, rtol=1e-6)
    power = nodes.torque * motion.qd
    energy = np.sum(np.abs(power), (1, 2)) * SAMPLE_TIME
    np.testing.assert_allclose(values["joint_energy"], energy, rtol=2e-4)
    peak = np.max(np.abs(np.sum(power, 2)), 1)
    np.testing.assert_allclose(values["peak_power"], peak, rtol=1e-3)
    # of the least or greatest value on the way the nodes miss a little
    singular = 1.0 / np.min(nodes.manipulability, 1)
    assert np.all(values["singularity"] <= singular * (1.0 + 1e-12))
    np.testing.assert_allclose(values["singularity"], singular, rtol=1e-2)
    near = [min(planned.sampled_clearance(q) for q in motion) for motion in courses.motion.q]
    np.testing.assert_allclose(values["overlap"], -np.array(near), rtol=0, atol=0.02)
    closure = np.max(nodes.closure, 1)
    for name, wanted in zip(("closure_distance", "closure_angle"), closure.T, strict=True):
        np.testing.assert_allclose(values[name], wanted, rtol=2e-2, atol=1e-9)


def test_gradients_against_differences(kind, rows):
    """Of every cost in every coefficient: forward for one kind, in reverse for the other."""
    m, decision, step = KINDS[kind](), rows[1], 1e-5
    gradient = jax.jacfwd if kind == "consistent" else jax.jacrev
    slope = jax.jit(gradient(lambda c: costs(m, course(m, c), planned.NAMES)))(
        jnp.asarray(decision)
    )
    slope = np.asarray(slope).T
    both = np.concatenate([step * np.eye(m.size), -step * np.eye(m.size)]) + decision
    values = planned.evaluated(KINDS[kind])(both)[1]
    difference = (values[: m.size] - values[m.size :]) / (2.0 * step)
    assert np.all(np.isfinite(slope))
    if kind == "consistent":  # rounding is all there is of the closure
        assert planned.NAMES[-2:] == ("closure_distance", "closure_angle")
        slope, difference = slope[:, :-2], difference[:, :-2]
    scale = np.max(np.abs(difference), 0)
    rounding = 1e-9 * np.abs(values[0, : len(scale)])  # of differences, where a cost hardly changes
    assert np.all(np.abs(slope - difference) < 1e-5 * scale + rounding)


def one_course(found, i):
    return jax.tree.map(lambda x: jnp.asarray(x[i]), found[0])


def test_violation_sums_what_is_beyond_the_bounds(kind, found):
    m, values, c = KINDS[kind](), found[1], one_course(found, 1)
    assert float(violation(m, c, {})) == 0.0
    force, overlap = values["peak_force"][1], values["overlap"][1]
    assert float(violation(m, c, {"peak_force": force * 1.01, "overlap": 0.0})) == 0.0
    beyond = violation(m, c, {"peak_force": force / 2.0, "overlap": overlap - 0.1})
    np.testing.assert_allclose(beyond, 1.0 + 0.1 / abs(overlap - 0.1), rtol=1e-9)
    # a bound of zero counts the excess itself
    np.testing.assert_allclose(violation(m, c, {"effort": 0.0}), values["effort"][1], rtol=1e-12)


def test_violation_counts_what_makes_a_status(kind, found):
    m, c = KINDS[kind](), one_course(found, 1)
    assert float(violation(m, c.replace(limit_excess=jnp.asarray(0.2)), {})) == 0.2
    rough = violation(m, c.replace(unresolved=jnp.asarray(0.3)), {})
    np.testing.assert_allclose(rough, 0.3 - RESOLVED, rtol=1e-12)
    apart = float(violation(m, c.replace(closure=jnp.array([0.1, 0.5])), {}))
    assert apart == (0.0 if m.closure_limit is None else pytest.approx(0.5 - 1e-6))
    assert np.isnan(float(violation(m, c.replace(unresolved=jnp.asarray(jnp.nan)), {})))


def test_an_end_that_arrives():
    """With the end made for the turn that the base takes, the hands are right (errata 30)."""
    m = planned.consistent()
    decisions = np.random.default_rng(2).uniform(-0.5, 0.5, (4, m.size))
    search = problem(m, HANDS, bounds={"base_turn": 0.01}, arrive=True)
    np.testing.assert_array_equal(search.upper, [BOUND] * m.size)
    assert search.evaluate_many is not None
    found = jax.jit(search.evaluate_many)(jnp.asarray(decisions))
    _, plain = planned.evaluated(planned.consistent)(decisions)
    far = plain[:, [planned.NAMES.index(name) for name in HANDS]]
    assert np.all(np.asarray(found.costs) < 0.05 * far)  # in six rounds
    assert np.any(np.asarray(found.violation) > 0.0)

    def after_more_rounds(c):
        return course(with_object_at_target(m, c, rounds=40), c, total=False).hand_error

    longer = jax.jit(jax.vmap(after_more_rounds))
    assert np.max(np.abs(longer(jnp.asarray(decisions)))) < 1e-9


@pytest.mark.parametrize(
    ("names", "bounds", "words"),
    [
        (("force", "weight"), {}, "'weight' is no cost; there are force_x"),
        (("force",), {"wait": 1.0}, "'wait' is no cost"),
        *[((name,), {}, f"'{name}' is always zero in the plane")
          for name in ("force_z", "object_moment_x", "base_z", "hand_turn_y")],
    ],
)  # fmt: skip
def test_names_that_do_not_fit(names, bounds, words):
    with pytest.raises(ValueError, match=words):
        problem(planned.printed(), names, bounds=bounds)


def test_names_of_costs():
    assert THESIS == WRENCH + BASE_DRIFT + HANDS and len(THESIS) == 9
    assert set(planned.NAMES) < set(OBJECTIVES)
    search = problem(planned.printed())
    assert search.cost_names == THESIS and search.dimension == 12
    assert planar_robot().dof == 6 and planar_capture().radius == 0.4


def test_without_the_total_wrench_the_other_costs_are_the_same(kind):
    """A problem that asks for no cost of it leaves it out, and allows what is singular for it."""
    m = KINDS[kind]()
    names = ("object_force", "effort", "base_turn", "hand_distance")
    decisions = np.random.default_rng(3).uniform(-BOUND, BOUND, (planned.BATCH, m.size))
    found = jax.jit(jax.vmap(problem(m, names).evaluate))(jnp.asarray(decisions))
    courses, values = planned.evaluated(KINDS[kind])(decisions)
    wanted = values[:, [planned.NAMES.index(name) for name in names]]
    fine = courses.status == 0
    assert fine.sum() > 3
    np.testing.assert_allclose(np.asarray(found.costs)[fine], wanted[fine], rtol=1e-12)
    allowed = np.asarray(found.violation) == 0.0
    assert np.all(allowed[fine]) and allowed.sum() > fine.sum()
    c = jax.jit(lambda x: course(m, x, total=False))(jnp.asarray(decisions[0]))
    assert np.all(np.isnan(c.nodes.total_wrench)) and np.all(np.isnan(c.nodes.manipulability))
