"""The estimator to beat: the mean of the training targets, whatever the push (errata 11)."""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.estimators.estimate import Estimate, Estimator, KeyArray, answer, usable_rows
from mjx_inertia.estimators.training import training_table
from mjx_inertia.features import Examples


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
