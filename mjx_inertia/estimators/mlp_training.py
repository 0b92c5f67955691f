"""Trains the network of `mlp`: whole epochs compiled, early stopping, checkpoints to go on from.

In: inputs and standardised targets of the rows to fit and of those held out. Out: the weights that
were best on the rows held out.
"""

import zlib
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
import optax
from flax import struct
from jaxtyping import Array, Float, Int
from tqdm import tqdm

from mjx_inertia.estimators.estimate import KeyArray
from mjx_inertia.estimators.mlp_network import (
    Shape,
    Weights,
    apply_network,
    initial_weights,
    surprise,
)
from mjx_inertia.files import read_arrays, write_arrays

Tree = TypeVar("Tree")
_LONGEST_STEP = 1.0  # norm of the gradient beyond which it is shortened
_SETTLED = 0.01  # the last learning rate over the highest


def write_mlp_checkpoint(path: Path, fingerprint: str, tree: object) -> None:
    """Writes the arrays of `tree`; an interrupted write leaves what was there before."""
    arrays = {f"leaf_{number}": np.asarray(leaf) for number, leaf in _leaves(tree)}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, {"fingerprint": np.array(fingerprint), **arrays})


def read_mlp_checkpoint(path: Path, fingerprint: str, like: Tree) -> Tree | None:
    """The tree, in the structure of `like`; None if there is no file or it belongs to another.

    Raises:
      ValueError: the file is damaged or of another kind.
    """
    if not path.is_file():
        return None
    remedy = "; delete it or name another"
    with read_arrays(path, "a checkpoint of `mlp`", remedy) as arrays:
        if str(arrays["fingerprint"]) != fingerprint:
            return None
        leaves = [jnp.asarray(arrays[f"leaf_{number}"]) for number, _ in _leaves(like)]
    return jax.tree.unflatten(jax.tree.structure(like), leaves)


def _leaves(tree: object) -> enumerate:
    return enumerate(jax.tree.leaves(tree))


@dataclass(frozen=True)
class TrainingSettings:
    """How the weights are found."""

    epochs: int  # passes over the data
    batch: int  # rows in one step
    learning_rate: float  # highest; it rises over the first epoch and falls as a cosine
    weight_decay: float  # of AdamW
    patience: int  # epochs without a better likelihood of the rows held out after which it ends


@struct.dataclass
class TrainingRows:
    """Inputs and standardised targets, on the device."""

    start: Float[Array, "e 4"]  # linear map from inputs to targets to begin with
    inputs: Float[Array, "n e"]  # to fit
    targets: Float[Array, "n 4"]  # to fit
    inputs_aside: Float[Array, "m e"]  # held out
    targets_aside: Float[Array, "m 4"]  # held out


@struct.dataclass
class TrainingState:
    """Where training is: all that must be known to go on."""

    weights: Weights  # now
    optimiser: optax.OptState  # its state
    best: Weights  # the weights that did best on the rows held out
    least: Float[Array, ""]  # the surprise at the rows held out with these
    epoch: Int[Array, ""]  # epochs done
    best_epoch: Int[Array, ""]  # epochs that `best` had seen


def _optimiser(recipe: TrainingSettings, steps: int) -> optax.GradientTransformation:
    rate = optax.warmup_cosine_decay_schedule(
        init_value=0.0,
        peak_value=recipe.learning_rate,
        warmup_steps=steps,
        decay_steps=steps * max(2, recipe.epochs),
        end_value=_SETTLED * recipe.learning_rate,
    )
    adam = optax.adamw(rate, b2=0.99, weight_decay=recipe.weight_decay)
    return optax.chain(optax.clip_by_global_norm(_LONGEST_STEP), adam)


def _steps(recipe: TrainingSettings, rows: TrainingRows) -> tuple[int, int]:
    """Steps of an epoch, and rows of a step."""
    batch = min(recipe.batch, len(rows.targets))
    return len(rows.targets) // batch, batch


