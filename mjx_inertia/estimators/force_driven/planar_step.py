"""One step of a rigid body that slides on a table, driven by the force that a sensor measures.

In: pose and twist of a body, the wrench on it, and the friction of the table. Out: the twist one
step later. The table carries the weight and no more: the pressure is that of equilibrium, so the
body is not lifted, and friction is that of an ellipsoidal limit surface (thesis Eqs 3.7 and 3.8),

    M (v⁺ - v) / h = w - f G v⁺ / S(v⁺),    S(v) = √(vᵀ A v + ε²),    A = diag(1, 1, c²).

The step is implicit: it is the minimiser of a convex function where G is symmetric, so sticking is
a solution like sliding. ε is the speed of the creep that stands for sticking.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

_NEWTON_STEPS = 12  # from |v| down to ε halves the error first and squares it then


def inverse(matrix: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Inverse from cross products: batches of small LAPACK calls are slow."""
    a, b, c = matrix
    rows = jnp.stack([jnp.cross(b, c), jnp.cross(c, a), jnp.cross(a, b)])
    return rows.T / (a @ rows[0])


def friction_matrix(
    friction_radius: Float[Array, ""], size: Float[Array, ""], lateral: Float[Array, ""]
) -> Float[Array, "3 3"]:
    """G: the friction wrench at the CoM is -f G v / S.

    Args:
      friction_radius: c = m_max / f_max of the limit surface, m.
      size: friction over its mean (1: no disturbance).
      lateral: share of the friction force that acts to the left of the direction of sliding.
    """
    zero = jnp.zeros_like(size)
    return jnp.stack(
        [
            jnp.stack([size, -lateral, zero]),
            jnp.stack([lateral, size, zero]),
            jnp.stack([zero, zero, size * friction_radius**2]),
        ]
    )


def sliding_twist(
    twist: Float[Array, "3"],
    wrench: Float[Array, "3"],
    mass_matrix: Float[Array, "3 3"],
    friction_force: Float[Array, ""],
    friction_radius: Float[Array, ""],
    friction: Float[Array, "3 3"],
    step: Float[Array, ""],
    creep: float,
) -> Float[Array, "3"]:
    """The twist at the CoM (m/s, rad/s) after a step.

    Args:
      twist: before the step.
      wrench: of all forces but the table's friction, at the CoM, N and N m.
      mass_matrix: of the body and what moves with it.
      friction_force: f, N.
      friction_radius: c, m.
      friction: G of `friction_matrix`.
      step: h, s.
      creep: ε, m/s.
    """
    metric = jnp.stack([jnp.ones(()), jnp.ones(()), friction_radius**2])
    momentum = mass_matrix @ twist + step * wrench
    impulse = step * friction_force

    def at(size: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, ""], Float[Array, ""]]:
        """The twist for a given S, the equation of S, and its derivative."""
        solved = inverse(mass_matrix + impulse / size * friction)
        v = solved @ momentum
        slope = solved @ (friction @ v) * (impulse / size**2)
        equation = size**2 - metric @ v**2 - creep**2
        return v, equation, 2.0 * size - 2.0 * metric @ (v * slope)

    def newton(_: Any, size: Any) -> Any:
        equation, derivative = at(size)[1:]
        return jnp.maximum(size - equation / derivative, jnp.maximum(0.3 * size, 0.9 * creep))

    # S without friction is an upper bound: from there Newton's iterates decrease
    free = inverse(mass_matrix) @ momentum
    start = jnp.sqrt(metric @ free**2 + creep**2)
    root = jax.lax.stop_gradient(jax.lax.fori_loop(0, _NEWTON_STEPS, newton, start))
    # one more step carries the derivatives (implicit function theorem)
    _, equation, derivative = at(root)
    return at(root - equation / jax.lax.stop_gradient(derivative))[0]
