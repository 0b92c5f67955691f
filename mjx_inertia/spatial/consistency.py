"""Whether inertial parameters can belong to a body of non-negative mass everywhere.

In: `InertialParameters`. Out: a `Consistency` per body, inside jit; in words on the host; and a
body moved off the boundary.

Tolerance: all comparisons of the tensor are relative to its largest entry or moment, by default
64 eps of the dtype, which is what a few rotations and sums leave of rounding. A rod of radius r
and length l has the slack 3 (r/l)² in the triangle inequality, a square plate of thickness h and
side a the slack ½ (h/a)²; so float32 (7.6e-6) cannot tell a rod with r/l < 1.6e-3 or a plate with
h/a < 4e-3 from one without thickness, and float64 (1.4e-14) one with r/l < 7e-8. Such bodies are
`ON_BOUNDARY`: realisable, but without log-Cholesky parameters. Parameters rounded in a file, or
converted from moments about a far origin, need a larger `tolerance`.
"""

import dataclasses
import enum

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.spatial.inertia import InertialParameters


class Consistency(enum.IntEnum):
    """Physical consistency of one body; the first reason that applies, from the bottom up.

    `status <= ON_BOUNDARY` are the bodies that can exist; `CONSISTENT` alone are those with a
    positive definite pseudo-inertia, which have log-Cholesky parameters.
    """

    CONSISTENT = 0  # positive definite pseudo-inertia
    ON_BOUNDARY = 1  # singular pseudo-inertia: a rod, plate or point, to rounding
    TRIANGLE_INEQUALITY = 2  # the largest principal moment exceeds the sum of the others
    NEGATIVE_MOMENT = 3  # a principal moment is negative
    NOT_SYMMETRIC = 4  # the tensor is not symmetric
    NONPOSITIVE_MASS = 5  # the mass is zero or negative
    NOT_FINITE = 6  # a value is NaN or infinite


def check_consistency(
    params: InertialParameters, tolerance: Float[Array, ""] | float | None = None
) -> Int[Array, ""]:
    """The `Consistency` of one body.

    The pseudo-inertia is positive definite exactly where the mass is positive and twice its least
    second moment about the CoM, I₁ + I₂ - I₃ with I₃ the largest principal moment, is positive
    (Wensing, Kim and Slotine 2018); a non-negative one implies non-negative moments.

    Args:
      params: one body; vmap for more.
      tolerance: relative, see the module; None is 64 eps of the dtype.
    """
    if tolerance is None:
        tolerance = _default_tolerance(params)
    finite = _is_finite(params)
    tensor = jnp.where(finite, params.inertia, 0.0)
    asymmetry = jnp.max(jnp.abs(tensor - tensor.T))
    moments = jnp.linalg.eigvalsh(0.5 * (tensor + tensor.T))
    slack = _triangle_slack(moments)
    margin = tolerance * jnp.max(jnp.abs(moments))
    reasons = [
        (~finite, Consistency.NOT_FINITE),
        (params.mass <= 0.0, Consistency.NONPOSITIVE_MASS),
        (asymmetry > tolerance * jnp.max(jnp.abs(tensor)), Consistency.NOT_SYMMETRIC),
        (moments[0] < -margin, Consistency.NEGATIVE_MOMENT),
        (slack < -margin, Consistency.TRIANGLE_INEQUALITY),
        (slack <= margin, Consistency.ON_BOUNDARY),
    ]
    conditions, codes = zip(*reasons, strict=True)
    codes = [jnp.int32(code) for code in codes]
    return jnp.select(list(conditions), codes, jnp.int32(Consistency.CONSISTENT))


def explain_consistency(params: InertialParameters, tolerance: float | None = None) -> str:
    """Why one body is or is not consistent, with the numbers that decide; not for use inside jit.

    Args:
      params: one body, with concrete values.
      tolerance: as for `check_consistency`.

    Raises:
      ValueError: `params` has leading axes.
    """
    if jnp.ndim(params.mass) != 0:
        raise ValueError(
            f"`params` must be one body, but its mass has shape {jnp.shape(params.mass)}; "
            "take body i by `jax.tree.map(lambda x: x[i], params)`"
        )
    if tolerance is None:
        tolerance = _default_tolerance(params)
    status = Consistency(int(check_consistency(params, tolerance)))
    mass = float(params.mass)
    tensor = np.asarray(params.inertia)
    if status is Consistency.NOT_FINITE:
        values = {"mass": mass, "com": np.asarray(params.com).tolist(), "inertia": tensor.tolist()}
        bad = {name: value for name, value in values.items() if not np.all(np.isfinite(value))}
        return "not finite: " + ", ".join(f"{name} = {value}" for name, value in bad.items())
    if status is Consistency.NONPOSITIVE_MASS:
        return f"mass must be positive, but is {mass:.6g} kg"
    if status is Consistency.NOT_SYMMETRIC:
        i, j = np.unravel_index(np.argmax(np.abs(tensor - tensor.T)), tensor.shape)
        names = "xyz"
        return (
            f"the inertia tensor must be symmetric, but I_{names[i]}{names[j]} = "
            f"{tensor[i, j]:.6g} and I_{names[j]}{names[i]} = {tensor[j, i]:.6g} kg m²"
        )
    return _explain_moments(params, status, tolerance)


def thicken(params: InertialParameters, length: Float[Array, ""] | float) -> InertialParameters:
    """The body with its mass blurred by `length` (m, standard deviation) in every direction.

    Adds m length² to every second moment about the CoM, hence 2 m length² to every moment of
    inertia: smooth, alike in all frames, and it moves a rod or plate off the boundary.
    """
    added = 2.0 * params.mass * length**2 * jnp.eye(3, dtype=params.inertia.dtype)
    return dataclasses.replace(params, inertia=params.inertia + added)


def _default_tolerance(params: InertialParameters) -> float:
    return 64.0 * float(jnp.finfo(jnp.asarray(params.inertia).dtype).eps)


def _is_finite(params: InertialParameters) -> Bool[Array, ""]:
    return jnp.all(jnp.array([jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(params)]))


def _triangle_slack(moments: Float[Array, "3"]) -> Float[Array, ""]:
    """I₁ + I₂ - I₃ of ascending moments."""
    return moments[0] + moments[1] - moments[2]


def _explain_moments(params: InertialParameters, status: Consistency, tolerance: float) -> str:
    moments = jnp.linalg.eigvalsh(0.5 * (params.inertia + params.inertia.T))
    listed = ", ".join(f"{moment:.6g}" for moment in moments)
    if status is Consistency.NEGATIVE_MOMENT:
        return f"principal moments must not be negative, but they are {listed} kg m²"
    if status is Consistency.TRIANGLE_INEQUALITY:
        return (
            f"no body has principal moments {listed} kg m²: the largest exceeds the sum of the "
            f"others by {-float(_triangle_slack(moments)):.6g} kg m²"
        )
    if status is Consistency.ON_BOUNDARY:
        return (
            f"realisable without volume only (rod, plate or point): principal moments {listed} "
            f"kg m² meet the triangle inequality with equality within {tolerance:.3g}"
        )
    return f"consistent: mass {float(params.mass):.6g} kg, principal moments {listed} kg m²"
