"""MuJoCo's contact rows from geometry: reference acceleration and regularisation.

For scenes whose contacts are known in closed form; what `mjx.make_constraint` computes for any
scene, here for contacts side by side and without their frames. In: Jacobian rows, depth and
velocity. Out: `Constraints`.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Float

from mjx_inertia.pushing.contact_problem import Constraints
from mjx_inertia.pushing.settings import IMPRATIO
from mjx_inertia.spatial import AnyArray
from mjx_inertia.spatial.unrolled import Component, Matrix, Vector, computed_once


@dataclass(frozen=True)
class ContactLaw:
    """How stiff contacts are: MuJoCo's parameters of one kind of contact."""

    # time constant (s; may be traced) and damping ratio of the normal direction
    solref: tuple[Float[AnyArray, ""] | float, float]
    solref_friction: tuple[Float[AnyArray, ""] | float, float]  # of the other directions
    # impedance at no depth and at `width`, that width (m), midpoint 0.5 and power 2
    solimp: tuple[float, float, float, float, float]
    timestep: float  # s; a time constant counts as two of them at least

    def __post_init__(self) -> None:
        """Raises ValueError unless the impedance has midpoint 0.5 and power 2."""
        if self.solimp[3:] != (0.5, 2.0):
            raise ValueError(f"solimp={self.solimp}: midpoint and power must be 0.5 and 2")

    def stiffness_and_damping(self, friction: bool) -> tuple[Array, Array]:
        """K and B of the reference acceleration -B v - K d x (engine_core_constraint.c)."""
        time, ratio = self.solref_friction if friction else self.solref
        time = jnp.maximum(jnp.asarray(time), 2.0 * self.timestep)
        d_max = self.solimp[1]
        return 1.0 / (d_max * time * ratio) ** 2, 2.0 / (d_max * time)

    def impedance(self, distance: Float[AnyArray, " c"]) -> Float[Array, " c"]:
        """D at a signed distance (m): a smooth step from the first value to the second."""
        low, high = (min(max(d, mujoco.mjMINIMP), mujoco.mjMAXIMP) for d in self.solimp[:2])
        x = jnp.minimum(jnp.abs(distance) / self.solimp[2], 1.0)
        rise = jnp.where(x < 0.5, 2.0 * x * x, 1.0 - 2.0 * (1.0 - x) * (1.0 - x))
        return low + rise * (high - low)


def contact_rows(
    law: ContactLaw,
    distance: Float[AnyArray, " c"],
    jacobian: Matrix,
    velocity: Vector,
    friction: Vector,
    inverse_mass: Float[AnyArray, ""],
) -> Constraints:
    """Elliptic contacts of one dimension, every entry an array over the contacts or alike in all.

    Args:
      law: of the contacts.
      distance: between the surfaces, m; a contact is open when it is positive.
      jacobian: rows (normal, tangents, torsion) of columns (free degrees of freedom).
      velocity: of each row, m/s (rad/s for torsion), prescribed motion included.
      friction: of each row but the first.
      inverse_mass: of the two bodies, summed: what MuJoCo scales regularisation with, 1/kg.
    """
    touches = distance < 0
    impedance = computed_once(law.impedance(distance))
    regularisation = inverse_mass * (1.0 - impedance) / impedance
    sideways = regularisation / IMPRATIO
    stiffness, damping = law.stiffness_and_damping(friction=False)
    reference = [-damping * velocity[0] - stiffness * impedance * distance]
    _, damping = law.stiffness_and_damping(friction=True)
    reference += -damping * velocity[1:]
    row_regularisation = [regularisation, *(sideways * (friction[0] / mu) ** 2 for mu in friction)]
    count, zero = jnp.shape(distance), jnp.zeros_like(distance)

    def where_touching(x: Component) -> Array:
        return computed_once(jnp.where(touches, x, zero))

    mu = jnp.broadcast_to(friction[0], count)
    return Constraints(
        jacobian=jax.tree.map(where_touching, jacobian),
        reference=Vector(map(where_touching, reference)),
        weight=Vector(1.0 / jnp.maximum(r, mujoco.mjMINVAL) for r in row_regularisation),
        scale=Vector((mu / IMPRATIO**0.5, *(jnp.broadcast_to(f, count) for f in friction))),
        rows=tuple(
            tuple(range(i, i + len(jacobian) * count[0], len(jacobian)))
            for i in range(len(jacobian))
        ),
        bilateral=False,
    )
