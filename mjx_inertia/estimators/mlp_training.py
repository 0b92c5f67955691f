"""The network of `mlp`, features to a normal distribution, and its training by likelihood.

Inputs are taken twice, as compressed values and as logarithms of magnitudes: mass and I_zz are
products of powers of what is measured, and sensor noise in proportion to a value is alike in every
logarithm. In: raw features and standardised targets of the rows to fit and of those held out. Out:
the weights that were best on the rows held out; a mean and a covariance for each row. Whole epochs
are compiled; an interrupted training goes on from its checkpoint.
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
from flax import nnx, struct
from jaxtyping import Array, Float, Int
from tqdm import tqdm

from mjx_inertia.estimators.estimate import KeyArray
from mjx_inertia.files import read_arrays, write_arrays

Tree = TypeVar("Tree")
Weights = dict[str, jax.Array]  # by path, such as `blocks/0/up/kernel`

_FLOOR = 1e-2  # of a feature's mean magnitude: the logarithm of less is mostly noise
_FARTHEST = 8.0  # standard deviations; what lies beyond is taken to lie there
_STEEPEST = 8.0  # logarithm of the largest inverse standard deviation that the network can claim
_KERNEL = 5  # bins
_LONGEST_STEP = 1.0  # norm of the gradient beyond which it is shortened
_SETTLED = 0.01  # the last learning rate over the highest


@struct.dataclass
class InputScale:
    """Standardisation of compressed values, then of logarithms."""

    size: Float[Array, " d"]  # root mean square of the features
    floor: Float[Array, " d"]  # added to each magnitude before the logarithm
    mean: Float[Array, " e"]  # of the inputs
    inverse_std: Float[Array, " e"]  # of the inputs; 0 where they do not vary


def input_scale(features: Float[np.ndarray, "n d"]) -> InputScale:
    """The scale that standardises the inputs made of `features`."""
    size = np.sqrt(np.mean(features**2, axis=0, dtype=np.float64)) + 1e-12
    floor = _FLOOR * np.mean(np.abs(features), axis=0, dtype=np.float64) + 1e-12
    size, floor = jnp.asarray(size, jnp.float32), jnp.asarray(floor, jnp.float32)
    expanded = np.asarray(_expanded(jnp.asarray(features), size, floor))
    mean, std = expanded.mean(axis=0, dtype=np.float64), expanded.std(axis=0, dtype=np.float64)
    inverse = np.where(std > 1e-6, 1.0 / np.maximum(std, 1e-6), 0.0)
    return InputScale(
        size, floor, jnp.asarray(mean, jnp.float32), jnp.asarray(inverse, jnp.float32)
    )


def inputs_of(scale: InputScale, features: Float[Array, "n d"]) -> Float[Array, "n e"]:
    """Inputs of the network, two to a feature."""
    expanded = _expanded(features, scale.size, scale.floor)
    return jnp.clip((expanded - scale.mean) * scale.inverse_std, -_FARTHEST, _FARTHEST)


def _expanded(
    features: Float[Array, "n d"], size: Float[Array, " d"], floor: Float[Array, " d"]
) -> Float[Array, "n e"]:
    logarithms = jnp.log(jnp.abs(features) + floor)
    return jnp.concatenate([jnp.arcsinh(features / size), logarithms], axis=1)


@struct.dataclass
class Shape:
    """What decides the arrays of a network."""

    inputs: int = struct.field(pytree_node=False)  # two to a feature
    width: int = struct.field(pytree_node=False)  # of the hidden layers
    depth: int = struct.field(pytree_node=False)  # residual blocks, two layers each
    channels: int = struct.field(pytree_node=False, default=0)  # of the convolutions; 0 for none
    # (signals, bins) of the features to convolve, which come first
    grid: tuple[int, int] = struct.field(pytree_node=False, default=(0, 0))


@struct.dataclass
class Normal:
    """Normal distributions of the standardised targets, one a push."""

    mean: Float[Array, "n 4"]  # of each target
    factor: Float[Array, "n 4 4"]  # lower Cholesky factor L of the precision L Lᵀ


class _Block(nnx.Module):
    """A residual block."""

    def __init__(self, width: int, *, rngs: nnx.Rngs) -> None:
        self.norm = nnx.RMSNorm(width, rngs=rngs)
        self.up = nnx.Linear(width, width, rngs=rngs)
        self.down = nnx.Linear(width, width, rngs=rngs)

    def __call__(self, x: Float[Array, "n w"]) -> Float[Array, "n w"]:
        return x + self.down(nnx.silu(self.up(self.norm(x))))


class _Convolutions(nnx.Module):
    """Two convolutions over time of a table of signals by bins, both kinds of input as channels."""

    def __init__(self, shape: Shape, *, rngs: nnx.Rngs) -> None:
        self.grid = shape.grid
        channels, window = shape.channels, (_KERNEL,)
        self.first = nnx.Conv(2 * shape.grid[0], channels, window, rngs=rngs)
        self.second = nnx.Conv(channels, channels, window, strides=2, rngs=rngs)

    def __call__(self, x: Float[Array, "n e"]) -> Float[Array, "n c"]:
        signals, bins = self.grid
        tables = jnp.split(x, 2, axis=1)
        tables = [part[:, : signals * bins].reshape(-1, signals, bins) for part in tables]
        rows = jnp.concatenate(tables, axis=1).transpose(0, 2, 1)
        rows = nnx.silu(self.second(nnx.silu(self.first(rows))))
        return rows.reshape(x.shape[0], -1)


class _Network(nnx.Module):
    """A linear path to the mean, and residual blocks to the whole distribution."""

    def __init__(self, shape: Shape, *, rngs: nnx.Rngs) -> None:
        """Draws the weights; before training the blocks add nothing to the linear path."""
        hidden = shape.inputs
        self.convolutions = nnx.List([])  # none or one
        if shape.channels:
            self.convolutions.append(_Convolutions(shape, rngs=rngs))
            hidden += shape.channels * -(-shape.grid[1] // 2)
        zeros = nnx.initializers.zeros_init()
        self.linear = nnx.Linear(shape.inputs, 4, kernel_init=zeros, rngs=rngs)
        self.inner = nnx.Linear(hidden, shape.width, rngs=rngs)
        self.blocks = nnx.List([_Block(shape.width, rngs=rngs) for _ in range(shape.depth)])
        self.norm = nnx.RMSNorm(shape.width, rngs=rngs)
        self.outer = nnx.Linear(shape.width, 4 + 10, kernel_init=zeros, rngs=rngs)

    def __call__(self, x: Float[Array, "n e"]) -> Normal:
        """The distribution of the standardised targets."""
        seen = [x, *(convolve(x) for convolve in self.convolutions)]
        hidden = self.inner(jnp.concatenate(seen, axis=1))
        for block in self.blocks:
            hidden = block(hidden)
        out = self.outer(self.norm(hidden))
        factor = jnp.zeros((len(x), 4, 4), x.dtype).at[:, *np.tril_indices(4)].set(out[:, 4:])
        steep = jnp.clip(jnp.diagonal(factor, axis1=1, axis2=2), -_STEEPEST, _STEEPEST)
        eye = jnp.eye(4, dtype=x.dtype)
        factor = factor * (1 - eye) + jnp.exp(steep)[:, None] * eye
        return Normal(self.linear(x) + out[:, :4], factor)


def initial_weights(shape: Shape, start: Float[Array, "e 4"], *, key: KeyArray) -> Weights:
    """Weights of which the linear path is `start`, inputs to answers, and the others are drawn."""
    network = _Network(shape, rngs=nnx.Rngs(key))
    network.linear.kernel[...] = start
    flat = nnx.to_flat_state(nnx.state(network, nnx.Param))
    return {_name(path): leaf[...] for path, leaf in flat}


def apply_network(shape: Shape, weights: Weights, inputs: Float[Array, "n e"]) -> Normal:
    """The network's answer, for tracing into a program."""
    graph, state = nnx.split(nnx.eval_shape(lambda: _Network(shape, rngs=nnx.Rngs(0))))
    flat = {path: leaf.replace(weights[_name(path)]) for path, leaf in nnx.to_flat_state(state)}
    return nnx.merge(graph, nnx.from_flat_state(flat))(inputs)


def _name(path: tuple) -> str:
    return "/".join(str(part) for part in path)


def surprise(normal: Normal, targets: Float[Array, "n 4"]) -> Float[Array, ""]:
    """Mean negative logarithm of the likelihood, less its constant."""
    white = jnp.einsum("nji,nj->ni", normal.factor, targets - normal.mean)
    steep = jnp.log(jnp.diagonal(normal.factor, axis1=1, axis2=2))
    return jnp.mean(jnp.sum(0.5 * white**2 - steep, axis=1))


def covariance_of(normal: Normal) -> Float[Array, "n 4 4"]:
    """(L Lᵀ)⁻¹: the covariance of the standardised targets."""
    eye = jnp.broadcast_to(jnp.eye(4, dtype=normal.factor.dtype), normal.factor.shape)
    inverse = jax.scipy.linalg.solve_triangular(normal.factor, eye, lower=True)
    return jnp.swapaxes(inverse, 1, 2) @ inverse


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
