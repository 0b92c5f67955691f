"""MuJoCo's contact problem with elliptic cones, solved fast for a batch of small scenes.

The same convex problem as `mjx.solve`: the acceleration a that minimises
½ (a - a_smooth)ᵀ M (a - a_smooth) + Σ s(J a - a_ref) (MuJoCo documentation, "Computation: primal
problem"), by Newton's method with an exact line search. It differs in form: contacts of one
dimension stand side by side, every 6 x 6 operation is written out, iteration stops when the whole
batch is done (most steps need two, the first touch some eight), and degrees of freedom with a
prescribed motion are known rather than given a huge inertia.

In: MJX model and data after `make_constraint`. Out: accelerations and constraint forces.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, Int

from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.pushing.small_linalg import Matrix, Vector, cholesky_solve, dot, matvec

# Newton's method squares this error in its last step.
TOLERANCE = 1e-3
_TINY = 1e-15  # below this squared slip the direction of friction is undefined


@dataclass(frozen=True)
class _Contacts:
    """All contacts of one dimension, side by side: every array has one entry a contact.

    Attributes:
      rows: where each row of each contact stands among the constraint rows.
      jacobian: one list of columns (the free degrees of freedom) for each row of the contact.
      reference: reference acceleration of each row.
      weight: D, the inverse of the regularisation, of each row.
      scale: [mu, friction_1, ...]: makes the cone circular.
    """

    rows: list[np.ndarray]
    jacobian: list[list[Array]]
    reference: list[Array]
    weight: list[Array]
    scale: list[Array]


def _contacts(model: mjx.Model, data: mjx.Data, free: Sequence[int]) -> list[_Contacts]:
    contact, efc = data._impl.contact, data._impl
    dimensions, address = np.asarray(contact.dim), np.asarray(contact.efc_address)
    groups = []
    for dimension in sorted({int(d) for d in dimensions}):
        index = np.flatnonzero(dimensions == dimension)
        rows = [address[index] + i for i in range(dimension)]
        friction = [contact.friction[index, i] for i in range(dimension - 1)]
        mu = friction[0] / jnp.sqrt(model.opt.impratio) if friction else jnp.ones(len(index))
        groups.append(
            _Contacts(
                rows=rows,
                jacobian=[[efc.efc_J[r, j] for j in free] for r in rows],
                reference=[efc.efc_aref[r] for r in rows],
                weight=[efc.efc_D[r] for r in rows],
                scale=[mu, *friction],
            )
        )
    return groups


def _cone(c: _Contacts, slip: Vector) -> tuple[list[Array], list[list[Array]]]:
    """Force of each row and the second derivative of the cost, at `slip` = J a - a_ref.

    The three zones of the elliptic cone (mujoco/src/engine/engine_core_constraint.c,
    mj_constraintUpdate): open, quadratic (all rows stuck), and the cone's surface in between.
    """
    mu = c.scale[0]
    u = [s * x for s, x in zip(c.scale, slip, strict=True)]
    normal = u[0]
    tangent_sq = dot(u[1:], u[1:]) if len(u) > 1 else jnp.zeros_like(normal)
    slides = tangent_sq > _TINY
    inverse_tangent = jax.lax.rsqrt(jnp.where(slides, tangent_sq, 1.0))
    tangent = jnp.where(slides, tangent_sq * inverse_tangent, 0.0)
    stuck = jnp.where(slides, mu * normal + tangent <= 0, normal < 0)
    surface = slides & (normal < mu * tangent) & ~stuck
    # cost on the surface: ½ d (N - mu T)²
    d = jnp.where(surface, c.weight[0] / (mu * mu * (1 + mu * mu)), 0.0)
    weight = [jnp.where(stuck, w, 0.0) for w in c.weight]
    normal_force = -d * (normal - mu * tangent) * mu
    force = [-w * x for w, x in zip(weight, slip, strict=True)]
    force[0] = force[0] + normal_force
    for i in range(1, len(u)):
        force[i] = force[i] - normal_force * inverse_tangent * u[i] * c.scale[i]
    outer = mu * normal * inverse_tangent**3
    diagonal = mu * mu - mu * normal * inverse_tangent
    hessian: list[list[Array]] = []
    for i in range(len(u)):
        row = []
        for j in range(i + 1):
            if i == 0:
                h = jnp.ones_like(mu)
            elif j == 0:
                h = -mu * inverse_tangent * u[i]
            else:
                h = outer * u[i] * u[j] + (diagonal if i == j else 0.0)
            h = h * d * c.scale[i] * c.scale[j]
            row.append(h + weight[i] if i == j else h)
        hessian.append(row)
    return force, [[hessian[max(i, j)][min(i, j)] for j in range(len(u))] for i in range(len(u))]


def _slip(c: _Contacts, acceleration: Vector) -> list[Array]:
    spread = [a[None] for a in acceleration]
    return [dot(j, spread) - ref for j, ref in zip(c.jacobian, c.reference, strict=True)]


def _add_contact(
    c: _Contacts, a: Vector, gradient: list[Array], hessian: list[list[Array]]
) -> None:
    """Adds a group's part to the gradient and to the lower half of the Hessian, in place."""
    force, curvature = _cone(c, _slip(c, a))
    columns = [[row[j] for row in c.jacobian] for j in range(len(a))]
    curved = [matvec(curvature, column) for column in columns]
    for j, column in enumerate(columns):
        gradient[j] = gradient[j] - dot(column, force).sum()
        for i in range(j + 1):
            hessian[j][i] = hessian[j][i] + dot(column, curved[i]).sum()


