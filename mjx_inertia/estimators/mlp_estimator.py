"""A network with a normal distribution as its answer: flax.nnx, trained by likelihood.

In: `Examples`. Out: `FittedMlp`, `Estimate`. Each push has a covariance of its own, so one that
tells little says so. It is the best of the learners on every target with the features `series`.
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.estimators.estimate import Estimate, Estimator, KeyArray, answer, usable_rows
from mjx_inertia.estimators.mlp_training import (
    InputScale,
    Shape,
    TrainingRows,
    TrainingSettings,
    Weights,
    apply_network,
    covariance_of,
    input_scale,
    inputs_of,
    train_network,
)
from mjx_inertia.estimators.training import (
    TargetScale,
    held_out,
    seed_of,
    standardise,
    target_scale,
    to_units,
    training_table,
)
from mjx_inertia.features import Examples, select_columns
from mjx_inertia.features.feature_sets import MEAN_FORCE, mirror_signs, series_grid

_MIRROR = np.array([1.0, 1.0, 1.0, -1.0])  # mass, I_zz and CoM of the mirror image
_BLOCK = 512  # rows in flight: one compilation serves any number of rows


@dataclass(frozen=True)
class MlpSettings:
    """The network and its training."""

    width: int = 256  # of the hidden layers
    depth: int = 3  # residual blocks, two layers each
    # of two convolutions over time ahead of the blocks, for the features `series`; 0 for none
    channels: int = 0
    epochs: int = 80  # passes over the data
    least_steps: int = 4000  # few data are passed over more often, until there are that many steps
    batch: int = 128  # pushes in one step
    # the highest; it rises over the first epoch and falls as a cosine
    learning_rate: float = 1.5e-3
    weight_decay: float = 0.01  # of AdamW
    mirror: bool = True  # fit the mirror image of each push too, if the features are `series`
    # share of the epochs without a better likelihood of the pushes held out after which training
    # ends
    patience: float = 0.4
    # share of the objects left out of the fit: they decide which epoch was best and calibrate the
    # covariance
    held_out_fraction: float = 0.08
    # file from which an interrupted fit goes on; one of another fit is overwritten
    checkpoint: str | None = None
    checkpoint_every: int = 5  # epochs between two writes of it
    # the feature set to use out of the examples' columns; None takes all
    features: str | None = None
    progress: bool = True  # a bar on stderr, if that is a terminal


@struct.dataclass
class FittedMlp:
    """The network with the scales of what goes in and comes out."""

    weights: Weights  # arrays by layer
    inputs: InputScale  # scale of the inputs
    targets: TargetScale  # scale of the outputs
    mixing: Float[Array, "4 4"]  # matrix from what the network answers to standardised targets
    # held-out errors over their predicted standard deviations, RMS by target
    inflation: Float[Array, "4"]
    shape: Shape  # of the network
    columns: tuple[str, ...] = struct.field(pytree_node=False)  # features used


def fit_mlp(settings: MlpSettings, examples: Examples, *, key: KeyArray) -> FittedMlp:
    """Trains on all but the held-out objects, then calibrates the covariance on these."""
    table = training_table(examples, settings.features)
    aside = held_out(table.targets, settings.held_out_fraction, seed_of(key))
    shape = Shape(
        inputs=2 * len(table.columns),
        width=settings.width,
        depth=settings.depth,
        channels=settings.channels,
        grid=series_grid(table.columns) if settings.channels else (0, 0),
    )
    features, values = table.features[~aside], table.targets[~aside]
    signs = mirror_signs(table.columns) if settings.mirror else None
    if signs is not None:
        features = np.concatenate([features, features * signs])
        values = np.concatenate([values, values * _MIRROR])
    scale, entry = target_scale(values, logarithmic=True), input_scale(features)
    mixing = _mixing(standardise(scale, values))

    def prepared(x: np.ndarray, y: np.ndarray) -> tuple[jax.Array, jax.Array]:
        answers = standardise(scale, y) @ np.linalg.inv(mixing).T
        return inputs_of(entry, jnp.asarray(x)), jnp.asarray(answers, jnp.float32)

    start = _start(table.columns, entry, scale)
    outside = prepared(table.features[aside], table.targets[aside])
    rows = TrainingRows(start, *prepared(features, values), *outside)
    weights = train_network(
        rows,
        shape,
        _recipe(settings, len(rows.targets)),
        key=key,
        checkpoint=Path(settings.checkpoint) if settings.checkpoint else None,
        checkpoint_every=settings.checkpoint_every,
        description="network" if settings.progress else None,
    )
    matrix = jnp.asarray(mixing, jnp.float32)
    plain = FittedMlp(weights, entry, scale, matrix, jnp.ones(4), shape, table.columns)
    mean, covariance = _standardised(plain, jnp.asarray(table.features[aside]))
    wanted = standardise(scale, table.targets[aside])
    variance = jnp.diagonal(covariance, axis1=1, axis2=2)
    inflation = jnp.sqrt(jnp.mean((wanted - mean) ** 2 / variance, axis=0))
    return plain.replace(inflation=inflation)


def _mixing(targets: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "4 4"]:
    """The network answers what I_zz says beyond the mass: the motion alone tells that.

    So the exact ties of mass, I_zz and CoM (of cubes: m a²/6 and a/2) need no agreement between
    two answers that both follow the forces.
    """
    mass, inertia = targets[:, 0], targets[:, 1]
    slope = mass @ inertia / max(mass @ mass, 1e-9)
    rest = np.std(inertia - slope * mass)
    mixing = np.eye(4)
    mixing[1, :2] = slope, max(rest, 1e-3)
    return mixing


def _start(
    columns: tuple[str, ...], inputs: InputScale, targets: TargetScale
) -> Float[Array, "e 4"]:
    """A linear map to begin with: mass in proportion to the mean force, where that is a column.

    Pushes that differ by a factor in all forces and inertias move alike.
    """
    start = np.zeros((2 * len(columns), 4), np.float32)
    if MEAN_FORCE in columns:
        place = len(columns) + columns.index(MEAN_FORCE)
        start[place, 0] = 1 / max(float(inputs.inverse_std[place] * targets.std[0]), 1e-6)
    return jnp.asarray(start)


def _recipe(settings: MlpSettings, rows: int) -> TrainingSettings:
    steps = max(1, rows // settings.batch)
    epochs = max(settings.epochs, -(-settings.least_steps // steps))
    patience = max(1, round(settings.patience * epochs))
    return TrainingSettings(
        epochs, settings.batch, settings.learning_rate, settings.weight_decay, patience
    )


def _standardised(
    fitted: FittedMlp, features: Float[Array, "n d"]
) -> tuple[Float[Array, "n 4"], Float[Array, "n 4 4"]]:
    """Mean and covariance before they get units, block by block."""
    count = len(features)
    rows = jnp.pad(features, ((0, -count % _BLOCK if count else _BLOCK), (0, 0)))
    starts = range(0, len(rows), _BLOCK)
    blocks = [_block(fitted, rows[start : start + _BLOCK]) for start in starts]
    mean, covariance = (jnp.concatenate(parts)[:count] for parts in zip(*blocks, strict=True))
    return mean, covariance


@jax.jit
def _block(
    fitted: FittedMlp, features: Float[Array, "n d"]
) -> tuple[Float[Array, "n 4"], Float[Array, "n 4 4"]]:
    normal = apply_network(fitted.shape, fitted.weights, inputs_of(fitted.inputs, features))
    mixing = fitted.mixing
    covariance = mixing @ covariance_of(normal) @ mixing.T
    inflated = fitted.inflation[:, None] * covariance * fitted.inflation
    return jnp.matmul(normal.mean, mixing.T, precision="highest"), inflated


def predict_mlp(fitted: FittedMlp, examples: Examples) -> Estimate:
    """Estimates with a covariance for each push: relative for mass and I_zz."""
    mean, covariance = _standardised(fitted, select_columns(examples, fitted.columns))
    return answer(*to_units(fitted.targets, mean, covariance), usable_rows(examples))


def mlp(settings: MlpSettings = MlpSettings()) -> Estimator:
    """A network trained by likelihood."""
    return Estimator("mlp", partial(fit_mlp, settings), predict_mlp)
