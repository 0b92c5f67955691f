"""Many costs at once: dominance, fronts, crowding and hypervolume; lower costs are better."""

from mjx_inertia.pareto.crowding import crowding_distance
from mjx_inertia.pareto.dominance import (
    UNRANKED,
    dominates,
    is_non_dominated,
    non_dominated_ranks,
)
from mjx_inertia.pareto.hypervolume import hypervolume

__all__ = [
    "UNRANKED",
    "crowding_distance",
    "dominates",
    "hypervolume",
    "is_non_dominated",
    "non_dominated_ranks",
]
