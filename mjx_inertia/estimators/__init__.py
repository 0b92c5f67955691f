"""Pushes to inertial parameters, each estimator a pair of pure functions."""

from mjx_inertia.estimators.boosted_trees import BoostedSettings as BoostedSettings
from mjx_inertia.estimators.estimate import (
    TARGETS as TARGETS,
    Estimate as Estimate,
    EstimateStatus as EstimateStatus,
)
from mjx_inertia.estimators.limit_surface_estimator import (
    WrenchTwistGuess as WrenchTwistGuess,
    com_from_wrench_twist as com_from_wrench_twist,
)
from mjx_inertia.estimators.mlp_estimator import MlpSettings as MlpSettings
from mjx_inertia.estimators.newton import (
    NewtonSettings as NewtonSettings,
    fit_newton as fit_newton,
    predict_newton as predict_newton,
)
from mjx_inertia.estimators.random_forest import forest_tree as forest_tree
from mjx_inertia.estimators.registry import (
    ESTIMATORS as ESTIMATORS,
    STORED_TYPES as STORED_TYPES,
    load_fitted as load_fitted,
    save_fitted as save_fitted,
)
from mjx_inertia.estimators.training import MeanSettings as MeanSettings
from mjx_inertia.estimators.trees import TreeNode as TreeNode
from mjx_inertia.estimators.two_finger import (
    TwoFingerLeastSquares as TwoFingerLeastSquares,
    estimate_two_finger as estimate_two_finger,
)
