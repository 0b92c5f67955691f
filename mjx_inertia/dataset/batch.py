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
    """True planar inertial parameters.

    Attributes:
      mass: kg.
      inertia: I_zz about the CoM, kg m².
      com: CoM from the first contact point, m: x along the inward contact normal, y to its left.
    """

    mass: Float[AnyArray, "*n"]
    inertia: Float[AnyArray, "*n"]
    com: Float[AnyArray, "*n 2"]


@struct.dataclass
class PushConditions:
    """How a push was made: what errors are broken down by, never an input of an estimator.

    Attributes:
      object_id: pushes of one object share it; a grouped split keeps it on one side.
      friction: between object and table (NaN where unknown).
      size: edge length or diameter, m.
      speed: of the tip, m/s.
      contact_offset: of the first contact from the middle of the face, fraction of half the edge.
      angle: of the tip's path from the inward normal, rad.
    """

    object_id: Int[AnyArray, "*n"]
    friction: Float[AnyArray, "*n"]
    size: Float[AnyArray, "*n"]
    speed: Float[AnyArray, "*n"]
    contact_offset: Float[AnyArray, "*n"]
    angle: Float[AnyArray, "*n"]


@struct.dataclass
class PushBatch:
    """Records, truth and conditions with one leading axis, and what was known before the push."""

    records: PushRecord
    truth: PushTruth
    conditions: PushConditions
    setup: PushSetup | None = None
