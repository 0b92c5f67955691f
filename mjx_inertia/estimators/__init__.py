"""Pushes to inertial parameters, each estimator a pair of pure functions."""

from mjx_inertia.estimators.boosted import BoostedSettings, FittedBoosted, boosted
from mjx_inertia.estimators.estimate import (
    TARGETS,
    Estimate,
    EstimateStatus,
    Estimator,
    answer,
    targets_of,
    usable_rows,
)
from mjx_inertia.estimators.forest import FittedForest, ForestSettings, forest, forest_tree
from mjx_inertia.estimators.grid_search import GridResult, grid_search, grouped_folds
from mjx_inertia.estimators.mean import FittedMean, MeanSettings, mean
from mjx_inertia.estimators.registry import ESTIMATORS, Registered
from mjx_inertia.estimators.store import load_fitted, save_fitted
from mjx_inertia.estimators.trees import TreeEnsemble, TreeNode, readable_tree, sum_over_trees

__all__ = [
    "ESTIMATORS",
    "TARGETS",
    "BoostedSettings",
    "Estimate",
    "EstimateStatus",
    "Estimator",
    "FittedBoosted",
    "FittedForest",
    "FittedMean",
    "ForestSettings",
    "GridResult",
    "MeanSettings",
    "Registered",
    "TreeEnsemble",
    "TreeNode",
    "answer",
    "boosted",
    "forest",
    "forest_tree",
    "grid_search",
    "grouped_folds",
    "load_fitted",
    "mean",
    "readable_tree",
    "save_fitted",
    "sum_over_trees",
    "targets_of",
    "usable_rows",
]
