"""Newton's method for MuJoCo's contact problem, fast for a batch of small scenes, with gradients.

The same minimum as `mjx.solve`, found in another form: every 6 x 6 operation is written out (see
`contact_problem.py`), iteration stops when the whole batch is done (a push in sustained contact
needs one or two steps, the first touch up to ten), and degrees of freedom with a prescribed motion
are known rather than given a huge inertia.

The iterations are not differentiated: the minimiser a(θ) satisfies r(a; θ) = 0 with r the gradient
of the cost, so its derivative along θ' is -H⁻¹ ∂r/∂θ θ' with H the Hessian at a (implicit function
theorem). That rule serves forward and reverse mode; `jax.jacfwd` through `mjx.solve` gives NaN with
elliptic cones, and reverse mode does not trace.

In: a `ContactProblem`, or MJX's model and data. Out: accelerations and constraint forces, or, from
`differentiable_step`, the state of any MJX scene after a time step. It knows nothing of pushes.
"""

import functools
from dataclasses import dataclass
from typing import cast

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.pushing.contact_problem import (
    TINY,
    Constraints,
    ContactProblem,
    constraint_residual,
    gradient,
    gradient_and_hessian,
    read_problem,
    row_forces,
    smooth_gradient,
)
from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.spatial.small_cholesky import cholesky
from mjx_inertia.spatial.unrolled import Vector, computed_once

# Of the unconstrained acceleration, in the norm of the mass matrix. A looser one in float64 would
# leave more noise than finite differences and identification bear.
TOLERANCE = {"float32": 1e-5, "float64": 1e-9}
# Newton's method squares its relative error in the last step, so an error of ten tolerances before
# it is small enough, unless the step crosses a kink: then the slope at its end is not small.
_DECREMENT_BEFORE_LAST = 100.0
# A line search ends where the slope of the cost is this share of the slope at its start. A search
# that is cut off before can send Newton's method to and fro between two points of one line.
_SLOPE_LEFT = 0.1
# Where Newton's method leaves the bracket: the cost is steep near the start and flat beyond it, so
# the minimum is nearer to the lower end.
_SHARE_OF_BRACKET = 0.25

_INTEGRATORS = {
    int(mujoco.mjtIntegrator.mjINT_EULER): mjx.euler,
    int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST): mjx.implicit,
}


@dataclass(frozen=True)
class _Line:
    """Cost of a kind of constraint along a line: normal, squared tangent, quadratic terms."""

    mu: Array
    surface_weight: Array
    normal: tuple[Array, Array]  # u_n + length v_n
    tangent: tuple[Array, Array, Array]  # uu + length (2 uv + length vv)
    stuck: tuple[Array, Array]  # slope and curvature of the quadratic cost
    bilateral: bool

    def derivatives(self, length: Array) -> tuple[Array, Array]:
        """First and second derivative of the cost at a step length, summed over the contacts."""
        (normal, rate), (uu, uv, vv), mu = self.normal, self.tangent, self.mu
        n = normal + length * rate
        half_rate = uv + length * vv
        tangent_sq = uu + length * (uv + half_rate)
        slides = tangent_sq > TINY
        inverse = jax.lax.rsqrt(jnp.where(slides, tangent_sq, 1.0))
        tangent = jnp.where(slides, tangent_sq * inverse, 0.0)
        is_stuck = jnp.where(slides, mu * n + tangent <= 0, n < 0) | self.bilateral
        on_surface = slides & (n < mu * tangent) & ~is_stuck
        tangent_rate = half_rate * inverse
        gap, gap_rate = n - mu * tangent, rate - mu * tangent_rate
        bend = mu * (vv - tangent_rate * tangent_rate) * inverse
        d = self.surface_weight
        slope, curvature = self.stuck
        first = jnp.where(on_surface, d * gap * gap_rate, 0.0)
        first = jnp.where(is_stuck, slope + length * curvature, first)
        second = jnp.where(on_surface, d * (gap_rate * gap_rate - gap * bend), 0.0)
        return first.sum(), jnp.where(is_stuck, curvature, second).sum()


