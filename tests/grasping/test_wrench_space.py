"""ε against a closed form, from below by Qhull, from above by random directions."""

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from contact_pairs import PAD, contact_pairs, facing, one, turned
from wrench_hull import wrench_hull

from mjx_inertia.grasping import Contacts, SoftFinger
from mjx_inertia.grasping.contact_model import (
    antipodal_margin,
    grasp_map,
    is_force_closure,
    support,
    tangents,
)
from mjx_inertia.grasping.wrench_space import epsilon_quality, payload_epsilon
from mjx_inertia.spatial import InertialParameters

LENGTH = 0.05
COUNT = 24


@jax.jit
@jax.vmap
def epsilons(contacts, reference):
    return jnp.stack(
        [
            epsilon_quality(contacts, PAD, reference, LENGTH),
            epsilon_quality(contacts, PAD, reference, LENGTH, norm="linf"),
        ]
    )


@jax.jit
@jax.vmap
def weakest_of_many(contacts, reference):
    """Least support over random directions: never below ε."""
    drawn = jax.random.normal(jax.random.key(0), (30_000, 6))
    drawn = drawn / jnp.linalg.norm(drawn, axis=1, keepdims=True)
    drawn = drawn.at[:, 3:].divide(LENGTH)
    each = jax.vmap(lambda twist: support(contacts, PAD, twist, reference))(drawn)
    total = jnp.sum(jnp.maximum(each, 0.0), axis=1)
    return jnp.stack([jnp.min(jnp.max(each, axis=1)), jnp.min(total)])


def grasps():
    reference = np.random.default_rng(2).normal(size=(COUNT, 3)) * 0.03
    return contact_pairs(COUNT, seed=2), jnp.asarray(reference)


@pytest.mark.long
def test_epsilon_is_between_hull_and_random_directions():
    contacts, reference = grasps()
    quality = np.asarray(epsilons(contacts, reference))
    closed = np.flatnonzero(quality[:, 0] > 0.0)
    above = np.asarray(weakest_of_many(contacts, reference))
    assert np.all(quality[closed] <= above[closed] * (1.0 + 1e-9))
    for row in closed[:4]:
        coarse, fine = (
            wrench_hull(one(contacts, row), PAD, reference[row], LENGTH, edges=edges).epsilon
            for edges in (10, 20)
        )
        assert coarse <= fine <= quality[row, 0] * (1.0 + 1e-6)
        # what is missing falls with the square of the number of edges
        assert quality[row, 0] == pytest.approx(fine + (fine - coarse) / 3.0, rel=0.02)


@pytest.mark.long
def test_each_contact_alone_at_most_is_stronger_than_in_sum():
    contacts, reference = grasps()
    total, each = np.asarray(epsilons(contacts, reference)).T
    assert np.all(each >= total * (1.0 - 1e-9))
    assert np.all(each <= 2.0 * total * (1.0 + 1e-9))
    row = int(np.argmax(total))
    hull = wrench_hull(one(contacts, row), PAD, reference[row], LENGTH, norm="linf", edges=6)
    assert 0.5 * each[row] <= hull.epsilon <= each[row]


@pytest.mark.parametrize("width", [0.02, 0.08, 0.3])
@pytest.mark.parametrize("torsion", [0.002, 0.2])
def test_epsilon_of_facing_pads_in_closed_form(width, torsion):
    """The weakest wrench is a torsion, or loads one pad only: a force and a moment across.

    With force a, moment b / κ and squeeze c, κ = width / (2 length), the pads bear
    max(μ|a + b| - c, μ|a - b| + c) = μ max(a, b) at the best c = μ min(a, b); on the unit sphere
    a² + b² / κ² + c² = 1 this is least at a = b.
    """
    pad = SoftFinger(0.5, torsion)
    aside = 0.5 / np.sqrt(1.0 + (2.0 * LENGTH / width) ** 2 + 0.5**2)
    expected = min(aside, torsion / LENGTH)
    quality = jax.jit(epsilon_quality)(facing(width), pad, jnp.zeros(3), LENGTH)
    assert float(quality) == pytest.approx(expected, rel=1e-6)


def test_epsilon_of_a_payload_is_that_of_its_hull():
    """A slab held askew: moments about its CoM, over the root of its mean square radius."""
    size, com = np.array([0.06, 0.04, 0.02]), np.array([0.004, -0.002, 0.001])
    tensor = 0.3 / 12.0 * np.diag((size**2).sum() - size**2)
    payload = InertialParameters(jnp.asarray(0.3), jnp.asarray(com), jnp.asarray(tensor))
    contacts = contact_pairs(3, seed=7)
    quality = np.asarray(payload_epsilon(contacts, PAD, payload))
    assert np.all(quality > 0.0)
    radius = np.sqrt((size**2).sum() / 12.0)
    for row in range(3):
        hull = wrench_hull(one(contacts, row), PAD, com, radius, edges=20)
        assert 0.97 * quality[row] < hull.epsilon <= quality[row] * (1.0 + 1e-6)


