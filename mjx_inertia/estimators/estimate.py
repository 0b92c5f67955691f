"""What every estimator answers: planar inertial parameters with their uncertainty.

An estimator is a pair of pure functions; evaluation never asks which one it has.
"""

import enum
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.features import Examples

TARGETS = ("mass", "inertia", "com_x", "com_y")


class EstimateStatus(enum.IntEnum):
    """Whether an estimate may be used."""

    OK = 0
    BAD_INPUT = 1  # the push has no usable signals; mean and covariance are not finite


@struct.dataclass
class Estimate:
    """Estimated (mass kg, I_zz kg m², com_x m, com_y m), in the order of `TARGETS`.

    The CoM counts from the first contact point: x along the inward contact normal, y to its left.

    Attributes:
      mean: the estimate.
      covariance: its covariance, in the units of the mean.
      status: an `EstimateStatus`.
    """

    mean: Float[Array, "n 4"]
    covariance: Float[Array, "n 4 4"]
    status: Int[Array, "n"]


@dataclass(frozen=True)
class Estimator:
    """A pair of pure functions: `fit(examples, key=key) -> fitted`, `predict(fitted, examples)`."""

    name: str
    fit: Callable[..., Any]
    predict: Callable[[Any, Examples], Estimate]


KeyArray = jax.Array
