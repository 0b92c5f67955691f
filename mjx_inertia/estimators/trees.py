"""Ensembles of regression trees as arrays: XGBoost trains them, one compiled function evaluates.

In: features and standardised targets. Out: `TreeEnsemble`, and sums over its trees of a statistic
of their values, by row. Nothing of the library is kept, and it is imported when it is first needed.
Every tree is completed to one depth: a leaf that comes early is repeated below splits that always
go left, so no tree needs control flow of its own.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int
from tqdm import tqdm

_BLOCK_ROWS = 2048  # rows in flight: what a tree needs for them stays in the processor's cache
_LEAST_ROWS = 64
if TYPE_CHECKING:
    import xgboost


@struct.dataclass
class TreeEnsemble:
    """Complete binary trees of one depth, in groups that each give their own outputs.

    Node i has children 2i+1 (taken if x < threshold) and 2i+2; leaves count from the left. The
    outputs are those of group 0, then of group 1, and so on.
    """

    feature: Int[Array, "groups trees nodes"]  # column that a node looks at
    # what it compares with; infinite where a leaf came early
    threshold: Float[Array, "groups trees nodes"]
    leaf: Float[Array, "groups trees leaves outputs"]  # values at the leaves


@dataclass(frozen=True)
class TreeNode:
    """One node of a tree in readable form."""

    feature: str | None  # name of the feature; None at a leaf
    threshold: float | None  # rows with a smaller value go to `left`
    left: int | None  # place of that child in the list; None at a leaf
    right: int | None  # place of the other child
    value: tuple[float, ...] | None  # the outputs at a leaf; None at a split


def _tree_value(
    feature: Int[Array, " nodes"],
    threshold: Float[Array, " nodes"],
    leaf: Float[Array, "leaves outputs"],
    rows: Float[Array, "rows d"],
) -> Float[Array, "outputs rows"]:
    """Values of one tree: all rows go down it together, level by level."""
    count, width = rows.shape
    splits = feature.shape[0]
    flat, row = rows.reshape(-1), jnp.arange(count) * width  # one gather by place is the fastest
    node = jnp.zeros(count, jnp.int32)
    for _ in range(splits.bit_length()):
        node = 2 * node + 1 + (flat[row + feature[node]] >= threshold[node])
    return leaf.T[:, node - splits]


def identity(value: Float[Array, "outputs rows"]) -> Float[Array, "outputs rows"]:
    """The statistic whose sum is an ensemble's prediction."""
    return value


def with_products(value: Float[Array, "outputs rows"]) -> Float[Array, "both rows"]:
    """A tree's values, then all products of two of them (row-major)."""
    products = value[:, None] * value[None, :]
    return jnp.concatenate([value, products.reshape(-1, value.shape[1])])


def sum_over_trees(
    ensemble: TreeEnsemble,
    features: Float[Array, "n d"],
    statistic: Callable[[jax.Array], jax.Array] = identity,
) -> Float[Array, "n outputs"]:
    """Sum over a group's trees of `statistic` of their values, groups side by side.

    Comparison and summation are float32 and in the order of the trees, as in XGBoost. Memory does
    not grow with the number of trees, nor beyond the result with the number of rows. Rows go in
    blocks of few sizes, so that another number of rows rarely means another compilation.
    """
    count = features.shape[0]
    size = min(_BLOCK_ROWS, max(_LEAST_ROWS, 1 << max(count - 1, 0).bit_length()))
    rows = jnp.pad(features.astype(jnp.float32), ((0, -count % size if count else size), (0, 0)))
    starts = range(0, rows.shape[0], size)
    blocks = [_sum_of_block(ensemble, rows[start : start + size], statistic) for start in starts]
    return jnp.concatenate(blocks)[:count]


