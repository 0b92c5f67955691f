"""Stacked pushes with their truth in a field of its own.

In: records and what is known about them. Out: `PushBatch`. Only `fit` on the training split and
`evaluation` read the truth.
"""

from flax import struct
from jaxtyping import Float, Int

from mjx_inertia.pushing import PushRecord, PushSetup
from mjx_inertia.spatial import AnyArray


@struct.dataclass
class PushTruth:
    """True planar inertial parameters."""

    mass: Float[AnyArray, "*n"]  # kg
    inertia: Float[AnyArray, "*n"]  # I_zz about the CoM, kg m²
    # CoM from the first contact point, m: x along the inward contact normal, y to its left
    com: Float[AnyArray, "*n 2"]


@struct.dataclass
class PushConditions:
    """How a push was made: what errors are broken down by, never an input of an estimator."""

    # pushes of one object share it; a grouped split keeps it on one side
    object_id: Int[AnyArray, "*n"]
    friction: Float[AnyArray, "*n"]  # between object and table (NaN where unknown)
    size: Float[AnyArray, "*n"]  # edge length or diameter, m
    speed: Float[AnyArray, "*n"]  # of the tip, m/s
    # of the first contact from the middle of the face, fraction of half the edge
    contact_offset: Float[AnyArray, "*n"]
    angle: Float[AnyArray, "*n"]  # of the tip's path from the inward normal, rad


@struct.dataclass
class PushBatch:
    """Records, truth and conditions with one leading axis, and what was known before the push."""

    records: PushRecord
    truth: PushTruth
    conditions: PushConditions
    setup: PushSetup | None = None
