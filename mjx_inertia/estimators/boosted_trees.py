"""Boosted trees on a log-linear stage: XGBoost trains, JAX predicts log mass, log I_zz and the CoM.

In: `Examples`. Out: `FittedBoosted`, `Estimate`. F = μ m g, m = impulse / speed and I = m a²/6 are
sums of logarithms, which trees can only fit in steps: a ridge regression on the features and their
logarithms takes these, and the trees learn the rest. Each target has trees of its own: trees with
vector leaves (`multi_output_tree`) took longer and were less accurate on mass and CoM (a little
better on I_zz). A few rounds choose the columns of each target; the trees to come see only these.
"""

from dataclasses import dataclass
from functools import partial

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.estimators.estimate import Estimate, Estimator, KeyArray, answer, usable_rows
from mjx_inertia.estimators.training import (
    TargetScale,
    held_out,
    seed_of,
    standardise,
    target_scale,
    to_units,
    training_table,
)
from mjx_inertia.estimators.trees import (
    ColumnSearch,
    Job,
    TreeEnsemble,
    join,
    sum_over_trees,
    train,
)
from mjx_inertia.features import Examples, select_columns

_FLOOR = 1e-4  # of a feature's mean magnitude: the logarithm of less says nothing
_PENALTIES = 10.0 ** np.arange(-6, 3)
# Mass and I_zz are products of powers of what is measured; the CoM is none.
_POWER_LAWS = np.array([1.0, 1.0, 0.0, 0.0], np.float32)


@struct.dataclass
class LogLinear:
    """A ridge regression on features and logarithms of their magnitudes."""

    floor: Float[Array, " d"]  # added to each magnitude before the logarithm
    mean: Float[Array, " e"]  # of the features and logarithms
    inverse_std: Float[Array, " e"]  # of the same; 0 where they do not vary
    weights: Float[Array, "e k"]  # of the standardised features
    low: Float[Array, " k"]  # smallest target of the training; the answer is kept above
    high: Float[Array, " k"]  # largest


def _expanded(features: np.ndarray, floor: np.ndarray) -> np.ndarray:
    return np.concatenate([features, np.log(np.abs(features) + floor)], 1)


def _fit_log_linear(
    features: Float[np.ndarray, "n d"], targets: Float[np.ndarray, "n k"]
) -> LogLinear:
    """Ridge regression to targets of mean 0; generalised cross-validation sets each penalty."""
    n = len(features)
    floor = _FLOOR * np.abs(features).mean(0, dtype=np.float64) + 1e-12
    design = _expanded(features.astype(np.float64), floor)
    mean, std = design.mean(0), design.std(0)
    inverse_std = np.where(std > 1e-9, 1.0 / np.maximum(std, 1e-9), 0.0)
    design = (design - mean) * inverse_std
    values, vectors = np.linalg.eigh(design.T @ design / n)
    values = np.maximum(values, 0.0)
    projected = vectors.T @ (design.T @ targets) / n
    weights = []
    for k in range(targets.shape[1]):
        b, power = projected[:, k], float((targets[:, k] ** 2).mean())

        def score(penalty: float, b: np.ndarray = b, power: float = power) -> float:
            shrunk = b / (values + penalty)
            error = power - 2 * b @ shrunk + shrunk @ (values * shrunk)
            freedom = (values / (values + penalty)).sum() / n
            return float(error / max(1e-9, 1.0 - freedom) ** 2)

        best = min(_PENALTIES, key=score)
        weights.append(vectors @ (b / (values + best)))
    fields = (floor, mean, inverse_std, np.stack(weights, 1), targets.min(0), targets.max(0))
    return LogLinear(*(jnp.asarray(f, jnp.float32) for f in fields))


def _predict_log_linear(fitted: LogLinear, features: Float[Array, "n d"]) -> Float[Array, "n k"]:
    """Standardised targets, kept in the range of the training."""
    design = jnp.concatenate([features, jnp.log(jnp.abs(features) + fitted.floor)], 1)
    design = (design - fitted.mean) * fitted.inverse_std
    answer = jnp.matmul(design, fitted.weights, precision="highest")
    return jnp.clip(answer, fitted.low, fitted.high)


