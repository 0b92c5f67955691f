"""The multi-output regression forest of the thesis (§3.4): XGBoost trains, JAX predicts.

In: `Examples`. Out: `FittedForest`, `Estimate`. Targets are standardised, not logarithms, as in the
thesis. The spread between trees gives the shape of the covariance and held-out errors its size.
"""

from dataclasses import dataclass, replace
from functools import partial

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.estimators.estimate import Estimate, Estimator, KeyArray, answer, usable_rows
from mjx_inertia.estimators.training import (
    TargetScale,
    TrainingTable,
    held_out,
    seed_of,
    standardise,
    target_scale,
    to_units,
    training_table,
)
from mjx_inertia.estimators.trees import (
    Job,
    TreeEnsemble,
    TreeNode,
    join,
    readable_tree,
    sum_over_trees,
    train,
    with_products,
)
from mjx_inertia.features import Examples, select_columns

_CHUNK = 50  # trees grown in one call of the library: one step of the progress bar
_CALIBRATION_TREES = 100
_LEAST_VARIANCE = 1e-6  # standardised; below what float32 sums of squares resolve


@dataclass(frozen=True)
class ForestSettings:
    """How the trees are grown; the defaults are the thesis' best."""

    trees: int = 1500  # in the forest
    depth: int = 5  # levels of splits in a tree
    column_fraction: float = 0.75  # share of the features that a tree may look at
    # share of the pushes that a tree sees, drawn without replacement; 0.632 is the expected share
    # of distinct rows in a bootstrap sample
    row_fraction: float = 0.632
    bins: int = 64  # of the histogram of a feature
    # share of the objects left out of a small second forest; its errors on them scale the
    # covariance. The forest itself is fitted to all objects.
    held_out_fraction: float = 0.1
    # the feature set to use out of the examples' columns; None takes all
    features: str | None = "windows"
    progress: bool = True  # a bar on stderr, if that is a terminal


@struct.dataclass
class FittedForest:
    """A forest whose trees each predict all targets."""

    trees: TreeEnsemble  # their leaves hold standardised targets; the forest is their mean
    scale: TargetScale  # of the targets
    # by target, root mean square of held-out error over spread between trees
    spread_scale: Float[Array, "4"]
    columns: tuple[str, ...] = struct.field(pytree_node=False)  # names of the features


def grow(
    features: np.ndarray, targets: np.ndarray, settings: ForestSettings, seed: int
) -> TreeEnsemble:
    """A forest on standardised `targets`; its leaves hold each tree's own prediction."""
    sizes = [min(_CHUNK, settings.trees - start) for start in range(0, settings.trees, _CHUNK)]
    seeds = np.random.default_rng(seed).integers(2**31, size=len(sizes)).tolist()
    parts: list[TreeEnsemble] = []
    for size in sorted(set(sizes), reverse=True):
        found = train(
            features,
            [Job(targets, seeds[k]) for k, chunk in enumerate(sizes) if chunk == size],
            {
                "num_parallel_tree": size,
                "max_depth": settings.depth,
                "learning_rate": 1.0,
                "colsample_bytree": settings.column_fraction,
                "subsample": settings.row_fraction,
                "reg_lambda": 1e-5,  # as XGBRFRegressor
                "max_bin": settings.bins,
                "multi_strategy": "multi_output_tree",
            },
            rounds=1,
            description=f"forest, by {size} trees" if settings.progress else None,
        )
        # XGBoost divides the leaves by the number of trees.
        parts += [replace(part, leaf=part.leaf * size) for part in found]
    return join(parts, axis=1)


def forest_moments(
    trees: TreeEnsemble, features: Float[Array, "n d"]
) -> tuple[Float[Array, "n k"], Float[Array, "n k k"]]:
    """Mean of the trees' values and covariance between trees."""
    number, outputs = trees.feature.shape[1], trees.leaf.shape[-1]
    total = sum_over_trees(trees, features, statistic=with_products) / number
    mean, products = total[:, :outputs], total[:, outputs:].reshape(-1, outputs, outputs)
    covariance = products - mean[:, :, None] * mean[:, None, :]
    return mean, covariance + _LEAST_VARIANCE * jnp.eye(outputs)


def _spread_scale(
    table: TrainingTable, targets: np.ndarray, settings: ForestSettings, seed: int
) -> Float[Array, "4"]:
    aside = held_out(table.targets, settings.held_out_fraction, seed)
    small = replace(settings, trees=min(_CALIBRATION_TREES, settings.trees), progress=False)
    trees = grow(table.features[~aside], targets[~aside], small, seed)
    mean, spread = forest_moments(trees, jnp.asarray(table.features[aside]))
    square_error = jnp.mean((targets[aside] - mean) ** 2, axis=0)
    return jnp.sqrt(square_error / jnp.mean(jnp.diagonal(spread, axis1=1, axis2=2), axis=0))


def fit_forest(settings: ForestSettings, examples: Examples, *, key: KeyArray) -> FittedForest:
    """Grows the forest on all usable rows."""
    table = training_table(examples, settings.features)
    seed = seed_of(key)
    scale = target_scale(table.targets, logarithmic=False)
    targets = standardise(scale, table.targets)
    trees = grow(table.features, targets, settings, seed)
    return FittedForest(trees, scale, _spread_scale(table, targets, settings, seed), table.columns)


def predict_forest(fitted: FittedForest, examples: Examples) -> Estimate:
    """Mean over trees; covariance between trees, scaled by target to the held-out errors."""
    mean, spread = forest_moments(fitted.trees, select_columns(examples, fitted.columns))
    factor = fitted.spread_scale[:, None] * fitted.spread_scale
    return answer(*to_units(fitted.scale, mean, spread * factor), usable_rows(examples))


def forest_tree(fitted: FittedForest, tree: int) -> list[TreeNode]:
    """One tree to draw: leaves hold mass (kg), I_zz (kg m²), com_x, com_y (m)."""
    leaf = fitted.trees.leaf * fitted.scale.std + fitted.scale.mean
    return readable_tree(replace(fitted.trees, leaf=leaf), fitted.columns, tree)


def forest(settings: ForestSettings = ForestSettings()) -> Estimator:
    """The thesis' forest."""
    return Estimator("forest", partial(fit_forest, settings), predict_forest)
