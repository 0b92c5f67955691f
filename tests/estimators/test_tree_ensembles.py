"""The compiled evaluation of trees against the library that trained them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xgboost
from estimators.problem import problem

from mjx_inertia.estimators.boosted_trees import BoostedSettings, boosted
from mjx_inertia.estimators.random_forest import ForestSettings, forest_moments, grow
from mjx_inertia.estimators.trees import (
    ColumnSearch,
    Job,
    _sum_of_block,
    ensemble_of,
    readable_tree,
    sum_over_trees,
    train,
    with_products,
)


def table(seed, number=3000, outputs=4):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(number, 12)).astype(np.float32)
    x[:, 3] = np.round(x[:, 3])  # ties: many values lie exactly on a threshold
    y = np.stack([x[:, k] * x[:, k + 4] + x[:, 3] for k in range(outputs)], axis=1)
    return x, y.astype(np.float32)


def library(x, y, **parameters):
    rounds = parameters.pop("rounds")
    fixed = {"tree_method": "hist", "base_score": 0.0, "verbosity": 0, "nthread": 1}
    data = xgboost.QuantileDMatrix(x, label=y)
    booster = xgboost.Booster({**fixed, **parameters}, [data])
    for number in range(rounds):
        booster.update(data, number)
    return booster


@pytest.mark.parametrize("strategy", ["multi_output_tree", "one_output_per_tree"])
@pytest.mark.parametrize("depth", [1, 6])
def test_boosted_trees_predict_as_the_library(strategy, depth):
    x, y = table(0)
    booster = library(
        x, y, multi_strategy=strategy, max_depth=depth, rounds=60, min_child_weight=20
    )
    new, _ = table(1, 4500)  # more than one block of rows
    want = booster.predict(xgboost.DMatrix(new))
    got = np.asarray(sum_over_trees(ensemble_of(booster, depth), jnp.asarray(new)))
    assert np.abs(got - want).max() < 1e-5 * np.abs(want).max()


def test_single_output_predicts_as_the_library():
    x, y = table(2, outputs=1)
    booster = library(x, y, max_depth=4, rounds=30)
    got = sum_over_trees(ensemble_of(booster, 4), jnp.asarray(x))
    want = booster.predict(xgboost.DMatrix(x))[:, None]
    assert np.abs(got - want).max() < 1e-5 * np.abs(want).max()


def test_forest_predicts_as_the_library_and_its_spread_is_that_between_trees():
    x, y = table(3)
    parameters = {
        "num_parallel_tree": 40,
        "max_depth": 5,
        "learning_rate": 1.0,
        "subsample": 0.632,
        "multi_strategy": "multi_output_tree",
    }
    booster = library(x, y, rounds=1, **parameters)
    want = booster.predict(xgboost.DMatrix(x))
    trees = ensemble_of(booster, 5)
    trees = trees.replace(leaf=trees.leaf * 40)
    mean, covariance = forest_moments(trees, jnp.asarray(x))
    assert np.abs(mean - want).max() < 1e-5 * np.abs(want).max()
    singles = [jax.tree.map(lambda a, k=k: a[:, k : k + 1], trees) for k in range(40)]
    each = np.stack([sum_over_trees(single, jnp.asarray(x[:50])) for single in singles])
    between = np.stack([np.cov(each[:, row].T, bias=True) for row in range(50)])
    np.testing.assert_allclose(covariance[:50], between, atol=2e-5)


def test_trees_are_read_as_the_library_dumps_them():
    x, y = table(4)
    booster = library(x, y[:, :1], max_depth=3, rounds=2, min_child_weight=200)
    dumped = booster.trees_to_dataframe()
    columns = tuple(f"f{k}" for k in range(12))
    for tree in range(2):
        want = dumped[dumped.Tree == tree]
        nodes = readable_tree(ensemble_of(booster, 3), columns, tree)
        assert len(nodes) == len(want)
        splits = {(node.feature, round(node.threshold, 4)) for node in nodes if node.feature}
        assert splits == {
            (row.Feature, round(row.Split, 4)) for row in want.itertuples() if row.Feature != "Leaf"
        }
        leaves = sorted(node.value[0] for node in nodes if node.value is not None)
        np.testing.assert_allclose(leaves, sorted(want[want.Feature == "Leaf"].Gain), rtol=1e-4)


def test_training_does_not_depend_on_the_number_of_cores(monkeypatch):
    x, y = table(5, 500)
    grown = []
    for cores in (1, 3):
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        grown.append(grow(x, y, ForestSettings(trees=120, depth=3, progress=False), seed=1))
    assert grown[0].feature.shape == (1, 120, 7)
    for one, three in zip(*map(jax.tree.leaves, grown), strict=True):
        np.testing.assert_array_equal(one, three)
    assert len({tuple(tree.tolist()) for tree in np.asarray(grown[0].threshold[0])}) > 100


def test_prediction_compiles_once_for_a_shape():
    x, y = table(6, 300)
    job = [Job(y, 0)]
    trees = train(x, job, {"max_bin": 16, "max_depth": 2}, 3, None)[0]
    other = train(x, job, {"max_bin": 16, "max_depth": 2, "learning_rate": 0.1}, 3, None)[0]
    _sum_of_block.clear_cache()
    for ensemble in (trees, other, trees):
        sum_over_trees(ensemble, jnp.asarray(x))
    assert _sum_of_block._cache_size() == 1
    sum_over_trees(trees, jnp.asarray(x), statistic=with_products)
    assert _sum_of_block._cache_size() == 2


def test_a_search_keeps_the_columns_that_matter():
    x, y = table(8)
    target = y[:, 1]  # of columns 1, 5 and 3
    parameters = {"max_bin": 32, "max_depth": 4, "learning_rate": 0.3}
    search = ColumnSearch(3, 10, {"max_depth": 3})
    (trees,) = train(x, [Job(target, 0)], parameters, 40, None, search)
    splits = np.asarray(trees.feature)[np.isfinite(np.asarray(trees.threshold))]
    assert set(splits.tolist()) == {1, 3, 5}
    left = target - np.asarray(sum_over_trees(trees, jnp.asarray(x)))[:, 0]
    assert left.std() < 0.2 * target.std()


def test_a_target_that_does_not_vary_is_learnt_from_any_column():
    x, _ = table(9, 300)
    search = ColumnSearch(3, 2, {})
    (trees,) = train(x, [Job(np.zeros(300), 0)], {"max_bin": 16, "max_depth": 2}, 2, None, search)
    assert not np.asarray(sum_over_trees(trees, jnp.asarray(x))).any()


def test_trees_deeper_than_said_are_refused():
    x, y = table(7, 300)
    with pytest.raises(ValueError, match="deeper than depth=1"):
        ensemble_of(library(x, y, max_depth=3, rounds=1), 1)


def test_nothing_is_printed(capfd):
    boosted(BoostedSettings(rounds=5)).fit(problem(0, 100), key=jax.random.key(0))
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""
