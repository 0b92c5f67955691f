"""Estimators by name, for configs."""

from collections.abc import Callable
from typing import Any, NamedTuple

from mjx_inertia.estimators.boosted import BoostedSettings, boosted
from mjx_inertia.estimators.estimate import Estimator
from mjx_inertia.estimators.forest import ForestSettings, forest
from mjx_inertia.estimators.mean import MeanSettings, mean


class Registered(NamedTuple):
    """An estimator's settings and what makes it from them."""

    settings: type
    factory: Callable[[Any], Estimator]


ESTIMATORS = {
    "mean": Registered(MeanSettings, mean),
    "forest": Registered(ForestSettings, forest),
    "boosted": Registered(BoostedSettings, boosted),
}
