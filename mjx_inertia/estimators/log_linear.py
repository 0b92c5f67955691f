"""Targets as linear functions of the features and of their logarithms: what power laws leave over.

F = μ m g, m = impulse / speed and I = m a²/6 are sums of logarithms, which trees can only fit in
steps; this stage takes them, and the trees of `boosted` learn the rest. In: features and
standardised targets. Out: `LogLinear`, evaluated in JAX.
"""

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

_FLOOR = 1e-4  # of a feature's mean magnitude: the logarithm of less says nothing
_PENALTIES = 10.0 ** np.arange(-6, 3)


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


def fit_log_linear(
    features: Float[np.ndarray, "n d"], targets: Float[np.ndarray, "n k"]
) -> LogLinear:
    """Fits by ridge regression; generalised cross-validation chooses each target's penalty.

    Args:
      features: raw.
      targets: standardised: their mean is zero.
    """
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


def predict_log_linear(fitted: LogLinear, features: Float[Array, "n d"]) -> Float[Array, "n k"]:
    """Standardised targets, kept in the range of the training."""
    design = jnp.concatenate([features, jnp.log(jnp.abs(features) + fitted.floor)], 1)
    design = (design - fitted.mean) * fitted.inverse_std
    answer = jnp.matmul(design, fitted.weights, precision="highest")
    return jnp.clip(answer, fitted.low, fitted.high)
