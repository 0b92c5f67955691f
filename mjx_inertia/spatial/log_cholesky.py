"""Ten unconstrained numbers that always describe a physically consistent body.

In: any ten finite numbers. Out: `InertialParameters`, and back. The smooth parametrisation of
Rucker and Wensing 2022, "Smooth parameterization of rigid-body inertia", IEEE RA-L 7(2):
the pseudo-inertia about the origin is U Uᵀ with

    U = e^α [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3], [0, 0, 0, 1]].

The last column is the mass and the centre of mass (m = e^2α, c = t), and what remains is the
second moment about the centre of mass, so neither way subtracts m|c|².
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.spatial.inertia import InertialParameters
from mjx_inertia.spatial.second_moment import inertia_from_second_moment, second_moment_from_inertia

LOG_CHOLESKY_NAMES = ("alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")


def from_log_cholesky(theta: Float[Array, "10"]) -> InertialParameters:
    """The body of `theta`, in the order of `LOG_CHOLESKY_NAMES`.

    Args:
      theta: α is ½ ln(mass / kg); e^d and s are lengths in m; t is the centre of mass in m.

    Returns:
      Parameters in the frame in which t is the centre of mass. Their tensor is consistent in exact
      arithmetic; in floating point a very thin body may round to the boundary, never beyond the
      default tolerance of `check_consistency`.
    """
    alpha, d1, d2, d3, s12, s23, s13 = theta[:7]
    zero = jnp.zeros_like(alpha)
    root = jnp.array([[jnp.exp(d1), s12, s13], [zero, jnp.exp(d2), s23], [zero, zero, jnp.exp(d3)]])
    mass = jnp.exp(2.0 * alpha)
    gyration = jnp.einsum("ij,kj->ik", root, root, precision="highest")
    return InertialParameters(mass, theta[7:], mass * inertia_from_second_moment(gyration))


def to_log_cholesky(params: InertialParameters) -> Float[Array, "10"]:
    """The `theta` of a body, in the order of `LOG_CHOLESKY_NAMES`.

    Only bodies that `check_consistency` calls `CONSISTENT` have one. d and s are NaN for a body of
    impossible moments and may be NaN on the boundary (rods, plates, points), where `thicken` first
    gives the body a thickness; α is not finite without a positive mass.
    """
    gyration = second_moment_from_inertia(params.inertia) / params.mass
    # An upper factor U Uᵀ is the lower factor of the matrix with its axes in reverse.
    root = jnp.linalg.cholesky(gyration[::-1, ::-1])[::-1, ::-1]
    alpha = 0.5 * jnp.log(params.mass)
    shears = jnp.stack([root[0, 1], root[1, 2], root[0, 2]])
    return jnp.concatenate([alpha[None], jnp.log(jnp.diagonal(root)), shears, params.com])
