"""A regression tree drawn as boxes and branches. Thesis Fig. 3.13.

In: nodes, root first. Out: `matplotlib.figure.Figure`.
"""

import itertools
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjx_inertia.estimators import TreeNode
from mjx_inertia.evaluation.appearance import BLUE, DARK, GREY, PAGE_WIDTH_IN, styled

_LEVEL_HEIGHT_IN = 1.05


@styled()
def draw_tree(
    nodes: Sequence[TreeNode], value_labels: Sequence[str] = (), *, max_depth: int = 3
) -> Figure:
    """The first levels of a tree; a branch that is cut ends in an ellipsis.

    Args:
      nodes: the tree.
      value_labels: one text a target, such as "m {:.2f} kg"; the number is put in by `str.format`.
      max_depth: levels below the root that are drawn.
    """
    _check(nodes)
    place = _arrange(nodes, max_depth)
    depth = -min(y for _, y in place.values())
    columns = max(x for x, _ in place.values()) + 1
    figure = Figure(figsize=(PAGE_WIDTH_IN, (depth + 1) * _LEVEL_HEIGHT_IN), layout="constrained")
    axes = figure.subplots()
    axes.set_axis_off()
    axes.set(xlim=(-0.6, columns - 0.4), ylim=(-depth - 0.5, 0.45))
    size = 8.5 if columns <= 8 else 7.0
    for index, (x, y) in place.items():
        node = nodes[index]
        inner = node.feature is not None and -y < max_depth
        if inner:
            for child, word in zip(_children(node), ("yes", "no"), strict=True):
                _branch(axes, (x, y), place[child], word, size)
        if inner:
            text = f"{node.feature}\n< {node.threshold:.3g}"
        else:
            text = "…" if node.value is None else _value(node.value, value_labels)
        face, edge = ("#E3EEF6", BLUE) if inner else ("#F4F4F5", GREY)
        box = {"boxstyle": "round,pad=0.35", "facecolor": face, "edgecolor": edge, "linewidth": 0.9}
        axes.text(x, y, text, ha="center", va="center", fontsize=size, color=DARK, bbox=box)
    return figure


def _children(node: TreeNode) -> tuple[int, int]:
    assert node.left is not None and node.right is not None  # as at every split
    return node.left, node.right


def _arrange(nodes: Sequence[TreeNode], max_depth: int) -> dict[int, tuple[float, float]]:
    """Place (column, minus level) by node: leaves side by side, parents above their middle."""
    place: dict[int, tuple[float, float]] = {}
    leaves = itertools.count()

    def put(index: int, level: int) -> float:
        node = nodes[index]
        if node.feature is None or level == max_depth:
            x = float(next(leaves))
        else:
            left, right = _children(node)
            x = (put(left, level + 1) + put(right, level + 1)) / 2
        place[index] = (x, -float(level))
        return x

    put(0, 0)
    return place


def _branch(
    axes: Axes, parent: tuple[float, float], child: tuple[float, float], word: str, size: float
) -> None:
    axes.plot([parent[0], child[0]], [parent[1], child[1]], color=GREY, linewidth=0.9, zorder=0)
    middle = (0.45 * parent[0] + 0.55 * child[0], 0.45 * parent[1] + 0.55 * child[1])
    axes.text(
        *middle,
        word,
        fontsize=size - 1,
        ha="center",
        va="center",
        color="#59616B",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
    )


def _value(value: Sequence[float], labels: Sequence[str]) -> str:
    if not labels:
        return "\n".join(f"{v:.3g}" for v in value)
    return "\n".join(label.format(v) for label, v in zip(labels, value, strict=True))


def _check(nodes: Sequence[TreeNode]) -> None:
    if not nodes:
        raise ValueError("nodes is empty; give at least a root")
    for index, node in enumerate(nodes):
        if node.feature is None:
            continue
        for child in _children(node):
            if not index < child < len(nodes):
                raise ValueError(
                    f"nodes[{index}] has child {child}; children must come after their parent "
                    f"and before {len(nodes)}"
                )
