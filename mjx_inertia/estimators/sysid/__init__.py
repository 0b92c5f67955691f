"""Identification through the simulator: gradients, search, and identifiability."""

from mjx_inertia.estimators.sysid.estimator import (
    FittedSysid as FittedSysid,
    Identified as Identified,
    identify_examples as identify_examples,
    planar_estimates as planar_estimates,
    sysid as sysid,
)
from mjx_inertia.estimators.sysid.levenberg_marquardt import Search as Search, search as search
from mjx_inertia.estimators.sysid.normal_equations import (
    NormalEquations as NormalEquations,
    equations_at as equations_at,
    with_belief as with_belief,
)
from mjx_inertia.estimators.sysid.observation import (
    Observation as Observation,
    SysidProblem as SysidProblem,
    observe as observe,
    observed as observed,
)
from mjx_inertia.estimators.sysid.two_stage_fit import (
    Fit as Fit,
    Identifiability as Identifiability,
    explain_identifiability as explain_identifiability,
    fit as fit,
    identifiability as identifiability,
)
from mjx_inertia.estimators.sysid.unknowns import (
    Belief as Belief,
    Beliefs as Beliefs,
    SysidSettings as SysidSettings,
    from_planar_values as from_planar_values,
    planar_values as planar_values,
    to_coordinate as to_coordinate,
    to_coordinates as to_coordinates,
    to_parameters as to_parameters,
    to_value as to_value,
)
