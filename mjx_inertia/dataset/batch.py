"""Stacked pushes with their truth in a field of its own.

In: records and what is known about them. Out: `PushBatch`. Only `fit` on the training split and
`evaluation` read the truth.
"""

from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.pushing import PushRecord


@struct.dataclass
class PushTruth:
    """True planar inertial parameters.

    Attributes:
      mass: kg.
      inertia: I_zz about the CoM, kg m².
      com: CoM from the first contact point, m: x along the inward contact normal, y to its left.
    """

    mass: Float[Array, "*n"]
    inertia: Float[Array, "*n"]
    com: Float[Array, "*n 2"]


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

    object_id: Int[Array, "*n"]
    friction: Float[Array, "*n"]
    size: Float[Array, "*n"]
    speed: Float[Array, "*n"]
    contact_offset: Float[Array, "*n"]
    angle: Float[Array, "*n"]


@struct.dataclass
class PushBatch:
    """Records, truth and conditions with one leading axis."""

    records: PushRecord
    truth: PushTruth
    conditions: PushConditions