@partial(jax.jit, static_argnames="statistic")
def _sum_of_block(
    ensemble: TreeEnsemble,
    rows: Float[Array, "rows d"],
    statistic: Callable[[jax.Array], jax.Array],
) -> Float[Array, "rows outputs"]:
    value = jax.ShapeDtypeStruct((ensemble.leaf.shape[-1], rows.shape[0]), jnp.float32)
    nothing = jnp.zeros(jax.eval_shape(statistic, value).shape, jnp.float32)

    def of_group(group: TreeEnsemble) -> Float[Array, "outputs rows"]:
        def add(total: jax.Array, tree: TreeEnsemble) -> tuple[jax.Array, None]:
            value = _tree_value(tree.feature, tree.threshold, tree.leaf, rows)
            return total + statistic(value), None

        return jax.lax.scan(add, nothing, group)[0]

    return jax.lax.map(of_group, ensemble).reshape(-1, rows.shape[0]).T


def readable_tree(
    ensemble: TreeEnsemble, columns: tuple[str, ...], tree: int, group: int = 0
) -> list[TreeNode]:
    """Nodes of one tree, root first and each parent before its children.

    Raises:
      ValueError: there is no such tree.
    """
    groups, trees, splits = ensemble.feature.shape
    if not (0 <= group < groups and 0 <= tree < trees):
        raise ValueError(
            f"readable_tree: no tree {tree} in group {group}; there are {trees} in each of {groups}"
        )
    feature, threshold = np.asarray(ensemble.feature[group, tree]), ensemble.threshold[group, tree]
    threshold, leaf = np.asarray(threshold), np.asarray(ensemble.leaf[group, tree])
    nodes: list[TreeNode] = []

    def visit(place: int) -> int:
        early = place < splits and np.isinf(threshold[place])
        number = len(nodes)
        if place >= splits or early:
            while place < splits:
                place = 2 * place + 1
            nodes.append(TreeNode(None, None, None, None, tuple(leaf[place - splits].tolist())))
            return number
        nodes.append(TreeNode(None, None, None, None, None))  # its children's places come next
        left, right = visit(2 * place + 1), visit(2 * place + 2)
        name, value = columns[feature[place]], float(threshold[place])
        nodes[number] = TreeNode(name, value, left, right, None)
        return number

    visit(0)
    return nodes


@dataclass(frozen=True)
class Job:
    """One independent training: its targets, rows or rows by outputs, and its seed."""

    targets: np.ndarray
    seed: int


@dataclass(frozen=True)
class ColumnSearch:
    """A short training that tells which columns matter; the trees then see only these."""

    columns: int  # how many are kept: those whose splits gained most
    rounds: int  # of the short training
    parameters: Mapping[str, Any]  # of the same, where they differ


