"""Estimators by name, for configs."""

from collections.abc import Callable
from typing import Any, NamedTuple

from mjx_inertia.estimators.boosted_trees import BoostedSettings, boosted
from mjx_inertia.estimators.estimate import Estimator
from mjx_inertia.estimators.limit_surface_estimator import LimitSurfaceSettings, limit_surface
from mjx_inertia.estimators.mean_estimator import MeanSettings, mean
from mjx_inertia.estimators.mlp_estimator import MlpSettings, mlp
from mjx_inertia.estimators.random_forest import ForestSettings, forest
from mjx_inertia.estimators.sysid import SysidSettings, sysid


class Registered(NamedTuple):
    """An estimator's settings, what makes it from them, whether it reads the signals themselves."""

    settings: type
    factory: Callable[[Any], Estimator]
    signals: bool = False


ESTIMATORS = {
    "mean": Registered(MeanSettings, mean),
    "forest": Registered(ForestSettings, forest),
    "boosted": Registered(BoostedSettings, boosted),
    "mlp": Registered(MlpSettings, mlp),
    "limit_surface": Registered(LimitSurfaceSettings, limit_surface, signals=True),
    "sysid": Registered(SysidSettings, sysid, signals=True),
}
