"""The network against closed forms, and its training against itself interrupted."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from estimators.problem import problem
from scipy.stats import multivariate_normal

from mjx_inertia.estimators import MlpSettings, load_fitted, mlp_training, save_fitted
from mjx_inertia.estimators.mlp_estimator import _block, fit_mlp, mlp, predict_mlp
from mjx_inertia.estimators.mlp_training import (
    Normal,
    Shape,
    TrainingRows,
    TrainingSettings,
    apply_network,
    covariance_of,
    initial_weights,
    input_scale,
    inputs_of,
    read_mlp_checkpoint,
    surprise,
    train_network,
    write_mlp_checkpoint,
)
from mjx_inertia.features import FeatureSettings
from mjx_inertia.features.example_table import feature_names
from mjx_inertia.features.feature_sets import BINS, MEAN_FORCE, SCALES, series_grid

SMALL = MlpSettings(width=16, depth=1, epochs=12, least_steps=0, checkpoint_every=3, progress=False)
KEY = jax.random.key(0)


def equal(left, right):
    pairs = zip(jax.tree.leaves(left), jax.tree.leaves(right), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


def regression(seed=0, rows=300, noise=1.0):
    """Rows that a network of this size learns by heart, so that it fits new ones ever worse."""
    rng = np.random.default_rng(seed)
    inputs = rng.normal(size=(rows, 8))
    targets = inputs[:, :4] + noise * rng.normal(size=(rows, 4))
    inputs, targets = jnp.asarray(inputs, jnp.float32), jnp.asarray(targets, jnp.float32)
    third = rows // 3
    start = jnp.zeros((8, 4))
    return TrainingRows(start, inputs[third:], targets[third:], inputs[:third], targets[:third])


def random_factor(seed, rows=7):
    rng = np.random.default_rng(seed)
    factor = np.tril(rng.normal(size=(rows, 4, 4)))
    factor[:, range(4), range(4)] = np.exp(rng.normal(size=(rows, 4)))
    return factor


def test_surprise_is_the_likelihood_of_a_normal_distribution():
    rng = np.random.default_rng(0)
    factor, mean, targets = random_factor(1), rng.normal(size=(7, 4)), rng.normal(size=(7, 4))
    covariance = np.linalg.inv(factor @ factor.transpose(0, 2, 1))
    normal = Normal(jnp.asarray(mean, jnp.float32), jnp.asarray(factor, jnp.float32))
    np.testing.assert_allclose(covariance_of(normal), covariance, rtol=1e-3, atol=1e-4)
    rows = zip(targets, mean, covariance, strict=True)
    want = -np.mean([multivariate_normal(m, c).logpdf(y) for y, m, c in rows])
    got = surprise(normal, jnp.asarray(targets, jnp.float32))
    np.testing.assert_allclose(got, want - 2 * np.log(2 * np.pi), rtol=1e-4)


def test_inputs_are_standardised_and_bounded():
    rng = np.random.default_rng(2)
    features = np.exp(rng.normal(size=(500, 5))).astype(np.float32)
    features[:, 3] = 7.0  # does not vary
    inputs = np.asarray(inputs_of(input_scale(features), jnp.asarray(features)))
    varying = [0, 1, 2, 4, 5, 6, 7, 9]
    np.testing.assert_allclose(inputs.mean(axis=0)[varying], 0, atol=1e-4)
    assert (np.abs(inputs.std(axis=0)[varying] - 1) < 0.05).all()
    assert not inputs[:, [3, 8]].any()
    far = inputs_of(input_scale(features), jnp.full((1, 5), 1e30))
    assert np.isfinite(far).all() and np.abs(far).max() <= 8


def test_before_training_the_network_is_its_linear_start():
    rows, shape = regression(), Shape(inputs=8, width=16, depth=2)
    start = jnp.asarray(np.random.default_rng(3).normal(size=(8, 4)), jnp.float32)
    normal = apply_network(shape, initial_weights(shape, start, key=KEY), rows.inputs)
    np.testing.assert_allclose(normal.mean, rows.inputs @ start, rtol=1e-4, atol=1e-5)
    np.testing.assert_array_equal(normal.factor, np.broadcast_to(np.eye(4), normal.factor.shape))


@pytest.mark.long
def test_mass_starts_in_proportion_to_the_mean_force():
    """Twice all forces: twice the mass and I_zz, even before anything is learnt."""
    rows = series_problem(0, 400)
    force = rows.columns.index(MEAN_FORCE)
    rows = rows.replace(features=rows.features.at[:, force].set(3 * rows.truth.mass))
    settings = dataclasses.replace(SMALL, learning_rate=0.0, epochs=1, mirror=False)
    fitted = fit_mlp(settings, rows, key=KEY)
    once = predict_mlp(fitted, rows).mean
    twice = predict_mlp(fitted, rows.replace(features=rows.features.at[:, force].multiply(2))).mean
    small = np.asarray(rows.truth.mass) < 2  # twice as much is still within the range of training
    np.testing.assert_allclose(once[small, 0], rows.truth.mass[small], rtol=0.1)
    np.testing.assert_allclose(twice[small, :2] / once[small, :2], 2, rtol=0.1)
    np.testing.assert_allclose(twice[small, 2:], once[small, 2:], rtol=1e-4)


@pytest.mark.long
def test_early_stopping_restores_the_best_weights():
    rows, shape = regression(), Shape(inputs=8, width=64, depth=2)
    recipe = TrainingSettings(
        epochs=200, batch=32, learning_rate=3e-3, weight_decay=0.0, patience=15
    )
    best = train_network(rows, shape, recipe, key=KEY)

    def held_out(weights):
        found = apply_network(shape, weights, rows.inputs_aside)
        return float(surprise(found, rows.targets_aside))

    first, order = jax.random.split(KEY)
    progress = mlp_training._begin(rows, shape, recipe, first)
    reached = []
    for _ in range(60):
        progress = mlp_training._epoch(progress, rows, order, shape=shape, recipe=recipe)
        reached.append(held_out(progress.weights))
    number = int(np.argmin(reached))
    assert number + 15 < 60, "the example must overfit"
    assert held_out(best) == pytest.approx(min(reached), abs=1e-4)
    assert reached[-1] > min(reached) + 0.1
    assert int(progress.best_epoch) == number + 1


def interrupt_after(monkeypatch, epochs):
    """Makes training fail before epoch `epochs` + 1; returns the epochs begun."""
    begun, epoch = [], mlp_training._epoch

    def counted(*arguments, **settings):
        if len(begun) == epochs:
            raise KeyboardInterrupt
        begun.append(1)
        return epoch(*arguments, **settings)

    monkeypatch.setattr(mlp_training, "_epoch", counted)
    return begun


def test_an_interrupted_fit_goes_on_from_its_checkpoint(tmp_path, monkeypatch):
    rows = problem(0, 600, noise=0.1)
    want = fit_mlp(SMALL, rows, key=KEY)
    path = tmp_path / "new" / "mlp.npz"
    settings = dataclasses.replace(SMALL, checkpoint=str(path))
    with monkeypatch.context() as patch:
        interrupt_after(patch, 8)
        with pytest.raises(KeyboardInterrupt):
            fit_mlp(settings, rows, key=KEY)
    with monkeypatch.context() as patch:
        begun = interrupt_after(patch, 100)
        assert equal(fit_mlp(settings, rows, key=KEY), want)
        assert len(begun) == 12 - 6  # of 8 epochs done, 6 had been written
        assert equal(fit_mlp(settings, rows, key=KEY), want)
        assert len(begun) == 12 - 6
    assert [file.name for file in path.parent.iterdir()] == ["mlp.npz"]


def test_a_checkpoint_of_another_fit_is_not_gone_on_from(tmp_path):
    rows = problem(0, 600, noise=0.1)
    settings = dataclasses.replace(SMALL, checkpoint=str(tmp_path / "mlp.npz"))
    fit_mlp(settings, problem(1, 600, noise=0.1), key=KEY)
    assert equal(fit_mlp(settings, rows, key=KEY), fit_mlp(SMALL, rows, key=KEY))
    other = jax.random.key(1)
    assert equal(fit_mlp(settings, rows, key=other), fit_mlp(SMALL, rows, key=other))


def test_damaged_checkpoints_are_refused(tmp_path):
    path = tmp_path / "mlp.npz"
    tree = {"a": jnp.arange(3.0), "b": jnp.zeros((), jnp.int32)}
    assert read_mlp_checkpoint(path, "this", tree) is None
    write_mlp_checkpoint(path, "this", tree)
    assert equal(read_mlp_checkpoint(path, "this", tree), tree)
    assert read_mlp_checkpoint(path, "that", tree) is None
    for content in (b"", path.read_bytes()[:100], b"mass, inertia\n"):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"mlp\.npz: expected a checkpoint"):
            read_mlp_checkpoint(path, "this", tree)


def uneven(seed, number):
    """A problem whose features are thirty times noisier in every other row, and say so."""
    rng = np.random.default_rng(seed)
    rows = problem(seed, number)
    noise = np.where(np.arange(number) % 2, 0.3, 0.01)[:, None]
    features = np.asarray(rows.features)
    features = features + noise * features.std(axis=0) * rng.normal(size=features.shape)
    features[:, 9] = noise[:, 0]
    return rows.replace(features=jnp.asarray(features, jnp.float32))


@pytest.mark.long
def test_covariance_is_that_of_each_row():
    settings = dataclasses.replace(SMALL, width=48, epochs=40)
    fitted = fit_mlp(settings, uneven(0, 3000), key=KEY)
    new = uneven(1, 2000)
    estimate = predict_mlp(fitted, new)
    truth = np.stack([new.truth.mass, new.truth.inertia, *np.asarray(new.truth.com).T], axis=1)
    std = np.sqrt(np.diagonal(np.asarray(estimate.covariance), axis1=1, axis2=2))
    score = (np.asarray(estimate.mean) - truth) / std
    for half in (slice(0, None, 2), slice(1, None, 2)):
        size = np.sqrt(np.mean(score[half] ** 2, axis=0))
        assert ((size > 0.7) & (size < 1.5)).all(), size
    assert (np.median(std[1::2], axis=0) > 3 * np.median(std[::2], axis=0)).all()


def series_problem(seed, number):
    """The problem's features as signals of one value each."""
    rows, columns = problem(seed, number), feature_names("series", FeatureSettings())
    table = jnp.repeat(rows.features[:, :9], BINS, axis=1)
    scales = rows.features[:, : len(SCALES)]
    return rows.replace(features=jnp.concatenate([table, scales], axis=1), columns=columns)


