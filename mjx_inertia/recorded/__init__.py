"""Real pushes of one body: identification, report, calibration of the instrument."""

from mjx_inertia.recorded.body import (
    PushRow as PushRow,
    RecordedBody as RecordedBody,
    calibrate_instrument as calibrate_instrument,
    identify_recorded as identify_recorded,
    push_rows as push_rows,
)