@partial(jax.jit, static_argnames=("shape", "recipe"))
def _epoch(
    progress: TrainingState,
    rows: TrainingRows,
    key: KeyArray,
    *,
    shape: Shape,
    recipe: TrainingSettings,
) -> TrainingState:
    """One pass over the rows in an order of its own."""
    steps, batch = _steps(recipe, rows)
    optimiser = _optimiser(recipe, steps)
    order = jax.random.permutation(jax.random.fold_in(key, progress.epoch), len(rows.targets))

    def loss(weights: Weights, inputs: jax.Array, targets: jax.Array) -> jax.Array:
        return surprise(apply_network(shape, weights, inputs), targets)

    def step(carry: tuple, chosen: jax.Array) -> tuple[tuple, None]:
        weights, state = carry
        slope = jax.grad(loss)(weights, rows.inputs[chosen], rows.targets[chosen])
        change, state = optimiser.update(slope, state, weights)
        return (optax.apply_updates(weights, change), state), None

    start = (progress.weights, progress.optimiser)
    chosen = order[: steps * batch].reshape(steps, batch)
    (weights, state), _ = jax.lax.scan(step, start, chosen)

    epoch = progress.epoch + 1
    reached = loss(weights, rows.inputs_aside, rows.targets_aside)
    better = reached < progress.least  # false if it is not finite
    kept = jax.tree.map(partial(jnp.where, better), weights, progress.best)
    best_epoch = jnp.where(better, epoch, progress.best_epoch)
    least = jnp.where(better, reached, progress.least)
    return TrainingState(weights, state, kept, least, epoch, best_epoch)


def _begin(
    rows: TrainingRows, shape: Shape, recipe: TrainingSettings, key: KeyArray
) -> TrainingState:
    weights = initial_weights(shape, rows.start, key=key)
    state = _optimiser(recipe, _steps(recipe, rows)[0]).init(weights)
    none = jnp.zeros((), jnp.int32)
    return TrainingState(weights, state, weights, jnp.full((), jnp.inf, jnp.float32), none, none)


def _fingerprint(rows: TrainingRows, shape: Shape, recipe: TrainingSettings, key: KeyArray) -> str:
    """Of everything that decides the outcome: only the same training may be gone on with."""
    leaves = [np.asarray(leaf) for leaf in (*jax.tree.leaves(rows), jax.random.key_data(key))]
    sums = [f"{leaf.shape} {zlib.crc32(leaf.tobytes()):08x}" for leaf in leaves]
    return f"{shape} {recipe} {sums}"


def train_network(
    rows: TrainingRows,
    shape: Shape,
    recipe: TrainingSettings,
    *,
    key: KeyArray,
    checkpoint: Path | None = None,
    checkpoint_every: int = 5,
    description: str | None = None,
) -> Weights:
    """The weights that were best on the rows held out.

    Args:
      rows: fitted and held out.
      shape: of the network.
      recipe: of the training.
      key: of the first weights and of the order of the rows.
      checkpoint: file to go on from, if it is of this training, and to write to.
      checkpoint_every: epochs between two writes.
      description: of the progress bar; None hides it.

    Raises:
      ValueError: `checkpoint` is a file of another kind.
    """
    first, order = jax.random.split(key)
    progress = _begin(rows, shape, recipe, first)
    fingerprint = _fingerprint(rows, shape, recipe, key) if checkpoint else ""
    if checkpoint:
        progress = read_mlp_checkpoint(checkpoint, fingerprint, progress) or progress
    hide = None if description else True  # None: hidden where stderr is no terminal
    done = int(progress.epoch)
    bar = tqdm(total=recipe.epochs, initial=done, desc=description, disable=hide, leave=False)
    with bar:
        while done < recipe.epochs and done - int(progress.best_epoch) < recipe.patience:
            progress = _epoch(progress, rows, order, shape=shape, recipe=recipe)
            done = int(progress.epoch)
            bar.update()
            bar.set_postfix(held_out=f"{float(progress.least):.2f}")
            if checkpoint and (done % checkpoint_every == 0 or done == recipe.epochs):
                write_mlp_checkpoint(checkpoint, fingerprint, progress)
    return progress.best
