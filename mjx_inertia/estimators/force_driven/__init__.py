"""Identification driven by the measured force: real pushes, whose tip is compliant."""

from mjx_inertia.estimators.force_driven.estimate import (
    BodyEstimate as BodyEstimate,
    estimate_bodies as estimate_bodies,
    probe_line as probe_line,
    usable_samples as usable_samples,
    with_deviations as with_deviations,
)
from mjx_inertia.estimators.force_driven.informative_push import (
    NextPush as NextPush,
    most_informative_push as most_informative_push,
)
from mjx_inertia.estimators.force_driven.instrument import (
    MCUBE_INSTRUMENT as MCUBE_INSTRUMENT,
    Instrument as Instrument,
    ProbeLine as ProbeLine,
    calibrated as calibrated,
    load_instrument as load_instrument,
    save_instrument as save_instrument,
)
from mjx_inertia.estimators.force_driven.prediction_errors import (
    Predictions as Predictions,
    predicted_pushes as predicted_pushes,
)
from mjx_inertia.estimators.force_driven.samples import BodyPrior as BodyPrior
from mjx_inertia.estimators.force_driven.settings import ForceDrivenSettings as ForceDrivenSettings
