"""Identification through the simulator: gradients, search, and identifiability."""

from mjx_inertia.estimators.sysid.batch import equations_at
from mjx_inertia.estimators.sysid.batched_search import Search, search
from mjx_inertia.estimators.sysid.estimator import FittedSysid, Identified, identify, sysid
from mjx_inertia.estimators.sysid.fisher_identifiability import (
    Identifiability,
    explain_identifiability,
    identifiability,
)
from mjx_inertia.estimators.sysid.normal_equations import NormalEquations, information, with_belief
from mjx_inertia.estimators.sysid.observation import Observation, observe, observed
from mjx_inertia.estimators.sysid.settings import Belief, Beliefs, SysidSettings
from mjx_inertia.estimators.sysid.two_stage_fit import Fit, fit
from mjx_inertia.estimators.sysid.unknowns import (
    from_planar_values,
    planar_values,
    to_coordinate,
    to_coordinates,
    to_parameters,
    to_value,
)

__all__ = [
    "Belief",
    "Beliefs",
    "Fit",
    "FittedSysid",
    "Identifiability",
    "Identified",
    "NormalEquations",
    "Observation",
    "Search",
    "SysidSettings",
    "equations_at",
    "explain_identifiability",
    "fit",
    "from_planar_values",
    "identifiability",
    "identify",
    "information",
    "observe",
    "observed",
    "planar_values",
    "search",
    "sysid",
    "to_coordinate",
    "to_coordinates",
    "to_parameters",
    "to_value",
    "with_belief",
]