@dataclass(frozen=True)
class _Line:
    """Cost of a group of contacts along a line: normal, squared tangent and quadratic terms."""

    mu: Array
    surface_weight: Array
    normal: tuple[Array, Array]  # u_n + length v_n
    tangent: tuple[Array, Array, Array]  # uu + length (2 uv + length vv)
    stuck: tuple[Array, Array]  # slope and curvature of the quadratic cost

    def derivatives(self, length: Array) -> tuple[Array, Array]:
        """First and second derivative of the cost at a step length, summed over the contacts."""
        (normal, rate), (uu, uv, vv), mu = self.normal, self.tangent, self.mu
        n = normal + length * rate
        half_rate = uv + length * vv
        tangent_sq = uu + length * (uv + half_rate)
        slides = tangent_sq > _TINY
        inverse = jax.lax.rsqrt(jnp.where(slides, tangent_sq, 1.0))
        tangent = jnp.where(slides, tangent_sq * inverse, 0.0)
        is_stuck = jnp.where(slides, mu * n + tangent <= 0, n < 0)
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


def _line(c: _Contacts, a: Vector, step: Vector) -> _Line:
    slip = _slip(c, a)
    rate = [dot(j, [s[None] for s in step]) for j in c.jacobian]
    u = [s * x for s, x in zip(c.scale, slip, strict=True)]
    v = [s * x for s, x in zip(c.scale, rate, strict=True)]
    zero = jnp.zeros_like(u[0])
    weighted = [w * x for w, x in zip(c.weight, rate, strict=True)]
    mu = c.scale[0]
    return _Line(
        mu=mu,
        surface_weight=c.weight[0] / (mu * mu * (1 + mu * mu)),
        normal=(u[0], v[0]),
        tangent=(dot(u[1:], u[1:]), dot(u[1:], v[1:]), dot(v[1:], v[1:]))
        if len(u) > 1
        else (zero, zero, zero),
        stuck=(dot(weighted, slip), dot(weighted, rate)),
    )


def _line_search(
    contacts: list[_Contacts], a: Vector, step: Vector, slope: Array, curvature: Array, steps: int
) -> Array:
    """Newton's method, kept inside a bracket, on the derivative of the cost along `step`.

    `slope` and `curvature` are those of the smooth part at a.
    """
    lines = [_line(c, a, step) for c in contacts]
    length = jnp.ones_like(slope)
    low, high = jnp.zeros_like(slope), jnp.full_like(slope, jnp.inf)
    for _ in range(steps):
        first, second = slope + length * curvature, curvature
        for line in lines:
            d1, d2 = line.derivatives(length)
            first, second = first + d1, second + d2
        low, high = jnp.where(first < 0, length, low), jnp.where(first < 0, high, length)
        newton = length - first / second
        middle = jnp.where(jnp.isfinite(high), 0.5 * (low + high), 2.0 * length)
        length = jnp.where((newton > low) & (newton < high), newton, middle)
    return length


