"""Pushes to inertial parameters, each estimator a pair of pure functions."""

from mjx_inertia.estimators.boosted_trees import (
    BoostedSettings as BoostedSettings,
    FittedBoosted as FittedBoosted,
    boosted as boosted,
)
from mjx_inertia.estimators.estimate import (
    TARGETS as TARGETS,
    Estimate as Estimate,
    EstimateStatus as EstimateStatus,
    Estimator as Estimator,
    answer as answer,
    targets_of as targets_of,
    usable_rows as usable_rows,
)
from mjx_inertia.estimators.force_balance_fit import (
    BalanceFit as BalanceFit,
    BalanceSettings as BalanceSettings,
    force_balance as force_balance,
)
from mjx_inertia.estimators.hyperparameter_search import (
    GridResult as GridResult,
    grid_search as grid_search,
    grouped_folds as grouped_folds,
)
from mjx_inertia.estimators.limit_surface_estimator import (
    LimitSurfaceSettings as LimitSurfaceSettings,
    limit_surface as limit_surface,
    limit_surface_fit as limit_surface_fit,
)
from mjx_inertia.estimators.mean_estimator import (
    FittedMean as FittedMean,
    MeanSettings as MeanSettings,
    mean as mean,
)
from mjx_inertia.estimators.mlp_estimator import (
    FittedMlp as FittedMlp,
    MlpSettings as MlpSettings,
    mlp as mlp,
)
from mjx_inertia.estimators.newton import (
    FittedNewton as FittedNewton,
    NewtonSettings as NewtonSettings,
    fit_newton as fit_newton,
    predict_newton as predict_newton,
)
from mjx_inertia.estimators.random_forest import (
    FittedForest as FittedForest,
    ForestSettings as ForestSettings,
    forest as forest,
    forest_tree as forest_tree,
)
from mjx_inertia.estimators.registry import ESTIMATORS as ESTIMATORS, Registered as Registered
from mjx_inertia.estimators.store import load_fitted as load_fitted, save_fitted as save_fitted
from mjx_inertia.estimators.trees import (
    TreeEnsemble as TreeEnsemble,
    TreeNode as TreeNode,
    readable_tree as readable_tree,
    sum_over_trees as sum_over_trees,
)
from mjx_inertia.estimators.two_finger import (
    TwoFingerEstimate as TwoFingerEstimate,
    TwoFingerLeastSquares as TwoFingerLeastSquares,
    estimate_two_finger as estimate_two_finger,
)
from mjx_inertia.estimators.wrench_twist import (
    WrenchTwistFit as WrenchTwistFit,
    WrenchTwistGuess as WrenchTwistGuess,
    com_from_wrench_twist as com_from_wrench_twist,
)
