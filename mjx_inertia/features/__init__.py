"""A push as a vector with named entries."""

from mjx_inertia.features.example_table import (
    Examples,
    columns_of_set,
    concatenate,
    families_of,
    select_columns,
    take_examples,
)
from mjx_inertia.features.extraction import FEATURE_SETS, examples, extract, feature_names
from mjx_inertia.features.signals import FeatureSettings

__all__ = [
    "FEATURE_SETS",
    "Examples",
    "FeatureSettings",
    "columns_of_set",
    "concatenate",
    "examples",
    "extract",
    "families_of",
    "feature_names",
    "select_columns",
    "take_examples",
]