def train(
    features: np.ndarray,
    jobs: Sequence[Job],
    parameters: Mapping[str, Any],
    rounds: int,
    description: str | None,
    search: ColumnSearch | None = None,
) -> list[TreeEnsemble]:
    """The trees of every job after `rounds` rounds; a bar on stderr if it has a `description`.

    With a `search`, each job chooses its own columns first.

    Jobs run beside each other, one thread each: the library's own threads wait for each other by
    spinning, which made it ten times slower on two cores that other work shared. The number of
    cores does not change the result.
    """
    import xgboost  # noqa: PLC0415  (heavy, and only training needs it)

    bins = int(parameters["max_bin"])
    fixed = {"tree_method": "hist", "base_score": 0.0, "verbosity": 0, "nthread": 1}
    workers = min(len(jobs), os.cpu_count() or 1)
    hide = None if description else True  # None: hidden where stderr is no terminal
    bar = tqdm(total=len(jobs) * rounds, desc=description, disable=hide, leave=False)

    def work(worker: int) -> list[TreeEnsemble]:
        trained = []
        with xgboost.config_context(verbosity=0):
            table = xgboost.QuantileDMatrix(features, max_bin=bins, nthread=1)
            for job in jobs[worker::workers]:
                table.set_label(job.targets)
                own, chosen, options = table, None, {**fixed, **parameters, "seed": job.seed}
                if search is not None and search.columns < features.shape[1]:
                    short = xgboost.Booster({**options, **search.parameters}, [table])
                    for number in range(search.rounds):
                        short.update(table, number)
                    chosen = _columns_of_most_gain(short, search.columns)
                    own = xgboost.QuantileDMatrix(
                        features[:, chosen], job.targets, max_bin=bins, nthread=1
                    )
                booster = xgboost.Booster(options, [own])
                for number in range(rounds):
                    booster.update(own, number)
                    bar.update()
                trees = ensemble_of(booster, int(parameters["max_depth"]))
                if chosen is not None:
                    trees = replace(trees, feature=jnp.asarray(chosen)[trees.feature])
                trained.append(trees)
        return trained

    with bar, ThreadPoolExecutor(workers) as pool:
        by_worker = list(pool.map(work, range(workers)))
    return [by_worker[number % workers][number // workers] for number in range(len(jobs))]


def _columns_of_most_gain(booster: "xgboost.Booster", count: int) -> np.ndarray:
    """Columns, rising, whose splits gained most in all; the first column if there is no split."""
    gains = booster.get_score(importance_type="total_gain")
    by_column = {int(name.removeprefix("f")): float(np.sum(gain)) for name, gain in gains.items()}
    best = sorted(by_column, key=lambda column: (-by_column[column], column))[:count]
    return np.sort(np.asarray(best or [0], np.int32))


def join(parts: Sequence[TreeEnsemble], axis: int) -> TreeEnsemble:
    """Ensembles side by side: `axis` 0 adds groups (outputs), 1 adds trees to each group."""
    return TreeEnsemble(
        *(
            jnp.concatenate([getattr(part, field) for part in parts], axis=axis)
            for field in ("feature", "threshold", "leaf")
        )
    )


def ensemble_of(booster: "xgboost.Booster", depth: int) -> TreeEnsemble:
    """The trees of a trained XGBoost booster (numerical features, `base_score` 0).

    Raises:
      ValueError: a tree is deeper than `depth`, or the model is not of that kind.
    """
    learner = json.loads(bytes(booster.save_raw("json")))["learner"]
    model = learner["gradient_booster"]["model"]
    target_count = max(int(learner["learner_model_param"]["num_target"]), 1)
    vector_leaves = int(model["trees"][0]["tree_param"]["size_leaf_vector"]) > 1
    outputs = target_count if vector_leaves else 1
    groups: list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]]
    groups = [[] for _ in range(target_count // outputs)]
    for tree, group in zip(model["trees"], model["tree_info"], strict=True):
        groups[group].append(_complete(tree, depth, outputs))
    feature, threshold, leaf = (
        np.stack([np.stack([tree[part] for tree in group]) for group in groups])
        for part in range(3)
    )
    return TreeEnsemble(jnp.asarray(feature), jnp.asarray(threshold), jnp.asarray(leaf))


def _complete(
    tree: dict[str, Any], depth: int, outputs: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One tree of XGBoost's JSON schema, completed to `depth` levels of splits."""
    left, right = tree["left_children"], tree["right_children"]
    index, condition = tree["split_indices"], tree["split_conditions"]
    if any(tree.get("split_type", ())):
        raise ValueError("ensemble_of: a tree has categorical splits; only numbers are compared")
    if outputs > 1 and "leaf_weights" not in tree:
        raise ValueError("ensemble_of: no `leaf_weights` in the model; XGBoost 3.2 or newer has it")
    splits = 2**depth - 1
    feature, threshold = np.zeros(splits, np.int32), np.full(splits, np.inf, np.float32)
    leaf = np.zeros((splits + 1, outputs), np.float32)
    stack = [(0, 0, depth)]  # node of the library, place here, levels left below it
    while stack:
        node, place, below = stack.pop()
        if left[node] == -1:
            # A leaf holds its value as a condition, or the row of it in a table of vectors.
            first = ((place + 1) << below) - 1 - splits
            rows = slice(first, first + (1 << below))
            if outputs > 1:
                at = right[node] * outputs
                leaf[rows] = tree["leaf_weights"][at : at + outputs]
            else:
                leaf[rows] = condition[node]
        elif below == 0:
            raise ValueError(f"ensemble_of: a tree is deeper than depth={depth}")
        else:
            feature[place], threshold[place] = index[node], condition[node]
            stack += [(left[node], 2 * place + 1, below - 1)]
            stack += [(right[node], 2 * place + 2, below - 1)]
    return feature, threshold, leaf
