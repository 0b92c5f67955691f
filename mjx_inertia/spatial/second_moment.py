"""The second moment of mass, ∫ r rᵀ dm: what an inertia tensor says about where the mass is.

In: an inertia tensor or a second moment, both about one point and in the same axes. Out: the other.
A body is made of non-negative mass exactly where its second moment is positive semi-definite
(Wensing, Kim and Slotine 2018, "Linear matrix inequalities for physically consistent inertial
parameter identification", IEEE RA-L 3(1)).
"""

import jax.numpy as jnp
from jaxtyping import Array, Float


def second_moment_from_inertia(inertia: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Second moment (kg m²) of a body with the given inertia tensor (kg m²)."""
    # Wensing, Kim and Slotine 2018: Σ = ½ tr(I) 1 - I
    return 0.5 * jnp.trace(inertia) * jnp.eye(3, dtype=inertia.dtype) - inertia


def inertia_from_second_moment(second_moment: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Inertia tensor (kg m²) of a body with the given second moment (kg m²)."""
    # I = tr(Σ) 1 - Σ, with I_xx = Σ_yy + Σ_zz summed as such: tr(Σ) - Σ_xx would lose the small
    # moment of a thin rod about its own axis.
    eye = jnp.eye(3, dtype=second_moment.dtype)
    spread = jnp.diagonal(second_moment)
    return jnp.diag(jnp.sum((1.0 - eye) * spread, axis=1)) - (1.0 - eye) * second_moment
