"""Ensembles of binary regression trees as arrays, evaluated by one compiled function.

In: nodes of trees that a library has trained. Out: sums over trees of a statistic of their values,
by row. Every tree is completed to one depth: a leaf that comes early is repeated below splits that
always go left, so no tree needs control flow of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int

_BLOCK_ROWS = 2048  # rows in flight: what a tree needs for them stays in the processor's cache
_LEAST_ROWS = 64


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
