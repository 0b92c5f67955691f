"""The published arms against the figures that their sources allow to check by hand."""

import jax
import numpy as np
import pytest

from mjx_inertia.robots import baxter, gravity_torque, hand_pose, lwa4d
from mjx_inertia.spatial import Consistency, check_consistency

ALL = [
    baxter("left"),
    baxter("right", "bare"),
    lwa4d(),
    lwa4d("upstream_commented", "parallel_jaw"),
]


def at_zero(arm):
    q = np.zeros(arm.dof)
    return jax.jit(lambda q: (hand_pose(arm, q).translation, gravity_torque(arm, q)))(q)


def test_baxter_at_rest():
    arm = baxter("left", "bare")
    place, torque = at_zero(arm)
    np.testing.assert_allclose(place, [0.797462, 0.992465, 0.320976], atol=1e-6)
    expected = [0.0, -52.875864, 0.030021, -15.609362, 0.201226, -1.818999, 0.005091]
    np.testing.assert_allclose(torque, expected, atol=1e-6)
    assert arm.links.mass.sum() == pytest.approx(19.71082, abs=1e-9)


def test_baxters_arms_mirror_each_other_in_their_mounts():
    left, right = (at_zero(baxter(side))[0] for side in ("left", "right"))
    np.testing.assert_allclose(left * np.array([1, -1, 1]), right, atol=1e-12)


def test_baxters_gripper_adds_its_published_mass():
    with_hand, bare = baxter(), baxter(hand="bare")
    added = with_hand.links.mass - bare.links.mass
    np.testing.assert_allclose(added, [0] * 6 + [0.36], atol=1e-12)
    reach = np.linalg.norm(with_hand.T_link_hand.translation - bare.T_link_hand.translation)
    assert reach == pytest.approx(0.025 + 0.1327)


def test_lwa4d_at_zero():
    place, _ = at_zero(lwa4d())
    np.testing.assert_allclose(place, [0, 0, 0.9734], atol=1e-12)
    assert lwa4d().links.mass.sum() == pytest.approx(14.35)
    assert lwa4d("upstream_commented").links.mass.sum() == pytest.approx(11.95)


def test_estimates_say_so():
    assert "not published" in lwa4d().note
    assert "mass is published" in baxter().note


@pytest.mark.parametrize("arm", ALL, ids=lambda arm: arm.name)
def test_every_link_is_a_possible_body(arm):
    verdict = jax.vmap(check_consistency)(jax.tree.map(jax.numpy.asarray, arm.links))
    assert (np.asarray(verdict) == Consistency.CONSISTENT).all()


@pytest.mark.parametrize("arm", ALL, ids=lambda arm: arm.name)
def test_right_angles_are_exact(arm):
    rotation = arm.T_parent_joint.rotation
    np.testing.assert_array_equal(rotation, np.round(rotation))


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: baxter("middle"), "left, right"),
        (lambda: baxter(hand="claw"), "electric_gripper, bare"),
        (lambda: lwa4d("measured"), "mesh_estimate, upstream_commented"),
        (lambda: lwa4d(hand="claw"), "flange, parallel_jaw"),
    ],
)
def test_unknown_choices_are_told(make, word):
    with pytest.raises(ValueError, match=word):
        make()
