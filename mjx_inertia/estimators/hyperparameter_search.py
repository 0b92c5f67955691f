"""Choosing settings of an estimator by grouped cross-validation (thesis §3.4: ten folds).

In: `Examples`, the group of each row, candidates. Out: the error of every candidate, best first.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from tqdm import tqdm

from mjx_inertia.estimators.estimate import (
    EstimateStatus,
    Estimator,
    KeyArray,
    targets_of,
    usable_rows,
)
from mjx_inertia.features import Examples, take_examples


@dataclass(frozen=True)
class GridResult:
    """One candidate's error."""

    settings: Any  # the candidate
    score: float  # mean over targets of `errors`; smaller is better, 1 is no better than the mean
    # by target, RMS error on rows left out over the standard deviation of the truth
    errors: tuple[float, float, float, float]


def grouped_folds(groups: np.ndarray, folds: int, seed: int) -> np.ndarray:
    """Fold number of each row; rows of one group share it, and folds hold equally many groups.

    Raises:
      ValueError: fewer than two folds, or fewer groups than folds.
    """
    labels = np.unique(groups, return_inverse=True)[1].reshape(-1)
    number = int(labels.max()) + 1 if labels.size else 0
    if not 2 <= folds <= number:
        raise ValueError(f"folds={folds}: at least 2, and at most one for each of {number} groups")
    order = np.random.default_rng(seed).permutation(number)
    return (order % folds)[labels]


def grid_search(
    factory: Callable[[Any], Estimator],
    candidates: Sequence[Any],
    examples: Examples,
    groups: np.ndarray,
    *,
    key: KeyArray,
    folds: int = 10,
    progress: bool = True,
) -> list[GridResult]:
    """Cross-validates `factory(settings)` for each of `candidates` and ranks them.

    Args:
      factory: makes an estimator from settings.
      candidates: settings to compare, all on the same folds.
      examples: rows with truth; unusable ones are left out.
      groups: of each row, for instance the object's id; a group is never split between folds.
      key: for folds and fits.
      folds: number of folds.
      progress: a bar on stderr, if that is a terminal.

    Raises:
      ValueError: no candidate, `groups` of another length, or too few groups.
    """
    groups = np.asarray(groups)
    if not candidates or groups.shape != examples.status.shape:
        raise ValueError(
            f"grid_search: {len(candidates)} candidates and groups of shape {groups.shape} for "
            f"{examples.status.shape[0]} examples; give at least one and one group a row"
        )
    usable = np.asarray(usable_rows(examples))
    rows, groups = take_examples(examples, usable), groups[usable]
    truth = np.asarray(targets_of(rows))
    spread = np.where(truth.std(axis=0) > 0, truth.std(axis=0), 1.0)
    key_folds, key_fit = jax.random.split(key)
    fold = grouped_folds(groups, folds, int(jax.random.randint(key_folds, (), 0, 2**31 - 1)))

    results = []
    with tqdm(
        total=len(candidates) * folds,
        desc="grid search",
        disable=None if progress else True,
    ) as bar:
        for settings in candidates:
            estimator = factory(settings)
            error = np.full_like(truth, np.nan)
            for number in range(folds):
                aside = fold == number
                fitted = estimator.fit(
                    take_examples(rows, ~aside), key=jax.random.fold_in(key_fit, number)
                )
                estimate = estimator.predict(fitted, take_examples(rows, aside))
                known = np.asarray(estimate.status) == EstimateStatus.OK
                places = np.flatnonzero(aside)[known]
                error[places] = np.asarray(estimate.mean)[known] - truth[places]
                bar.update()
            relative = np.sqrt(np.nanmean(error**2, axis=0)) / spread
            results.append(GridResult(settings, float(relative.mean()), tuple(relative.tolist())))
    return sorted(results, key=lambda result: result.score)
