"""Searches for decisions with several costs: a `Problem` in, a `SearchResult` out; in JAX.

MOEA/D, evolution strategies on decomposed costs, and gradient descent from many starts.
"""

from mjx_inertia.search.archive import ArchiveSettings as ArchiveSettings
from mjx_inertia.search.evosax_strategies import (
    StrategySettings as StrategySettings,
    evolution_strategies as evolution_strategies,
)
from mjx_inertia.search.gradient_search import (
    GradientSettings as GradientSettings,
    gradient_descent as gradient_descent,
)
from mjx_inertia.search.loop import (
    Recording as Recording,
    SearchResult as SearchResult,
    progress as progress,
)
from mjx_inertia.search.moead_search import MoeadSettings as MoeadSettings, moead as moead
from mjx_inertia.search.problem import (
    Evaluation as Evaluation,
    Problem as Problem,
    toward as toward,
)
from mjx_inertia.search.variation import VariationSettings as VariationSettings