def _newton_step(
    mass: Matrix, smooth: Vector, contacts: list[_Contacts], a: Vector, line_search: int
) -> tuple[list[Array], Array]:
    """The next iterate, and the Newton decrement (J/s² kg) at the last one."""
    gradient = [m - f for m, f in zip(matvec(mass, a), smooth, strict=True)]
    smooth_gradient = list(gradient)
    hessian = [list(row) for row in mass]
    for c in contacts:
        _add_contact(c, a, gradient, hessian)
    step = cholesky_solve(hessian, [-g for g in gradient])
    slope, curvature = dot(step, smooth_gradient), dot(step, matvec(mass, step))
    length = _line_search(contacts, a, step, slope, curvature, line_search)
    return [x + length * s for x, s in zip(a, step, strict=True)], -dot(step, gradient)


def solve(
    model: mjx.Model,
    data: mjx.Data,
    smooth: Float[Array, " nv"],
    prescribed: tuple[int, ...] = (),
    iterations: int = 20,
    line_search: int = 5,
) -> mjx.Data:
    """Solves the contact problem of one scene whose only constraints are contacts.

    Args:
      model: the MJX model, with `cone="elliptic"`.
      data: MJX data with mass matrix, constraint rows and `qacc_warmstart` filled in.
      smooth: generalised force without constraints, (nv,), N and N m.
      prescribed: degrees of freedom that move at constant velocity whatever acts on them.
      iterations: Newton steps at most; they end when the last one came from an acceleration that
        was off by less than `TOLERANCE` of the unconstrained one (in the norm of the mass matrix).
      line_search: evaluations along each.

    Returns:
      The data with `qacc` (0 where prescribed), `qfrc_constraint` and `_impl.efc_force`.

    Raises:
      ValueError: for other constraints than contacts, or another cone.
    """
    nv, rows = model.nv, data._impl.efc_J.shape[0]
    if int(model.opt.cone) != int(mujoco.mjtCone.mjCONE_ELLIPTIC):
        raise ValueError('contact_solver.solve needs a model with cone="elliptic"')
    if rows != int(np.asarray(data._impl.contact.dim).sum()):
        raise ValueError(f"contact_solver.solve handles contacts only; of {rows} rows some are not")
    free = [j for j in range(nv) if j not in prescribed]
    contacts = _contacts(model, data, free)
    full = mjx.full_m(model, data)
    mass = [[full[i, j] for j in free] for i in free]
    target = [smooth[j] for j in free]

    scale = dot(target, cholesky_solve(mass, target))

    def unfinished(state: tuple[Int[Array, ""], Vector, Array]) -> Array:
        count, _, decrement = state
        return (count < iterations) & (decrement > TOLERANCE**2 * scale)

    def body(state: tuple[Int[Array, ""], Vector, Array]) -> tuple[Array, Vector, Array]:
        count, a, _ = state
        return count + 1, *_newton_step(mass, target, contacts, a, line_search)

    start = [data.qacc_warmstart[j] for j in free]
    _, a, _ = jax.lax.while_loop(unfinished, body, (jnp.int32(0), start, jnp.inf * scale))
    efc_force = jnp.zeros(rows, a[0].dtype)
    for c in contacts:
        force, _ = _cone(c, _slip(c, a))
        for index, value in zip(c.rows, force, strict=True):
            efc_force = efc_force.at[index].set(value)
    qacc = jnp.zeros(nv, a[0].dtype).at[np.array(free)].set(jnp.stack(a))
    qfrc = (data._impl.efc_J * efc_force[:, None]).sum(0)
    solved = data.tree_replace(
        {"qacc": qacc, "qfrc_constraint": qfrc, "_impl.efc_force": efc_force}
    )
    return cast(mjx.Data, solved)