@pytest.mark.long
def test_convolutions_over_time(tmp_path):
    settings = dataclasses.replace(SMALL, channels=8, features="series")
    fitted = fit_mlp(settings, series_problem(0, 800), key=KEY)
    assert fitted.shape.grid == (9, BINS)
    new = series_problem(1, 300)
    estimate = predict_mlp(fitted, new)
    error = np.asarray(estimate.mean)[:, 0] / np.asarray(new.truth.mass) - 1
    assert np.sqrt(np.mean(error**2)) < 0.15
    save_fitted(tmp_path / "fitted.npz", fitted)
    again = load_fitted(tmp_path / "fitted.npz")
    assert again.shape == fitted.shape
    np.testing.assert_array_equal(predict_mlp(again, new).mean, estimate.mean)
    with pytest.raises(ValueError, match="no table of signals by time"):
        fit_mlp(dataclasses.replace(SMALL, channels=8), problem(0, 100), key=KEY)
    with pytest.raises(ValueError, match="no table of signals by time"):
        series_grid(feature_names("series", FeatureSettings())[5:])


def test_training_and_prediction_compile_once():
    rows = problem(0, 600, noise=0.1)
    mlp_training._epoch.clear_cache()
    _block.clear_cache()
    estimator = mlp(SMALL)
    for _ in range(2):
        fitted = estimator.fit(rows, key=KEY)
        for number in (3, 700):
            estimator.predict(fitted, problem(1, number))
    assert _block._cache_size() == 1
    assert mlp_training._epoch._cache_size() == 1


def test_nothing_is_printed(capfd):
    settings = dataclasses.replace(SMALL, epochs=2, progress=True)
    mlp(settings).fit(problem(0, 100), key=KEY)
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""
