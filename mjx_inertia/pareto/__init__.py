"""Many costs at once: dominance, fronts, crowding, hypervolume and choice; lower is better."""

from mjx_inertia.pareto.choice import (
    best_per_metric,
    knee,
    normalised,
    pareto_ranks,
    pareto_set,
    succeeded,
    weighted_choice,
)
from mjx_inertia.pareto.crowding import crowding_distance
from mjx_inertia.pareto.dominance import (
    NONE,
    UNRANKED,
    dominates,
    is_non_dominated,
    non_dominated_ranks,
)
from mjx_inertia.pareto.generational_distance import inverted_generational_distance
from mjx_inertia.pareto.hypervolume_indicator import approximate_hypervolume, hypervolume

__all__ = [
    "NONE",
    "UNRANKED",
    "approximate_hypervolume",
    "best_per_metric",
    "crowding_distance",
    "dominates",
    "hypervolume",
    "inverted_generational_distance",
    "is_non_dominated",
    "knee",
    "non_dominated_ranks",
    "normalised",
    "pareto_ranks",
    "pareto_set",
    "succeeded",
    "weighted_choice",
]
