"""The rows that estimators see: features computed once from the records, truth aside."""

from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.dataset import PushTruth


@struct.dataclass
class Examples:
    """Pushes as rows of named features.

    Attributes:
      features: one row a push; rows of unusable pushes hold zeros.
      status: the record's `PushStatus`; only `OK` rows are fitted.
      truth: what is to be estimated; None where it is not known, and ignored by `predict`.
      columns: the name of each feature.
    """

    features: Float[Array, "n d"]
    status: Int[Array, "n"]
    truth: PushTruth | None
    columns: tuple[str, ...] = struct.field(pytree_node=False)