def _line(c: Constraints, a: Vector, step: Vector) -> _Line:
    gap = constraint_residual(c, a)
    rate = c.jacobian @ Vector(s[None] for s in step)
    u, v = c.scale * gap, c.scale * rate
    zero = jnp.zeros_like(u[0])
    weighted = c.weight * rate
    mu = c.scale[0]
    return _Line(
        mu=mu,
        surface_weight=c.weight[0] / (mu * mu * (1 + mu * mu)),
        normal=(u[0], v[0]),
        tangent=(u[1:] @ u[1:], u[1:] @ v[1:], v[1:] @ v[1:]) if len(u) > 1 else (zero, zero, zero),
        stuck=(weighted @ gap, weighted @ rate),
        bilateral=c.bilateral,
    )


def _line_search(
    constraints: list[Constraints],
    a: Vector,
    step: Vector,
    slope: Array,
    curvature: Array,
    decrement: Array,
    enough: Array,
    steps: int,
) -> tuple[Array, Array]:
    """Newton's method, kept inside a bracket, on the slope of the cost along `step`.

    `slope` and `curvature` are those of the smooth part at a, `decrement` is minus the slope of the
    whole cost there. A slope whose own decrement would be below `enough` is small enough.

    Returns:
      The length, and the slope there.
    """
    # slope and curvature of the whole cost at a step length
    lines = [_line(c, a, step) for c in constraints]

    def derivatives(length: Array) -> tuple[Array, Array]:
        first, second = slope + length * curvature, curvature
        for line in lines:
            d1, d2 = line.derivatives(length)
            first, second = first + d1, second + d2
        return first, second

    def unfinished(state: tuple[Array, ...]) -> Array:
        count, _, _, _, first, _ = state
        far = jnp.abs(first) > _SLOPE_LEFT * decrement
        return (count < steps) & far & _remains(first, decrement, enough)

    def body(state: tuple[Array, ...]) -> tuple[Array, ...]:
        count, length, low, high, first, second = state
        # the bracket closes in; Newton's step where it stays inside
        low, high = jnp.where(first < 0, length, low), jnp.where(first < 0, high, length)
        newton = length - first / second
        middle = jnp.where(jnp.isfinite(high), low + _SHARE_OF_BRACKET * (high - low), 2.0 * length)
        length = jnp.where((newton >= low) & (newton <= high), newton, middle)
        return count + 1, length, low, high, *derivatives(length)

    one = jnp.ones_like(slope)
    start = (jnp.int32(0), one, 0.0 * one, jnp.inf * one, *derivatives(one))
    _, length, _, _, first, _ = jax.lax.while_loop(unfinished, body, start)
    return length, first


def _remains(slope: Array, decrement: Array, enough: Array) -> Bool[Array, ""]:
    """Whether a slope along a step of a given decrement is worth another step; not if it is NaN."""
    return slope * slope > enough * jnp.maximum(decrement, enough)


def _newton_step(
    problem: ContactProblem, a: Vector, line_search: int, enough: Array
) -> tuple[Vector, Bool[Array, ""]]:
    """The next iterate, and whether its Newton decrement may still be above `enough`."""
    total, hessian = gradient_and_hessian(problem, a)
    step = computed_once(cholesky(hessian, marked=False).solve(-total))
    slope = step @ smooth_gradient(problem, a)
    curvature = step @ (problem.mass @ step)
    decrement = -(step @ total)
    length, left = _line_search(
        problem.constraints, a, step, slope, curvature, decrement, enough, line_search
    )
    far = (decrement > _DECREMENT_BEFORE_LAST * enough) | _remains(left, decrement, enough)
    return a + length * step, far


@functools.partial(jax.custom_jvp, nondiff_argnums=(2, 3))
def minimiser(problem: ContactProblem, start: Vector, iterations: int, line_search: int) -> Vector:
    """Acceleration of the free degrees of freedom that minimises the cost; differentiable.

    Args:
      problem: of one scene.
      start: where Newton's method begins; without effect on value and derivative.
      iterations: at most.
      line_search: evaluations along each Newton step at most.
    """
    scale = problem.smooth @ cholesky(problem.mass, marked=False).solve(problem.smooth)
    enough = TOLERANCE[scale.dtype.name] ** 2 * scale

    def unfinished(state: tuple[Int[Array, ""], Vector, Array]) -> Array:
        count, _, far = state
        return (count < iterations) & far

    def body(state: tuple[Int[Array, ""], Vector, Array]) -> tuple[Array, Vector, Array]:
        count, a, _ = state
        return count + 1, *_newton_step(problem, a, line_search, enough)

    _, a, _ = jax.lax.while_loop(unfinished, body, (jnp.int32(0), start, scale >= 0.0))
    return a