@pytest.mark.long
def test_measures_do_not_depend_on_the_frame():
    contacts, reference = grasps()
    pose = jaxlie.SE3.exp(jnp.array([0.3, -0.2, 0.5, 0.7, -1.1, 0.4]))
    moved, moved_reference = turned(contacts, pose), jax.vmap(pose.apply)(reference)
    before = np.asarray(epsilons(contacts, reference))
    np.testing.assert_allclose(epsilons(moved, moved_reference), before, rtol=1e-4)
    row = int(np.argmax(before[:, 0]))
    hulls = [
        wrench_hull(one(c, row), PAD, r[row], LENGTH, edges=20).volume
        for c, r in ((contacts, reference), (moved, moved_reference))
    ]
    assert hulls[0] == pytest.approx(hulls[1], rel=0.1)  # the points of the cone turn


def test_gradient_against_finite_differences():
    contacts, reference = grasps()
    quality = np.asarray(epsilons(contacts, reference))[:, 0]
    usable = quality > 0.005

    def along(step, contacts, reference):
        shifted = contacts.replace(points=contacts.points + step * shift)
        return epsilon_quality(shifted, PAD, reference, LENGTH)

    shift = jnp.asarray(np.random.default_rng(4).normal(size=(2, 3)))
    slope = jax.jit(jax.vmap(jax.grad(along), in_axes=(None, 0, 0)))(0.0, contacts, reference)
    step = 1e-5
    moved = [
        np.asarray(epsilons(contacts.replace(points=contacts.points + s * shift), reference))[:, 0]
        for s in (step, -step)
    ]
    numeric = (moved[0] - moved[1]) / (2.0 * step)
    error = np.abs(np.asarray(slope) - numeric)[usable] / (np.abs(numeric)[usable] + 1e-2)
    assert np.median(error) < 1e-3
    assert np.mean(error < 0.02) > 0.85  # the rest have two weakest directions, or nearly


def test_force_closure_is_where_the_hull_holds_the_origin():
    contacts = contact_pairs(40, tilt=0.35, seed=5)
    margin = np.asarray(jax.vmap(lambda pair: antipodal_margin(pair, PAD))(contacts))
    closed = np.asarray(jax.vmap(lambda pair: is_force_closure(pair, PAD))(contacts))
    rows = np.concatenate([np.flatnonzero(margin > 0.12)[:4], np.flatnonzero(margin < -0.05)[:4]])
    assert len(rows) == 8
    for row in rows:
        hull = wrench_hull(one(contacts, row), PAD, jnp.zeros(3), LENGTH, edges=12)
        assert (hull.epsilon > 1e-5) == closed[row]


def test_two_hard_points_are_never_force_closure():
    hard = SoftFinger(0.5, 0.0)
    assert not bool(is_force_closure(facing(0.05), hard))
    assert wrench_hull(facing(0.05), hard, jnp.zeros(3), LENGTH).volume < 1e-8
    # three pads that cannot turn about their normals close all the same
    angle = 2.0 * np.pi * np.arange(3) / 3.0
    outward = np.stack([np.cos(angle), np.sin(angle), np.zeros(3)], axis=1)
    three = Contacts(jnp.asarray(0.05 * outward), jnp.asarray(-outward))
    assert wrench_hull(three, hard, jnp.zeros(3), LENGTH).epsilon > 0.02


def test_support_is_the_greatest_power_over_the_cone():
    rng = np.random.default_rng(6)
    contacts, reference = one(contact_pairs(1), 0), jnp.asarray(rng.normal(size=3) * 0.02)
    matrix = np.asarray(grasp_map(contacts, reference))
    ball = rng.normal(size=(200_000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    forces = np.column_stack([np.ones(len(ball)), 0.5 * ball[:, :2], 0.004 * ball[:, 2]])
    twist = rng.normal(size=6) * np.array([1.0, 1.0, 1.0, 50.0, 50.0, 50.0])
    greatest = np.asarray(support(contacts, PAD, jnp.asarray(twist), reference))
    for contact in range(2):
        power = forces @ matrix[:, 4 * contact : 4 * contact + 4].T @ twist
        assert power.max() <= greatest[contact] + 1e-12
        assert power.max() == pytest.approx(greatest[contact], rel=1e-3)


def test_tangents_complete_the_normal():
    normals = np.concatenate([np.eye(3), -np.eye(3), np.random.default_rng(0).normal(size=(50, 3))])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    both = np.asarray(jax.vmap(tangents)(jnp.asarray(normals)))
    frames = np.concatenate([normals[:, None], both], axis=1)
    np.testing.assert_allclose(
        frames @ frames.transpose(0, 2, 1), np.eye(3) + np.zeros((56, 1, 1)), atol=1e-12
    )


def test_bad_input():
    with pytest.raises(ValueError, match="`norm`"):
        epsilon_quality(facing(0.05), PAD, jnp.zeros(3), LENGTH, norm="l2")