@dataclass(frozen=True)
class BoostedSettings:
    """How the trees are grown."""

    rounds: int = 200  # boosting rounds, each one tree per target
    depth: int = 7  # levels of splits in a tree
    least_rows: float = 3.0  # pushes in a leaf
    learning_rate: float = 0.1  # shrinkage of each tree
    columns: int = 60  # features of the most gain that the trees of a target may look at
    search_rounds: int = 8  # rounds on all features, that find out which gain most
    search_depth: int = 6  # levels of splits of the trees of these rounds
    # share of the chosen features that a tree may look at; the search takes 0.7 of that share of
    # all features
    column_fraction: float = 0.5
    row_fraction: float = 0.8  # share of the pushes that a tree sees
    bins: int = 64  # of the histogram of a feature
    # share of the objects left out of the fit; the errors on them give the covariance. It is not
    # refitted with them: the error is then that of the very trees used.
    held_out_fraction: float = 0.1
    # the feature set to use out of the examples' columns; None takes all
    features: str | None = None
    progress: bool = True  # a bar on stderr, if that is a terminal


@struct.dataclass
class FittedBoosted:
    """The two stages, the scale of their outputs, and the covariance of their errors in it."""

    linear: LogLinear  # first stage; the trees see its answers beside the features
    # second stage: what the first one leaves of mass and I_zz, and the whole CoM
    trees: TreeEnsemble
    scale: TargetScale  # of the targets
    error: Float[Array, "4 4"]  # covariance of held-out errors, standardised
    columns: tuple[str, ...] = struct.field(pytree_node=False)  # features used


def fit_boosted(settings: BoostedSettings, examples: Examples, *, key: KeyArray) -> FittedBoosted:
    """Boosts on all but the held-out objects, then measures the errors on these."""
    table = training_table(examples, settings.features)
    seed = seed_of(key)
    aside = held_out(table.targets, settings.held_out_fraction, seed)
    scale = target_scale(table.targets[~aside], logarithmic=True)
    targets = standardise(scale, table.targets)
    linear = _fit_log_linear(table.features[~aside], targets[~aside])
    first, rows = _first_stage(linear, jnp.asarray(table.features))
    left = targets - np.asarray(first)
    parts = train(
        np.asarray(rows)[~aside],
        [Job(target, (seed + number) % 2**31) for number, target in enumerate(left[~aside].T)],
        {
            "max_depth": settings.depth,
            "min_child_weight": settings.least_rows,
            "learning_rate": settings.learning_rate,
            "colsample_bytree": settings.column_fraction,
            "subsample": settings.row_fraction,
            "max_bin": settings.bins,
        },
        settings.rounds,
        "boosted trees" if settings.progress else None,
        ColumnSearch(
            settings.columns,
            settings.search_rounds,
            {
                "max_depth": settings.search_depth,
                "learning_rate": 1.5 * settings.learning_rate,
                "colsample_bytree": 0.7 * settings.column_fraction,
            },
        ),
    )
    trees = join(parts, axis=0)
    error = left[aside] - np.asarray(sum_over_trees(trees, rows[aside]))
    covariance = jnp.asarray(error.T @ error / len(error))
    return FittedBoosted(linear, trees, scale, covariance, table.columns)


def _first_stage(
    linear: LogLinear, features: Float[Array, "n d"]
) -> tuple[Float[Array, "n 4"], Float[Array, "n e"]]:
    """What the first stage contributes to the answer, and the rows that the trees see."""
    answer = _predict_log_linear(linear, features)
    return answer * _POWER_LAWS, jnp.concatenate([features, answer], 1)


def predict_boosted(fitted: FittedBoosted, examples: Examples) -> Estimate:
    """Estimates with the covariance of held-out errors: relative for mass and I_zz."""
    rows = select_columns(examples, fitted.columns)
    first, rows = _first_stage(fitted.linear, rows)
    mean = first + sum_over_trees(fitted.trees, rows)
    error = jnp.broadcast_to(fitted.error, (rows.shape[0], 4, 4))
    return answer(*to_units(fitted.scale, mean, error), usable_rows(examples))


def boosted(settings: BoostedSettings = BoostedSettings()) -> Estimator:
    """Gradient-boosted trees."""
    return Estimator("boosted", partial(fit_boosted, settings), predict_boosted)
