"""The base's attitude at the end of a motion, and on the way: its angular velocity, integrated.

In: angular velocities at the Gauss-Legendre nodes of a motion (`quadrature.py`). Out: rotations.
"""

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

from mjx_inertia.space.quadrature import interpolation_matrix

_STEPS = 48  # of the integration, at least


def attitude(omega: Float[Array, "n 3"], duration: float) -> Float[Array, "3 3"]:
    """R_start_end of a body with angular velocity `omega` (rad/s, in its own axes)."""
    return attitudes(omega, duration, np.ones(1))[0]


def attitudes(
    omega: Float[Array, "n 3"], duration: float, at: Float[ndarray, " m"]
) -> Float[Array, "m 3 3"]:
    """Attitude of a body against its start at shares `at` of the duration.

    Magnus' expansion to sixth order over short steps (Blanes, Casas, Oteo and Ros 2009, "The Magnus
    expansion and some of its applications", Sec. 5.4), on the polynomial through the samples.

    Args:
      omega: angular velocity at the nodes, rad/s, in the body's axes.
      duration: s.
      at: from 0 to 1.
    """
    edges = np.union1d(np.linspace(0.0, 1.0, _STEPS + 1), at)

    def onward(R: Float[Array, "3 3"], turn: Float[Array, "3 3"]) -> tuple[Array, Array]:
        return R @ turn, R @ turn

    start = jnp.eye(3, dtype=omega.dtype)
    _, reached = jax.lax.scan(onward, start, _turns(omega, duration, edges))
    return jnp.concatenate([start[None], reached])[np.searchsorted(edges, at)]


def _turns(
    omega: Float[Array, "n 3"], duration: float, edges: Float[ndarray, " m"]
) -> Float[Array, "s 3 3"]:
    """Rotations over the steps between `edges`."""
    three = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
    steps = np.diff(edges)
    at = (edges[:-1, None] + steps[:, None] * three).ravel()
    fine = (
        jnp.asarray(interpolation_matrix(omega.shape[0], tuple(at.tolist())), omega.dtype) @ omega
    )
    longs = jnp.asarray(duration * steps, omega.dtype)
    return jax.vmap(_magnus)(fine.reshape(-1, 3, 3), longs)


def _magnus(omega: Float[Array, "3 3"], h: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation over one step from ω at its three Gauss nodes; brackets are cross products."""
    # the transpose obeys Y' = A Y with A = -[ω]
    a1 = -h * omega[1]
    a2 = -np.sqrt(15.0) / 3.0 * h * (omega[2] - omega[0])
    a3 = -10.0 / 3.0 * h * (omega[2] - 2.0 * omega[1] + omega[0])
    c1 = jnp.cross(a1, a2)
    c2 = -jnp.cross(a1, 2.0 * a3 + c1) / 60.0
    rest = jnp.cross(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0
    return jaxlie.SO3.exp(-(a1 + a3 / 12.0 + rest)).as_matrix()
