"""Joint motions that start and end at rest and cannot leave the limits: thesis Eqs 7.12 to 7.15.

q(t) = L₁ sin s(t) + L₂ with s a polynomial of degree 7. Rest at both ends leaves two coefficients a
joint free, normalised as p = λ₆ t_f⁶ and q = λ₇ t_f⁷ (errata 25 and 26; printed bounds on λ₆ and λ₇
would allow phases of 10¹² rad). In: ends, limits, coefficients. Out: positions, rates,
accelerations at shares τ = t / t_f of the duration.
"""

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float
from numpy import ndarray

from mjx_inertia.spatial import AnyArray

COEFFICIENTS = 2  # free ones of a joint
BOUND = 10.0  # of the normalised coefficients; thesis Sec. 7.3

# powers τ³ to τ⁷ of: the way from 0 to 1, and what p and q add; each rests at both ends
_POWERS = np.array([3, 4, 5, 6, 7])
_SHAPES = np.array(
    [[10.0, -15.0, 6.0, 0.0, 0.0], [-1.0, 3.0, -3.0, 1.0, 0.0], [-3.0, 8.0, -6.0, 0.0, 1.0]]
)


@struct.dataclass
class JointMotion:
    """Motion of n joints at m times."""

    q: Float[Array, "m n"]  # positions, rad (m where prismatic)
    qd: Float[Array, "m n"]  # rates
    qdd: Float[Array, "m n"]  # accelerations


def shapes(tau: Float[ndarray, " m"]) -> Float[ndarray, "3 m 3"]:
    """Value, slope and curvature in τ of what Δ, p and q of Eq. 7.15 multiply."""
    value = tau[:, None] ** _POWERS
    slope = _POWERS * tau[:, None] ** (_POWERS - 1)
    curvature = _POWERS * (_POWERS - 1) * tau[:, None] ** (_POWERS - 2)
    return np.stack([value, slope, curvature]) @ _SHAPES.T


def phase(
    q: Float[AnyArray, " n"], lower: Float[AnyArray, " n"], upper: Float[AnyArray, " n"]
) -> Float[Array, " n"]:
    """Phases s with q = L₁ sin s + L₂; NaN for positions outside the limits."""
    return jnp.arcsin((2.0 * q - upper - lower) / (upper - lower))


def joint_motion(
    tau: Float[ndarray, " m"],
    duration: float,
    ends: tuple[Float[Array, " n"], Float[Array, " n"]],
    limits: tuple[Float[AnyArray, " n"], Float[AnyArray, " n"]],
    coefficients: Float[Array, "n 2"],
) -> JointMotion:
    """The motion of Eqs 7.12 to 7.14.

    Args:
      tau: shares of the duration, 0 to 1.
      duration: t_f, s.
      ends: joint positions at the start and at the end, between the limits.
      limits: least and greatest positions.
      coefficients: normalised p and q of each joint; zeros give the straight quintic.
    """
    lower, upper = limits
    start, end = (phase(q, lower, upper) for q in ends)
    free = jnp.concatenate([(end - start)[:, None], coefficients], 1)
    value, slope, curvature = (jnp.asarray(shape, free.dtype) @ free.T for shape in shapes(tau))
    s, rate, gain = start + value, slope / duration, curvature / duration**2
    half, middle = jnp.asarray(upper - lower) / 2.0, jnp.asarray(upper + lower) / 2.0
    sine, cosine = half * jnp.sin(s), half * jnp.cos(s)
    return JointMotion(middle + sine, cosine * rate, cosine * gain - sine * rate**2)
