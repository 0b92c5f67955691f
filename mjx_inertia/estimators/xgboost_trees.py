"""Training by XGBoost, and its trees as a `TreeEnsemble`.

In: features and standardised targets. Out: the ensemble; nothing of the library is kept. The
library is imported when it is first needed.
"""

import json
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from mjx_inertia.estimators.trees import TreeEnsemble

if TYPE_CHECKING:
    import xgboost


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
