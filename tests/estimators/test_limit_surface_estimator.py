"""The quasi-static estimator against its own laws, against MJX, and on real pushes."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from estimators.quasi_static import quasi_static_push, random_pushes

from mjx_inertia.dataset import CubesProtocol, PushTruth, SensorNoise, add_noise, cubes_plan
from mjx_inertia.dataset.plan import Range, select_pushes
from mjx_inertia.estimators import (
    EstimateStatus,
    WrenchTwistGuess,
    com_from_wrench_twist,
    load_fitted,
    save_fitted,
)
from mjx_inertia.estimators.limit_surface_estimator import (
    LimitSurfaceSettings,
    limit_surface,
    limit_surface_fit,
)
from mjx_inertia.features import Examples
from mjx_inertia.objects import cube, load_mcube_objects
from mjx_inertia.pushing import PushStatus, build_scene, simulate

pytestmark = pytest.mark.long

COM, C, MAX_FORCE = np.array([0.031, -0.012]), 0.057, 7.3


def rows_of_the_laws(number, seed=0):
    """Loads on the ellipsoid and twists along its normals, about a point that is not the CoM."""
    rng = np.random.default_rng(seed)
    load = rng.normal(size=(number, 3)) * [1, 1, C]
    load *= MAX_FORCE / np.sqrt(load[:, 0] ** 2 + load[:, 1] ** 2 + (load[:, 2] / C) ** 2)[:, None]
    assert np.allclose(((load / [1, 1, C]) ** 2).sum(1), MAX_FORCE**2)  # thesis Eq. 3.7
    twist = load / [1, 1, C**2]  # Eq. 3.8
    twist *= rng.uniform(0.01, 0.05, (number, 1)) / np.linalg.norm(twist[:, :2], axis=1)[:, None]
    load[:, 2] += COM[0] * load[:, 1] - COM[1] * load[:, 0]
    twist[:, 0] += twist[:, 2] * COM[1]
    twist[:, 1] -= twist[:, 2] * COM[0]
    return load, twist


def solve(load, twist):
    one = jax.jit(com_from_wrench_twist)
    guess = WrenchTwistGuess(com=jnp.zeros(2))
    return one(jnp.asarray(load), jnp.asarray(twist), jnp.ones(len(load)), guess)


@pytest.mark.parametrize(("x64", "tolerance"), [(True, 1e-6), (False, 1e-5)])
def test_recovers_com_c_and_force_from_the_laws(x64, tolerance):
    with jax.enable_x64(x64):
        fit = solve(*rows_of_the_laws(40))
        assert fit.ok
        np.testing.assert_allclose(fit.com, COM, atol=tolerance)
        assert float(fit.radius) == pytest.approx(C, rel=10 * tolerance)
        assert float(fit.max_force) == pytest.approx(MAX_FORCE, rel=10 * tolerance)


def test_the_answer_moves_and_turns_with_the_frame():
    with jax.enable_x64(True):
        load, twist = rows_of_the_laws(40, seed=1)
        rng = np.random.default_rng(2)
        load, twist = (x * (1 + 0.02 * rng.normal(size=x.shape)) for x in (load, twist))
        angle = 0.7
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = [np.column_stack([x[:, :2] @ R.T, x[:, 2]]) for x in (load, twist)]
        fit, other = solve(load, twist), solve(*turned)
        np.testing.assert_allclose(other.com, R @ fit.com, atol=1e-6)
        np.testing.assert_allclose(
            other.covariance[:2, :2], R @ fit.covariance[:2, :2] @ R.T, atol=1e-9
        )


def test_a_wrong_row_changes_little():
    load, twist = rows_of_the_laws(60, seed=3)
    twist[5] *= -1
    np.testing.assert_allclose(solve(load, twist).com, COM, atol=1e-4)


def examples_of(records, truth, **changes):
    number = len(truth)
    return Examples(
        features=jnp.zeros((number, 1)),
        status=records.status,
        truth=PushTruth(
            mass=jnp.asarray(truth[:, 0]),
            inertia=jnp.asarray(truth[:, 0] * 0.004),
            com=jnp.asarray(truth[:, 1:3]),
        ),
        columns=("windows/none",),
        records=records,
        **changes,
    )


@pytest.fixture(scope="module")
def pushes():
    records, truth = random_pushes(0, 256)
    return add_noise(
        records, np.arange(256, dtype=np.uint32), SensorNoise(0.05), key=jax.random.key(1)
    ), truth


@pytest.fixture(scope="module")
def found(pushes):
    """Rows of all pushes, what is learnt from them, and the estimate."""
    rows = examples_of(*pushes)
    fitted = limit_surface().fit(rows, key=jax.random.key(0))
    return rows, fitted, limit_surface().predict(fitted, rows)


def test_intervals_are_honest_under_noise(pushes, found):
    _, truth = pushes
    *_, estimate = found
    assert (np.asarray(estimate.status) == EstimateStatus.OK).all()
    covariance = np.asarray(estimate.covariance)[:, 2:, 2:]
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    error = np.asarray(estimate.mean)[:, 2:] - truth[:, 1:3]
    z = error / np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    assert ((np.abs(z) < 1.96).mean(0) > 0.9).all(), (np.abs(z) < 1.96).mean(0)
    size = np.sqrt(np.median(z**2, axis=0) / 0.455)
    assert ((size > 0.75) & (size < 1.3)).all(), size
    assert np.median(np.abs(error)) < 5e-4


def test_what_cannot_be_told_has_infinite_variance(found):
    _, fitted, estimate = found
    covariance = np.asarray(estimate.covariance)
    assert np.isinf(covariance[:, [0, 1], [0, 1]]).all()
    np.testing.assert_array_equal(covariance[:, 0, 1:], 0)
    np.testing.assert_allclose(
        estimate.mean[:, :2], np.tile(fitted.mean[:2], (len(covariance), 1)), rtol=1e-6
    )


def test_friction_tells_mass():
    records, truth = random_pushes(3, 16)
    rows = examples_of(records, truth)
    known = limit_surface(LimitSurfaceSettings(friction=0.4))
    estimate = known.predict(known.fit(rows, key=jax.random.key(0)), rows)
    np.testing.assert_allclose(estimate.mean[:, 0], truth[:, 0] * truth[:, 4] / 0.4, rtol=1e-3)
    assert np.isfinite(estimate.covariance[:, 0]).all()


def test_a_push_that_does_not_turn_leaves_the_depth_open():
    record = quasi_static_push(jnp.array([0.07, 0.0]), 0.05, 8.0, jnp.array([0.03, 0.0]))
    settings = LimitSurfaceSettings()
    fit = jax.jit(lambda r: limit_surface_fit(r, jnp.array([0.05, 0.02]), settings))(record)
    spread = np.sqrt(np.diag(fit.covariance))
    assert fit.ok
    assert spread[0] > 0.9 * settings.com_reach
    assert spread[1] < 1e-3
    assert float(fit.com[1]) == pytest.approx(0, abs=1e-3)
    assert float(fit.com[0]) == pytest.approx(0.05, abs=1e-3)


def test_behaves_as_every_estimator_does(pushes, found, tmp_path):
    records, truth = pushes
    rows, fitted, first = found
    estimator = limit_surface()
    save_fitted(tmp_path / "fitted.npz", fitted)
    again = load_fitted(tmp_path / "fitted.npz")
    np.testing.assert_array_equal(first.mean, estimator.predict(again, rows).mean)

    status = records.status.at[1].set(PushStatus.DIVERGED)
    bad = records.replace(status=status, force=records.force.at[2, 100].set(jnp.nan))
    estimate = estimator.predict(fitted, examples_of(bad, truth).replace(truth=None))
    assert estimate.status[:4].tolist() == [
        EstimateStatus.OK,
        EstimateStatus.BAD_INPUT,
        EstimateStatus.BAD_INPUT,
        EstimateStatus.OK,
    ]
    assert np.isnan(estimate.mean[1:3]).all()
    with pytest.raises(ValueError, match="keep_records=True"):
        estimator.predict(fitted, dataclasses.replace(rows, records=None))
    with pytest.raises(ValueError, match="radius_factor"):
        LimitSurfaceSettings(radius_factor=1.0)


def test_slow_simulated_pushes_tell_the_com_to_a_millimetre():
    protocol = CubesProtocol(
        mass=Range(0.5, 5.0, 2),
        edge=Range(0.1, 0.2, 2),
        friction=Range(0.2, 0.6, 2),
        speeds=(0.01,),
    )
    whole = cubes_plan(protocol, seed=0)
    plan = select_pushes(whole, np.arange(0, len(whole), 13))
    record = simulate(
        build_scene(cube(0.15, 2.0)),
        plan.parameters,
        plan.motion.replace(duration=np.full(len(plan), 6.0)),
        contact_point=plan.contact_point,
        contact_normal=plan.contact_normal,
    )
    one = jax.jit(
        jax.vmap(lambda r: limit_surface_fit(r, jnp.array([0.05, 0.0]), LimitSurfaceSettings()))
    )
    fit = one(jax.tree.map(jnp.asarray, record))
    turned = np.abs(record.pose[:, -1, 2]) > np.radians(3)
    assert turned.sum() > len(plan) // 2
    error = np.linalg.norm(np.asarray(fit.com) - plan.truth.com, axis=1)
    assert error[turned].max() < 1e-3, error
    force = plan.parameters.friction * plan.truth.mass * 9.81
    np.testing.assert_allclose(fit.max_force[turned], force[turned], rtol=0.02)


def test_real_loads_and_twists_tell_the_com(measurements):
    """Median over objects, surfaces and speeds below 5 mm: the table is not quite even."""
    path = measurements / "mcube_quasistatic.npz"
    if not path.is_file():
        pytest.skip("no mcube_quasistatic.npz")
    objects, errors = load_mcube_objects(), []
    with np.load(path) as file:
        for key in sorted(file.files):
            kind, _, name, speed = key.split("/")
            if kind != "wrench_twist" or speed != "10" or name not in objects:
                continue
            outline = objects[name].outline
            rho = np.linalg.norm(outline - outline.mean(0), axis=1).mean()
            rows = file[key][:900].astype(np.float32)
            fit = solve(rows[:, :3] * [1, 1, rho], rows[:, 3:] * [1, 1, 1 / rho])
            error = np.asarray(fit.com) - np.asarray(objects[name].inertial.com)[:2]
            errors.append(np.linalg.norm(error))
    assert np.median(errors) < 0.005, errors
