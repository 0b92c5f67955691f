"""The array type of records, which live on the host while files are read and written.

Out: `AnyArray`. Functions that compute take and give `jaxtyping.Array`.
"""

import jax
import numpy as np

AnyArray = jax.Array | np.ndarray
