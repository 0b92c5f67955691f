"""What learners share: the rows they may see, target scales, rows held out. `mean` learns least.

In: `Examples`. Out: `TrainingTable` on the host, since the libraries that train live there.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.estimators.estimate import (
    Estimate,
    Estimator,
    KeyArray,
    answer,
    targets_of,
    usable_rows,
)
from mjx_inertia.features import Examples, columns_of_set, select_columns

MIN_ROWS = 10
_MIN_OBJECTS = 10


@struct.dataclass
class TargetScale:
    """Standardisation of targets, after a logarithm of mass and I_zz if `logarithmic`."""

    mean: Float[Array, "4"]  # of the (logarithm of the) targets
    std: Float[Array, "4"]  # of the same; 1 where a target does not vary
    # whether mass and I_zz are taken as logarithms
    logarithmic: bool = struct.field(pytree_node=False)


@dataclass(frozen=True)
class TrainingTable:
    """Usable rows as NumPy arrays."""

    features: np.ndarray  # float32, rows by columns
    targets: np.ndarray  # mass, I_zz, com_x, com_y in SI units
    columns: tuple[str, ...]  # names of the features


def training_table(examples: Examples, feature_set: str | None) -> TrainingTable:
    """Rows with status `OK` and finite features; columns of `feature_set` (None: all).

    Raises:
      ValueError: no truth, no such columns, fewer than `MIN_ROWS` usable rows, or a usable row
        whose truth cannot be: not finite, or a mass or I_zz that is not positive.
    """
    columns = columns_of_set(examples.columns, feature_set)
    keep = np.asarray(usable_rows(examples))
    targets = np.asarray(targets_of(examples), dtype=np.float64)[keep]
    if len(targets) < MIN_ROWS:
        raise ValueError(
            f"fit: {len(targets)} of {keep.size} examples are usable (status OK, finite features); "
            f"at least {MIN_ROWS} are needed"
        )
    impossible = ~np.isfinite(targets).all(axis=1) | (targets[:, :2] <= 0).any(axis=1)
    if impossible.any():
        raise ValueError(
            f"fit: the truth of {impossible.sum()} usable examples is not finite or has a mass or "
            f"inertia that is not positive; the first such row holds {targets[impossible][0]}"
        )
    features = np.asarray(select_columns(examples, columns), dtype=np.float32)[keep]
    return TrainingTable(features, targets, columns)


def target_scale(targets: np.ndarray, logarithmic: bool) -> TargetScale:
    """The scale that standardises `targets`."""
    values = _maybe_log(targets, logarithmic)
    std = values.std(axis=0)
    std = np.where(std > 1e-9 * np.abs(values).max(axis=0), std, 1.0)
    return TargetScale(jnp.asarray(values.mean(axis=0)), jnp.asarray(std), logarithmic)


def standardise(scale: TargetScale, targets: np.ndarray) -> np.ndarray:
    """Targets in SI units to standardised ones, float32."""
    values = _maybe_log(targets, scale.logarithmic)
    return ((values - np.asarray(scale.mean)) / np.asarray(scale.std)).astype(np.float32)


def _maybe_log(targets: np.ndarray, logarithmic: bool) -> np.ndarray:
    if not logarithmic:
        return targets
    return np.concatenate([np.log(targets[:, :2]), targets[:, 2:]], axis=1)


def to_units(
    scale: TargetScale, mean: Float[Array, "n 4"], covariance: Float[Array, "n 4 4"]
) -> tuple[Float[Array, "n 4"], Float[Array, "n 4 4"]]:
    """Standardised mean and covariance to SI units.

    A logarithm's mean becomes the median of the mass or I_zz; its covariance is carried over by
    the delta method, d exp(z) = exp(z) dz.
    """
    values = mean * scale.std + scale.mean
    slope = jnp.broadcast_to(scale.std, values.shape)
    if scale.logarithmic:
        positive = jnp.exp(values[:, :2])
        values = values.at[:, :2].set(positive)
        slope = slope.at[:, :2].multiply(positive)
    return values, slope[:, :, None] * covariance * slope[:, None, :]


def seed_of(key: KeyArray) -> int:
    """A seed for a library that takes an integer."""
    return int(jax.random.randint(key, (), 0, 2**31 - 1))


def held_out(targets: np.ndarray, fraction: float, seed: int) -> np.ndarray:
    """Mask of rows to hold out: whole objects, so that their errors are those on unseen objects.

    Rows with the same mass and I_zz are taken for one object. With fewer than ten objects single
    rows are drawn instead, and the errors are those on new pushes of known objects.
    """
    generator = np.random.default_rng(seed)
    objects = np.unique(targets[:, :2], axis=0, return_inverse=True)[1].reshape(-1)
    if objects.max() + 1 < _MIN_OBJECTS:
        objects = np.arange(len(targets))
    number = objects.max() + 1
    chosen = generator.permutation(number)[: max(1, round(fraction * number))]
    return np.isin(objects, chosen)


@dataclass(frozen=True)
class MeanSettings:
    """Nothing to set."""


@struct.dataclass
class FittedMean:
    """Mean (mass, I_zz, com_x, com_y) of the training targets and their covariance, SI units."""

    mean: Float[Array, "4"]
    covariance: Float[Array, "4 4"]


def fit_mean(examples: Examples, *, key: KeyArray) -> FittedMean:
    """Mean and covariance of the targets of usable rows; `key` is not used."""
    del key
    targets = training_table(examples, None).targets
    return FittedMean(jnp.asarray(targets.mean(axis=0)), jnp.asarray(np.cov(targets.T)))


def predict_mean(fitted: FittedMean, examples: Examples) -> Estimate:
    """The same answer for every usable push; features and columns are not read."""
    usable = usable_rows(examples)
    return answer(
        jnp.broadcast_to(fitted.mean, (usable.size, 4)),
        jnp.broadcast_to(fitted.covariance, (usable.size, 4, 4)),
        usable,
    )


def mean(settings: MeanSettings = MeanSettings()) -> Estimator:
    """The estimator that predicts the training mean."""
    del settings
    return Estimator("mean", fit_mean, predict_mean)
