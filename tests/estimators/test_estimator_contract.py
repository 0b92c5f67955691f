"""What every registered estimator must do."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from estimators.problem import problem

from mjx_inertia.estimators import ESTIMATORS, EstimateStatus, forest_tree, load_fitted, save_fitted
from mjx_inertia.estimators.estimate import targets_of
from mjx_inertia.estimators.random_forest import ForestSettings
from mjx_inertia.features import take_examples
from mjx_inertia.pushing import PushStatus

# Small enough for a test, and the share of the targets' variance that may stay unexplained on new
# noiseless rows. A forest of shallow trees is coarse; the mean explains nothing.
SMALL = {
    "mean": ({}, 1.1),
    "forest": ({"trees": 60, "depth": 7, "progress": False}, 0.15),
    "boosted": ({"rounds": 80, "depth": 4, "learning_rate": 0.2, "progress": False}, 0.05),
    "mlp": ({"width": 32, "depth": 1, "epochs": 10, "least_steps": 500, "progress": False}, 0.05),
}
RANDOM = ("forest", "boosted", "mlp")  # those that use their key
# Read signals, not features: see their own tests.
READS_SIGNALS = ("limit_surface", "sysid")
READS_COLUMNS = ("forest", "boosted", "mlp")


def make(name, **changes):
    registered = ESTIMATORS[name]
    return registered.factory(registered.settings(**{**SMALL[name][0], **changes}))


@pytest.fixture(scope="module")
def fitted():
    rows = problem(0, 1500)
    return {name: make(name).fit(rows, key=jax.random.key(0)) for name in SMALL}


@pytest.fixture(params=sorted(SMALL))
def name(request):
    return request.param


def equal(left, right):
    pairs = zip(jax.tree.leaves(left), jax.tree.leaves(right), strict=True)
    same = all(np.array_equal(a, b) for a, b in pairs)
    return same and jax.tree.structure(left) == jax.tree.structure(right)


def test_every_registered_estimator_is_tested_here():
    assert {*SMALL, *READS_SIGNALS} == set(ESTIMATORS)
    for name in SMALL:
        assert make(name).name == name
        assert dataclasses.is_dataclass(ESTIMATORS[name].settings)


def test_recovers_known_parameters(name, fitted):
    new = problem(1, 400)
    truth = np.asarray(targets_of(new))
    estimate = make(name).predict(fitted[name], new)
    unexplained = np.mean((np.asarray(estimate.mean) - truth) ** 2, axis=0) / truth.var(axis=0)
    assert (unexplained < SMALL[name][1]).all(), unexplained
    assert (np.asarray(estimate.status) == EstimateStatus.OK).all()


def test_covariance_is_that_of_the_errors_on_new_rows(name):
    estimator = make(name)
    fitted = estimator.fit(problem(2, 1500, noise=0.3), key=jax.random.key(0))
    new = problem(3, 1000, noise=0.3)
    estimate = estimator.predict(fitted, new)
    covariance = np.asarray(estimate.covariance)
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    error = np.asarray(estimate.mean - targets_of(new))
    std = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    inside = (np.abs(error) < 1.96 * std).mean(axis=0)
    assert ((inside > 0.88) & (inside <= 1)).all(), inside
    size = np.sqrt((error**2).mean(axis=0) / (std**2).mean(axis=0))
    assert ((size > 0.75) & (size < 1.3)).all(), size


def test_same_key_same_fit_and_other_key_another(name, fitted):
    rows = problem(0, 1500)
    assert equal(make(name).fit(rows, key=jax.random.key(0)), fitted[name])
    other = make(name).fit(rows, key=jax.random.key(1))
    assert equal(other, fitted[name]) == (name not in RANDOM)


def test_rows_that_are_not_ok_are_neither_fitted_nor_answered(name, fitted):
    rows = problem(0, 1500)
    bad = problem(4, 3)
    spoiled = bad.replace(
        features=bad.features.at[1, 2].set(jnp.nan),
        status=jnp.array([PushStatus.DIVERGED, PushStatus.OK, PushStatus.OK]),
        truth=bad.truth.replace(mass=jnp.array([1e9, 1e9, 1.0])),
    )
    joined = jax.tree.map(lambda a, b: jnp.concatenate([a, b[:2]]), rows, spoiled)
    assert equal(make(name).fit(joined, key=jax.random.key(0)), fitted[name])

    estimate = make(name).predict(fitted[name], spoiled.replace(truth=None))
    assert estimate.status.tolist() == [
        EstimateStatus.BAD_INPUT,
        EstimateStatus.BAD_INPUT,
        EstimateStatus.OK,
    ]
    assert np.isnan(estimate.mean[:2]).all()
    assert np.isinf(np.diagonal(estimate.covariance[:2], axis1=1, axis2=2)).all()
    assert np.isfinite(estimate.mean[2]).all()
    assert np.isfinite(estimate.covariance[2]).all()


def test_misuse_is_refused(name, fitted):
    rows = problem(0, 50)
    estimator = make(name)
    with pytest.raises(ValueError, match="truth"):
        estimator.fit(rows.replace(truth=None), key=jax.random.key(0))
    with pytest.raises(ValueError, match="5 of 5 examples are usable"):
        estimator.fit(take_examples(rows, jnp.arange(5)), key=jax.random.key(0))
    impossible = rows.replace(truth=rows.truth.replace(mass=rows.truth.mass.at[7].set(-1)))
    with pytest.raises(ValueError, match="not positive"):
        estimator.fit(impossible, key=jax.random.key(0))
    if name in READS_COLUMNS:
        fewer = rows.replace(features=rows.features[:, 1:], columns=rows.columns[1:])
        with pytest.raises(ValueError, match="windows/a0"):
            estimator.predict(fitted[name], fewer)
        with pytest.raises(ValueError, match="no column of the feature set 'moments'"):
            make(name, features="moments").fit(rows, key=jax.random.key(0))


def test_columns_are_found_by_name_whatever_their_order(name, fitted):
    rows = problem(5, 20)
    shuffled = rows.replace(features=rows.features[:, ::-1], columns=rows.columns[::-1])
    left, right = (make(name).predict(fitted[name], part) for part in (rows, shuffled))
    np.testing.assert_array_equal(left.mean, right.mean)


def test_empty_and_large_inputs(name, fitted):
    estimator = make(name)
    none = estimator.predict(fitted[name], take_examples(problem(5, 20), jnp.zeros(0, jnp.int32)))
    assert none.mean.shape == (0, 4)
    many = problem(6, 5000)
    whole = estimator.predict(fitted[name], many)
    part = estimator.predict(fitted[name], take_examples(many, jnp.arange(4900, 5000)))
    np.testing.assert_array_equal(whole.mean[4900:], part.mean)


def test_saved_and_loaded_is_equal(name, fitted, tmp_path):
    path = tmp_path / "fitted.npz"
    save_fitted(path, fitted[name])
    again = load_fitted(path)
    assert type(again) is type(fitted[name])
    assert equal(again, fitted[name])
    assert [file.name for file in tmp_path.iterdir()] == ["fitted.npz"]


def test_files_that_hold_no_fit_are_refused(fitted, tmp_path):
    with pytest.raises(FileNotFoundError, match=r"absent\.npz"):
        load_fitted(tmp_path / "absent.npz")
    whole = tmp_path / "whole.npz"
    save_fitted(whole, fitted["forest"])
    content = whole.read_bytes()
    broken = {
        "empty": b"",
        "truncated": content[: len(content) // 2],
        "text": b"mass, inertia\n1, 2\n",
        "flipped": content[:5000] + bytes(200) + content[5200:],
    }
    for kind, data in broken.items():
        path = tmp_path / f"{kind}.npz"
        path.write_bytes(data)
        with pytest.raises(ValueError, match=f"{kind}.npz: expected a fitted estimator"):
            load_fitted(path)
    np.savez(tmp_path / "other.npz", description=np.array('{"format": "x", "version": 1}'))
    with pytest.raises(ValueError, match="found 'x' version 1"):
        load_fitted(tmp_path / "other.npz")
    np.savez(tmp_path / "arrays.npz", a=np.zeros(3))
    with pytest.raises(ValueError, match=r"arrays\.npz: expected"):
        load_fitted(tmp_path / "arrays.npz")
    with pytest.raises(ValueError, match="STORED_TYPES"):
        save_fitted(whole, ForestSettings())
    assert whole.read_bytes() == content


def test_a_tree_of_the_forest_can_be_read(fitted):
    nodes = forest_tree(fitted["forest"], 3)
    rows = problem(7, 50)
    one = fitted["forest"].replace(
        trees=jax.tree.map(lambda leaf: leaf[:, 3:4], fitted["forest"].trees)
    )
    predicted = np.asarray(make("forest").predict(one, rows).mean)
    column = {name: np.asarray(rows.features)[:, k] for k, name in enumerate(rows.columns)}
    for row in range(50):
        node = nodes[0]
        while node.value is None:
            node = nodes[node.left if column[node.feature][row] < node.threshold else node.right]
        np.testing.assert_allclose(node.value, predicted[row], rtol=1e-5)
    with pytest.raises(ValueError, match="no tree 60"):
        forest_tree(fitted["forest"], 60)
