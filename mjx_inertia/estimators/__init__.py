"""Pushes to inertial parameters, each estimator a pair of pure functions."""

from mjx_inertia.estimators.estimate import TARGETS, Estimate, EstimateStatus, Estimator

__all__ = ["TARGETS", "Estimate", "EstimateStatus", "Estimator"]
