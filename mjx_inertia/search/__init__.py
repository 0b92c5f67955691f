"""Searches for decisions with several costs: a `Problem` in, a `SearchResult` out; in JAX.

MOEA/D, evolution strategies on decomposed costs, and gradient descent from many starts.
"""

from mjx_inertia.search.archive import ArchiveSettings
from mjx_inertia.search.evosax_strategies import StrategySettings, evolution_strategies
from mjx_inertia.search.gradient_search import GradientSettings, gradient_descent
from mjx_inertia.search.moead_search import MoeadSettings, moead
from mjx_inertia.search.problem import Evaluation, Problem
from mjx_inertia.search.reference_point import toward
from mjx_inertia.search.result import History, SearchResult, progress
from mjx_inertia.search.variation import VariationSettings

__all__ = [
    "ArchiveSettings",
    "Evaluation",
    "GradientSettings",
    "History",
    "MoeadSettings",
    "Problem",
    "SearchResult",
    "StrategySettings",
    "VariationSettings",
    "evolution_strategies",
    "gradient_descent",
    "moead",
    "progress",
    "toward",
]
