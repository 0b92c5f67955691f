"""A push as a vector with named entries."""

from mjx_inertia.features.example_table import (
    Examples as Examples,
    columns_of_set as columns_of_set,
    concatenate as concatenate,
    examples as examples,
    select_columns as select_columns,
    take_examples as take_examples,
)
from mjx_inertia.features.feature_sets import families_of as families_of
from mjx_inertia.features.signals import FeatureSettings as FeatureSettings
