"""Pushes to inertial parameters, each estimator a pair of pure functions."""

from mjx_inertia.estimators.boosted_trees import BoostedSettings, FittedBoosted, boosted
from mjx_inertia.estimators.estimate import (
    TARGETS,
    Estimate,
    EstimateStatus,
    Estimator,
    answer,
    targets_of,
    usable_rows,
)
from mjx_inertia.estimators.force_balance_fit import BalanceFit, BalanceSettings, force_balance
from mjx_inertia.estimators.hyperparameter_search import GridResult, grid_search, grouped_folds
from mjx_inertia.estimators.limit_surface_estimator import (
    LimitSurfaceSettings,
    limit_surface,
    limit_surface_fit,
)
from mjx_inertia.estimators.mean_estimator import FittedMean, MeanSettings, mean
from mjx_inertia.estimators.mlp_estimator import FittedMlp, MlpSettings, mlp
from mjx_inertia.estimators.newton import (
    FittedNewton,
    NewtonSettings,
    fit_newton,
    predict_newton,
)
from mjx_inertia.estimators.random_forest import FittedForest, ForestSettings, forest, forest_tree
from mjx_inertia.estimators.registry import ESTIMATORS, Registered
from mjx_inertia.estimators.store import load_fitted, save_fitted
from mjx_inertia.estimators.trees import TreeEnsemble, TreeNode, readable_tree, sum_over_trees
from mjx_inertia.estimators.two_finger import (
    TwoFingerEstimate,
    TwoFingerLeastSquares,
    estimate_two_finger,
)
from mjx_inertia.estimators.wrench_twist import (
    WrenchTwistFit,
    WrenchTwistGuess,
    com_from_wrench_twist,
)

__all__ = [
    "ESTIMATORS",
    "TARGETS",
    "BalanceFit",
    "BalanceSettings",
    "BoostedSettings",
    "Estimate",
    "EstimateStatus",
    "Estimator",
    "FittedBoosted",
    "FittedForest",
    "FittedMean",
    "FittedMlp",
    "FittedNewton",
    "ForestSettings",
    "GridResult",
    "LimitSurfaceSettings",
    "MeanSettings",
    "MlpSettings",
    "NewtonSettings",
    "Registered",
    "TreeEnsemble",
    "TreeNode",
    "TwoFingerEstimate",
    "TwoFingerLeastSquares",
    "WrenchTwistFit",
    "WrenchTwistGuess",
    "answer",
    "boosted",
    "com_from_wrench_twist",
    "estimate_two_finger",
    "fit_newton",
    "force_balance",
    "forest",
    "forest_tree",
    "grid_search",
    "grouped_folds",
    "limit_surface",
    "limit_surface_fit",
    "load_fitted",
    "mean",
    "mlp",
    "predict_newton",
    "readable_tree",
    "save_fitted",
    "sum_over_trees",
    "targets_of",
    "usable_rows",
]
