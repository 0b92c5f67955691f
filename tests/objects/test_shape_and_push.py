"""Shape and push together: calibrated, exact where nothing is noisy, and honest about density."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from scipy import stats

from mjx_inertia.objects import (
    FULL_INERTIA_NAMES,
    ShapeEstimate,
    TriangleMesh,
    combine_shape_and_push,
    mass_properties,
)
from mjx_inertia.spatial import (
    InertialParameters,
    PlanarInertia,
    combine,
    from_log_cholesky,
    inertia_from_second_moment,
    to_log_cholesky,
    to_planar,
)

pytestmark = pytest.mark.float64

REFERENCE = np.array([0.1, -0.2, 0.03])
DENSITY = 800.0
# of the ten log-Cholesky parameters: 1 % of lengths, 1 mm of the rest
SHAPE_STD = np.array([0.01, 0.01, 0.01, 0.01, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3])


def wedge():
    mesh = trimesh.creation.extrude_triangulation(
        np.array([[0.0, 0.0], [0.15, 0.0], [0.0, 0.08]]), np.array([[0, 1, 2]]), 0.06
    )
    return mesh.apply_translation(REFERENCE + np.array([-0.05, -0.03, -0.03]))


@functools.cache
def truth():
    mesh = wedge()
    return mass_properties(mesh.vertices, mesh.faces, DENSITY)


@functools.cache
def true_theta():
    mesh = wedge()
    body = mass_properties(mesh.vertices - REFERENCE, mesh.faces)
    return np.asarray(to_log_cholesky(body), dtype=np.float64)


def shape(std=SHAPE_STD, seed=None):
    """An estimate with errors drawn from its own covariance; without errors for no seed."""
    mesh, theta = wedge(), true_theta()
    if seed is not None:
        theta = theta + std * np.random.default_rng(seed).normal(size=10)
    surface = TriangleMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64))
    return ShapeEstimate(theta, np.diag(std**2), REFERENCE, 1.0, surface)


def push(body, relative, seed=None, com_std=0.5e-3):
    """Planar parameters with errors, and their covariance; infinite where `relative` is."""
    planar = to_planar(body)
    mean = np.append([planar.mass, planar.inertia], planar.com)
    std = np.concatenate([np.array(relative) * mean[:2], np.full(2, com_std)])
    if seed is not None:
        known = np.isfinite(std)
        draw = np.random.default_rng(seed + 10_000).normal(size=4)
        mean = np.where(known, mean + np.where(known, std, 0.0) * draw, np.nan)
    return (
        PlanarInertia(jnp.asarray(mean[0]), jnp.asarray(mean[1]), jnp.asarray(mean[2:])),
        np.diag(std**2),
    )


def numbers(body):
    return np.concatenate([[body.mass], body.com, np.asarray(body.inertia)[np.tril_indices(3)]])


def test_exact_where_nothing_is_noisy():
    full = combine_shape_and_push(shape(), *push(truth(), (0.02, 0.05)))
    np.testing.assert_allclose(numbers(full.inertial), numbers(truth()), rtol=1e-9, atol=1e-12)
    assert full.density == pytest.approx(DENSITY)
    assert full.uniformity.statistic == pytest.approx(0.0, abs=1e-9)
    assert full.uniformity.gyration_z == pytest.approx(0.0, abs=1e-9)
    assert len(FULL_INERTIA_NAMES) == len(full.covariance) == 10


@pytest.mark.parametrize(
    ("relative", "com_std", "degrees"),
    [((0.02, np.inf), np.inf, 0), ((0.02, 0.06), np.inf, 1), ((0.02, 0.06), 5e-4, 3)],
)
def test_stated_uncertainties_are_met(relative, com_std, degrees):
    """Over 200 draws: z-scores of RMS 1, and p-values spread evenly from 0 to 1."""
    scores, p_values = [], []
    for seed in range(200):
        full = combine_shape_and_push(
            shape(seed=seed), *push(truth(), relative, seed=seed, com_std=com_std)
        )
        assert full.uniformity.degrees == degrees
        error = numbers(full.inertial) - numbers(truth())
        scores.append(error / np.sqrt(np.diag(full.covariance)))
        p_values.append(full.uniformity.p_value)
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(scores), axis=0)), 1.0, atol=0.18)
    if degrees:
        assert stats.kstest(p_values, "uniform").pvalue > 0.01
    else:
        assert set(p_values) == {1.0}


def test_more_knowledge_narrows_the_estimate():
    stds = [
        np.sqrt(np.diag(combine_shape_and_push(shape(), *push(truth(), r, com_std=c)).covariance))
        for r, c in (((0.05, np.inf), np.inf), ((0.05, 0.02), np.inf), ((0.05, 0.02), 1e-4))
    ]
    assert np.all(stds[1] <= stds[0] * (1 + 1e-9)) and stds[1][0] < 0.9 * stds[0][0]
    assert np.all(stds[2] <= stds[1] * (1 + 1e-9)) and stds[2][1] < 0.5 * stds[1][1]


def test_weights_in_the_corners_are_noticed_and_their_side_is_told():
    """A third of the mass moved outwards, or to the middle, at equal total."""
    body = truth()
    for offset, sign in ((0.06, 1.0), (0.0, -1.0)):
        places = np.array([[offset, 0.0, 0.0], [-offset, 0.0, 0.0]]) + np.asarray(body.com)
        weights = InertialParameters(
            jnp.full(2, float(body.mass) / 6), jnp.asarray(places), jnp.zeros((2, 3, 3))
        )
        rest = dataclasses.replace(body, mass=body.mass * 2 / 3, inertia=body.inertia * 2 / 3)
        loaded = combine(jax.tree.map(lambda a, b: jnp.concatenate([a, b[None]]), weights, rest))
        uniformity = combine_shape_and_push(shape(), *push(loaded, (0.02, 0.05))).uniformity
        assert sign * uniformity.gyration_z > 4.0
        assert uniformity.p_value < 1e-3


def test_a_shifted_center_of_mass_is_noticed_too():
    body = truth()
    shifted = dataclasses.replace(body, com=body.com + jnp.array([0.01, 0.0, 0.0]))
    uniformity = combine_shape_and_push(shape(), *push(shifted, (0.02, 0.05))).uniformity
    assert uniformity.p_value < 1e-6
    assert abs(uniformity.gyration_z) < 1e-6


def test_without_inertia_there_is_no_gyration():
    full = combine_shape_and_push(shape(), *push(truth(), (0.02, np.inf), seed=1))
    assert np.isnan(full.uniformity.gyration_z)
    assert full.uniformity.degrees == 2


def test_does_not_depend_on_where_the_shape_is_referred_to():
    one = shape(seed=3)
    offset = np.array([0.02, -0.01, 0.03])
    theta = one.theta - np.concatenate([np.zeros(7), offset])
    other = dataclasses.replace(one, theta=theta, reference=REFERENCE + offset)
    planar = push(truth(), (0.02, 0.05), seed=3)
    first, second = (combine_shape_and_push(s, *planar) for s in (one, other))
    np.testing.assert_allclose(numbers(second.inertial), numbers(first.inertial), rtol=1e-9)
    np.testing.assert_allclose(second.covariance, first.covariance, rtol=1e-6, atol=1e-20)


def test_the_estimate_is_a_possible_body():
    full = combine_shape_and_push(shape(seed=5), *push(truth(), (0.2, 0.5), seed=5))
    again = from_log_cholesky(to_log_cholesky(full.inertial))
    np.testing.assert_allclose(again.inertia, full.inertial.inertia, rtol=1e-9, atol=1e-15)
    assert np.all(np.linalg.eigvalsh(inertia_from_second_moment(full.inertial.inertia)) > 0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"covariance": np.diag([np.inf, 1.0, 1.0, 1.0])}, "variance of the mass is not finite"),
        ({"mass": -1.0}, "a positive mass"),
        ({"inertia": np.nan}, "expected finite numbers"),
        ({"covariance": np.diag([1.0, -1.0, 1.0, 1.0])}, "positive definite"),
    ],
)
def test_bad_pushes(change, message):
    planar, covariance = push(truth(), (0.02, 0.05))
    covariance = change.pop("covariance", covariance)
    planar = dataclasses.replace(planar, **{k: jnp.asarray(v) for k, v in change.items()})
    with pytest.raises(ValueError, match=message):
        combine_shape_and_push(shape(), planar, covariance)
