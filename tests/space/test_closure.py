"""Joints that follow from the grasp: exact, on one branch, with their rates and derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import planned
import pytest

from mjx_inertia.space import AS_PRINTED
from mjx_inertia.space.closure import close_chain, closure_error, following_joints
from mjx_inertia.space.manoeuvre import motion_at

pytestmark = pytest.mark.long

STEP = 1e-4  # share of the duration
COUNT = 32


@pytest.fixture(scope="module")
def m():
    return planned.consistent()


@pytest.fixture(scope="module")
def decisions():
    rows = np.random.default_rng(5).uniform(-1.0, 1.0, (COUNT, 6))
    return rows * np.linspace(0.0, 1.0, COUNT)[:, None]


@pytest.fixture(scope="module")
def moved(m):
    """A function of decisions: the motion at the nodes alone."""
    run = jax.jit(jax.vmap(lambda c: motion_at(m, m.rule.nodes, c)))
    return lambda rows: jax.tree.map(np.asarray, run(rows))


@pytest.fixture(scope="module")
def around(m, decisions):
    """Motion a little before each node, there, and a little after, and the gap of the hands."""
    tau = (m.rule.nodes[:, None] + STEP * np.array([-1.0, 0.0, 1.0])).ravel()

    def one(decision):
        motion = motion_at(m, tau, decision)
        return motion, jax.vmap(lambda q: closure_error(m.robot, m.capture, q)[0])(motion.q)

    with jax.enable_x64(True):
        motion, apart = jax.tree.map(np.asarray, jax.jit(jax.vmap(one))(decisions))
    good = np.max(np.abs(apart), (1, 2)) < 1e-6
    assert good.sum() > 20  # what cannot be held is the business of a status
    motion = jax.tree.map(lambda x: x[good].reshape(-1, COUNT, 3, 6), motion)
    return motion, apart[good], good


def test_hands_agree(around, m):
    """Also by the closed form."""
    motion, apart, _ = around
    assert np.max(np.abs(apart)) < 1e-12
    q = motion.q.reshape(-1, 6)
    both = planned.held_by_hands(planned.planar_matrices(q, np.zeros(len(q)), with_object=False))
    assert np.max(np.abs(both[:, 0, :2] - both[:, 1, :2])) < 1e-12
    assert np.max(np.abs(planned.wrapped(both[:, 0, 2] - both[:, 1, 2]))) < 1e-12


def test_rates_and_accelerations_are_those_of_the_positions(around, m):
    motion, *_ = around
    for value, slope in ((motion.q, motion.qd), (motion.qd, motion.qdd)):
        difference = (value[..., 2, :] - value[..., 0, :]) / (2.0 * STEP * m.duration)
        scale = np.max(np.abs(slope), (1, 2, 3), keepdims=True)[..., 0]
        assert np.max(np.abs(difference - slope[..., 1, :]) / scale) < 1e-5


def test_the_branch_does_not_depend_on_the_nodes(around, moved, decisions):
    motion, _, good = around
    nodes = moved(decisions)
    np.testing.assert_allclose(nodes.q[good], motion.q[..., 1, :], rtol=0, atol=1e-11)


def test_derivatives_against_differences(m, moved, decisions):
    """Of positions, rates and accelerations with respect to every coefficient."""
    decision, step = jnp.asarray(decisions[10]), 1e-5
    units = jnp.eye(6)

    def along(direction):
        run = lambda c: motion_at(m, m.rule.nodes, c)  # noqa: E731
        return jax.jvp(run, (decision,), (direction,))[1]

    slopes = jax.tree.map(np.asarray, jax.jit(jax.vmap(along))(units))
    rows = np.tile(decisions[10], (COUNT, 1))
    rows[:6] += step * np.eye(6)
    rows[6:12] -= step * np.eye(6)
    found = moved(rows)
    for slope, value in zip(jax.tree.leaves(slopes), jax.tree.leaves(found), strict=True):
        difference = (value[:6] - value[6:12]) / (2.0 * step)
        scale = np.max(np.abs(difference))
        np.testing.assert_allclose(slope, difference, rtol=0, atol=1e-8 * max(scale, 1e-3))


def test_closing_moves_the_following_joints_only(m):
    """Back from positions nearby; its derivative is that of the implicit function."""
    rng = np.random.default_rng(6)
    following, leading = np.array(m.following), np.array(m.leading)
    near = np.tile(np.asarray(m.q_start), (50, 1)) + 0.05 * rng.normal(size=(50, 6))

    def one(q):
        closed = close_chain(m.robot, m.capture, q, m.following)
        slope = jax.jacfwd(lambda q: close_chain(m.robot, m.capture, q, m.following))(q)
        return closed, slope, *closure_error(m.robot, m.capture, closed)

    closed, slope, apart, rows = (np.asarray(x) for x in jax.jit(jax.vmap(one))(near))
    assert np.max(np.abs(apart)) < 1e-12
    np.testing.assert_array_equal(closed[:, leading], near[:, leading])
    wanted = -np.linalg.solve(rows[..., following], rows[..., leading])
    np.testing.assert_allclose(slope[:, following][..., leading], wanted, rtol=0, atol=1e-9)
    np.testing.assert_allclose(slope[:, following][..., following], 0.0, rtol=0, atol=1e-9)


def test_the_gap_has_the_jacobian_of_its_differences(m):
    """At closed hands, where its rotation is exact to first order."""
    q, step = np.asarray(m.q_start), 1e-6
    rows = np.concatenate([step * np.eye(6), -step * np.eye(6), np.zeros((1, 6))]) + q
    apart, jacobian = jax.jit(jax.vmap(lambda q: closure_error(m.robot, m.capture, q)))(rows)
    difference = np.asarray(apart[:6] - apart[6:12]).T / (2.0 * step)
    np.testing.assert_allclose(jacobian[-1], difference, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("leading", "words"),
    [
        ((0, 1), r"leaves 4 of 6 joints to follow.*tie 3"),
        ((0, 1, 2, 3), r"leaves 2 of 6"),
        ((0, 1, 1), "each once"),
        ((0, 1, 6), "joints from 0 to 5"),
    ],
)
def test_leading_joints_that_do_not_fit(m, leading, words):
    with pytest.raises(ValueError, match=words):
        following_joints(m.robot, leading)


def test_a_joint_that_moves_both_hands_alike_cannot_follow(m):
    """As the first joint of a torso that carries both arms."""
    torso = m.robot.replace(parents=(-1, 0, 1, 0, 3, 4))
    with pytest.raises(ValueError, match="joint 0 to follow, which does not move"):
        following_joints(torso, (1, 2, 3))
    assert following_joints(torso, (0, 1, 2)) == (3, 4, 5)
    assert AS_PRINTED.leading is None