@minimiser.defjvp
def _minimiser_jvp(
    iterations: int, line_search: int, primals: tuple, tangents: tuple
) -> tuple[Vector, Vector]:
    problem, start = primals
    a = minimiser(problem, start, iterations, line_search)
    _, change = jax.jvp(lambda p: gradient(p, a), (problem,), (tangents[0],))
    _, hessian = gradient_and_hessian(problem, a)
    slope = cholesky(hessian, marked=False).solve(computed_once(-change))
    return a, computed_once(slope)


def solve(
    model: mjx.Model,
    data: mjx.Data,
    smooth: Float[Array, " nv"],
    prescribed: tuple[int, ...] = (),
    iterations: int = 20,
    line_search: int = 20,
) -> mjx.Data:
    """Solves the contact problem of one MJX scene.

    Args:
      model: with `cone="elliptic"`.
      data: with mass matrix, constraint rows and `qacc_warmstart` filled in.
      smooth: generalised force without constraints, N and N m.
      prescribed: degrees of freedom with a prescribed constant velocity.
      iterations: Newton steps at most; they end when the last one came from an acceleration that
        was off by less than `TOLERANCE` of the unconstrained one (in the norm of the mass matrix).
      line_search: evaluations along each at most.

    Returns:
      The data with `qacc` (0 where prescribed), `qfrc_constraint` and `_impl.efc_force`.

    Raises:
      ValueError: for another cone, or for joints or tendons with friction loss.
    """
    problem = read_problem(model, data, smooth, prescribed)
    start = Vector(data.qacc_warmstart[j] for j in problem.free)
    a = minimiser(problem, start, iterations, line_search)
    efc_force = row_forces(problem, a, data._impl.efc_J.shape[0])
    qacc = jnp.zeros(model.nv, a[0].dtype).at[np.array(problem.free)].set(jnp.stack(a))
    qfrc = (data._impl.efc_J * efc_force[:, None]).sum(0)
    solved = data.tree_replace(
        {"qacc": qacc, "qfrc_constraint": qfrc, "_impl.efc_force": efc_force}
    )
    return cast(mjx.Data, solved)


def differentiable_step(
    model: mjx.Model, data: mjx.Data, iterations: int = 100, line_search: int = 30
) -> mjx.Data:
    """Advances a scene by one time step, like `mjx.step` with a converged solver.

    The stages are MJX's own but the constraint solve. Contacts of condim 3, 4 and 6 (MJX itself
    refuses 1 with elliptic cones), equalities and joint limits; forward and reverse mode, `scan`,
    `vmap`, float64 and float32.

    The motion has a kink at the instant of a first contact, and where a contact changes from
    sticking to sliding; the derivative there is one-sided (docs/gradients.md says where it can be
    trusted). A parameter of the model that MuJoCo compiles into others (mass into
    `body_invweight0`, say) must be changed in all of them.

    Args:
      model: with `cone="elliptic"` and the integrator Euler or implicitfast.
      data: its state.
      iterations: Newton steps of the constraint solver at most.
      line_search: evaluations along each at most.

    Raises:
      ValueError: for another cone or integrator, or for friction loss in joints or tendons.
    """
    integrator = int(model.opt.integrator)
    if integrator not in _INTEGRATORS:
        raise ValueError(f"integrator {integrator}: choose Euler or implicitfast")
    data = mjx.sensor_pos(model, mjx.fwd_position(model, data))
    data = mjx.sensor_vel(model, mjx.fwd_velocity(model, data))
    data = mjx.fwd_acceleration(model, mjx.fwd_actuation(model, data))
    if data._impl.efc_J.size == 0:
        data = data.replace(qacc=data.qacc_smooth)
    else:
        data = solve(model, data, data.qfrc_smooth, iterations=iterations, line_search=line_search)
        data = mjx.sensor_acc(model, data)
    return cast(mjx.Data, _INTEGRATORS[integrator](model, data))
