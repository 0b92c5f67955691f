"""What every estimator answers: planar inertial parameters with their uncertainty.

An estimator is a pair of pure functions; evaluation never asks which one it has.
"""

import enum
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.features import Examples
from mjx_inertia.pushing import PushStatus

TARGETS = ("mass", "inertia", "com_x", "com_y")


class EstimateStatus(enum.IntEnum):
    """Whether an estimate may be used."""

    OK = 0
    BAD_INPUT = 1  # the push has no usable signals; mean and covariance are not finite
    NOT_IDENTIFIABLE = 2  # the push does not tell the mass
    AT_BOUND = 3  # a parameter of the body stands at its bound
    NOT_CONVERGED = 4  # the model's signals stay away from the measured ones
    DIVERGED = 5  # the simulation is not finite wherever the search came


@struct.dataclass
class Estimate:
    """Estimated (mass kg, I_zz kg m², com_x m, com_y m), in the order of `TARGETS`.

    The CoM counts from the first contact point: x along the inward contact normal, y to its left.
    """

    mean: Float[Array, "n 4"]  # the estimate; NaN where the status is not `OK`
    # its covariance, in the units of the mean; infinite variances and zero covariances (that is, no
    # information) where the status is not `OK`
    covariance: Float[Array, "n 4 4"]
    status: Int[Array, " n"]  # an `EstimateStatus`


@dataclass(frozen=True)
class Estimator:
    """A pair of pure functions: `fit(examples, key=key) -> fitted`, `predict(fitted, examples)`.

    `fit` reads the truth of the rows that `usable_rows` names and no other row. The same examples
    and key give the same fitted. `fitted` is a record that `save_fitted` can store.
    """

    name: str
    fit: Callable[..., Any]
    predict: Callable[[Any, Examples], Estimate]


KeyArray = jax.Array


def usable_rows(examples: Examples) -> Bool[Array, " n"]:
    """Rows that may be fitted and predicted: status `OK` and finite features."""
    finite = jnp.all(jnp.isfinite(examples.features), axis=1)
    return (jnp.asarray(examples.status) == PushStatus.OK) & finite


def targets_of(examples: Examples) -> Float[Array, "n 4"]:
    """The truth as rows in the order of `TARGETS`.

    Raises:
      ValueError: the examples carry no truth.
    """
    truth = examples.truth
    if truth is None:
        raise ValueError(
            "fit: `examples.truth` is None; only pushes with known truth can be fitted"
        )
    com = jnp.asarray(truth.com)
    return jnp.stack([jnp.asarray(truth.mass), jnp.asarray(truth.inertia), *com.T], axis=1)


def answer(
    mean: Float[Array, "n 4"], covariance: Float[Array, "n 4 4"], usable: Bool[Array, " n"]
) -> Estimate:
    """An `Estimate` in which rows that are not usable say so and carry no number."""
    nothing = jnp.diag(jnp.full(len(TARGETS), jnp.inf, covariance.dtype))
    return Estimate(
        mean=jnp.where(usable[:, None], mean, jnp.nan),
        covariance=jnp.where(usable[:, None, None], covariance, nothing),
        status=jnp.where(usable, EstimateStatus.OK, EstimateStatus.BAD_INPUT).astype(jnp.int32),
    )
