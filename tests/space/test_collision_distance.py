"""Distances between the parts of a robot against many points on each."""

import jax
import numpy as np
import planned
import pytest

from mjx_inertia.space import planar_robot
from mjx_inertia.space.collision_distance import clearance, segment_distance
from mjx_inertia.space.planar_model import planar_capture

ROBOT, CAPTURE = planar_robot(), planar_capture()


@pytest.fixture(scope="module")
def distances():
    """Positions, and the clearance with its slope along a direction."""
    rng = np.random.default_rng(7)
    q = rng.uniform(-2.5, 2.5, (100, 6))
    q[0] = 0.0  # arms stretched out beside each other
    along = rng.normal(size=(100, 6))

    def one(q, direction):
        return jax.jvp(lambda q: clearance(ROBOT, CAPTURE, q), (q,), (direction,))

    with jax.enable_x64(True):
        run = jax.jit(jax.vmap(one))
        found, slope = (np.asarray(x) for x in run(q, along))
        ahead, behind = (np.asarray(run(q + h * along, along)[0]) for h in (1e-6, -1e-6))
    return q, found, slope, (ahead - behind) / 2e-6


def test_clearance_against_many_points(distances):
    """The points here are a sixtieth of a link apart, those there at the base an eighth."""
    q, found, *_ = distances
    wanted = np.array([planned.sampled_clearance(row) for row in q])
    assert np.all(found - wanted < 1.2 / 16.0 + 1e-9)
    assert np.all(found - wanted > -1.2 / 60.0)
    assert np.sum(wanted < 0.0) > 10 and np.sum(wanted > 0.0) > 10
    # most are decided elsewhere than at the base, and agree
    assert np.mean(np.abs(found - wanted) < 1e-2) > 0.8


def test_slope_is_that_of_differences(distances):
    *_, slope, difference = distances
    assert np.all(np.isfinite(slope))
    near = np.abs(slope - difference) < 1e-6
    assert np.mean(near[1:]) > 0.95  # it has corners, where one pair takes over from another


CASES = {
    "crossing": (((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0)), 0.0),
    "crossing over each other": (((-1, 0, 0), (1, 0, 0), (0, -1, 0.5), (0, 1, 0.5)), 0.5),
    "touching": (((0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 1, 0)), 0.0),
    "one on the other": (((0, 0, 0), (1, 0, 0), (0.5, 0, 0), (2, 0, 0)), 0.0),
    "parallel": (((0, 0, 0), (1, 0, 0), (0, 2, 0), (1, 2, 0)), 2.0),
    "parallel, apart along both": (((0, 0, 0), (1, 0, 0), (4, 4, 0), (9, 4, 0)), 5.0),
    "one behind the other": (((0, 0, 0), (1, 0, 0), (3, 0, 0), (4, 0, 0)), 2.0),
    "a point and a segment": (((0, 0, 0), (0, 0, 0), (1, 1, 0), (1, -1, 0)), 1.0),
}


@pytest.fixture(scope="module")
def segment_distances():
    """The cases in three orders, and random segments: ends, distances, their slopes."""
    ends = np.array([case[0] for case in CASES.values()], float)
    orders = [ends, ends[:, [2, 3, 0, 1]], ends[:, [1, 0, 3, 2]]]
    every = np.concatenate([*orders, np.random.default_rng(8).normal(size=(200, 4, 3))])
    with jax.enable_x64(True):
        run = jax.jit(jax.vmap(jax.value_and_grad(segment_distance)))
        found, slope = run(*np.moveaxis(every, 1, 0))
    return every, np.asarray(found), np.asarray(slope)


def test_distance_of_two_segments(segment_distances):
    _, found, slope = segment_distances
    wanted = [case[1] for case in CASES.values()]
    ours = found[: 3 * len(CASES)].reshape(3, -1)
    np.testing.assert_allclose(ours, [wanted] * 3, rtol=0, atol=1e-12)
    assert np.all(np.isfinite(slope))


def test_distance_of_random_segments(segment_distances):
    every, found, _ = segment_distances
    share = np.linspace(0.0, 1.0, 201)[:, None]
    for (a, b, c, d), ours in zip(every[3 * len(CASES) :], found[3 * len(CASES) :], strict=True):
        first, second = a + share * (b - a), c + share * (d - c)
        wanted = np.min(np.linalg.norm(first[:, None] - second, axis=-1))
        assert -1e-12 < wanted - ours < 0.03
