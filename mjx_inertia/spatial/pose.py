"""A pose as rotation matrix and translation, which keeps right angles exact.

A unit quaternion of a right angle is irrational, its matrix holds zeros and ones. In: a matrix and
a vector, or a `jaxlie.SE3`. Out: the same pose, its inverse, products and images of points.
"""

import jax.numpy as jnp
import jaxlie
import numpy as np
from flax import struct
from jaxtyping import Float

from mjx_inertia.spatial.arrays import AnyArray


@struct.dataclass
class Pose:
    """`T_a_b`: maps coordinates in frame b to coordinates in frame a; leading axes are allowed."""

    rotation: Float[AnyArray, "*n 3 3"]  # axes of b in a, as columns
    translation: Float[AnyArray, "*n 3"]  # origin of b in a, m

    @staticmethod
    def identity() -> "Pose":
        """The pose of a frame in itself."""
        return Pose(np.eye(3), np.zeros(3))

    @staticmethod
    def from_se3(T_a_b: jaxlie.SE3) -> "Pose":
        """The same pose."""
        return Pose(T_a_b.rotation().as_matrix(), T_a_b.translation())

    def to_se3(self) -> jaxlie.SE3:
        """The same pose; its quaternion is found from the matrix."""
        rotation = jaxlie.SO3.from_matrix(jnp.asarray(self.rotation))
        return jaxlie.SE3.from_rotation_and_translation(rotation, jnp.asarray(self.translation))

    def apply(self, point_b: Float[AnyArray, "*n 3"]) -> Float[AnyArray, "*n 3"]:
        """Coordinates in a of a point (m) given in b."""
        return _turned(self.rotation, point_b) + self.translation

    def inverse(self) -> "Pose":
        """`T_b_a`."""
        rotation = self.rotation.swapaxes(-1, -2)
        return Pose(rotation, -_turned(rotation, self.translation))

    def __getitem__(self, index: int) -> "Pose":
        """One of several poses along a leading axis."""
        return Pose(self.rotation[index], self.translation[index])

    def __matmul__(self, T_b_c: "Pose") -> "Pose":
        """`T_a_c`."""
        products = self.rotation[..., :, :, None] * T_b_c.rotation[..., None, :, :]
        return Pose(products.sum(-2), self.apply(T_b_c.translation))


def _turned(
    rotation: Float[AnyArray, "*n 3 3"], vector: Float[AnyArray, "*n 3"]
) -> Float[AnyArray, "*n 3"]:
    # sums of products, because a GPU rounds the factors of a matrix product in float32
    return (rotation * vector[..., None, :]).sum(-1)
