"""MuJoCo's constraint problem with elliptic cones, as a convex function of the acceleration.

The acceleration a minimises ½ (a - a_smooth)ᵀ M (a - a_smooth) + Σ s(J a - a_ref) (MuJoCo
documentation, "Computation: primal problem"). Constraints of one kind and dimension stand side by
side and every small operation is written out, so that a batch of scenes vectorises.

In: MJX model and data after `make_constraint`, or contacts by their geometry. Out:
`ContactProblem`, the forces of its rows, the gradient and the Hessian of its cost. It knows nothing
of pushes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.spatial import AnyArray
from mjx_inertia.spatial.unrolled import (
    Component,
    Matrix,
    SymmetricMatrix,
    Vector,
    computed_once,
)

TINY = 1e-15  # below this squared slip the direction of friction is undefined


@struct.dataclass
class Constraints:
    """All constraints of one kind, side by side: every entry is an array over the constraints."""

    jacobian: Matrix  # J, a column for each free degree of freedom
    reference: Vector  # reference acceleration of each row
    weight: Vector  # D, the inverse of the regularisation, of each row
    scale: Vector  # [mu, friction_1, ...]: makes the cone circular
    # where each row of each constraint stands among the rows of MJX
    rows: tuple[tuple[int, ...], ...] = struct.field(pytree_node=False)
    # holds in both directions (an equality), else only pushes (a contact, a limit)
    bilateral: bool = struct.field(pytree_node=False)


@struct.dataclass
class ContactProblem:
    """The problem of one scene, over its free degrees of freedom."""

    mass: SymmetricMatrix  # M
    smooth: Vector  # M a_smooth, the generalised force without constraints, N and N m
    constraints: list[Constraints]  # by kind
    # indices of the free degrees of freedom
    free: tuple[int, ...] = struct.field(pytree_node=False)


def read_problem(
    model: mjx.Model,
    data: mjx.Data,
    smooth: Float[Array, " nv"],
    prescribed: tuple[int, ...] = (),
) -> ContactProblem:
    """The problem that MJX's data describe.

    Args:
      model: with `cone="elliptic"`.
      data: with mass matrix and constraint rows filled in.
      smooth: generalised force without constraints, N and N m.
      prescribed: degrees of freedom with a prescribed constant velocity.

    Raises:
      ValueError: for another cone, or for joints or tendons with friction loss.
    """
    if int(model.opt.cone) != int(mujoco.mjtCone.mjCONE_ELLIPTIC):
        raise ValueError('the contact problem needs a model with option cone="elliptic"')
    efc, contact = data._impl, data._impl.contact
    if int(efc.nf):
        raise ValueError("joints and tendons with frictionloss are not handled: set it to 0")
    # where the rows of each kind stand in MJX's Jacobian
    free = tuple(j for j in range(model.nv) if j not in prescribed)
    address, dimensions = np.asarray(contact.efc_address), np.asarray(contact.dim)
    first = int(efc.ne) + int(efc.nl)

    # constraints of one kind and dimension side by side
    def group(index: np.ndarray, rows: Sequence[np.ndarray], bilateral: bool) -> Constraints:
        friction = [contact.friction[index, i] for i in range(len(rows) - 1)]
        one = jnp.ones(len(rows[0]), efc.efc_J.dtype)
        mu = friction[0] / jnp.sqrt(model.opt.impratio) if friction else one
        return Constraints(
            jacobian=Matrix([efc.efc_J[r, j] for j in free] for r in rows),
            reference=Vector(efc.efc_aref[r] for r in rows),
            weight=Vector(efc.efc_D[r] for r in rows),
            scale=Vector((mu, *friction)),
            rows=tuple(tuple(int(i) for i in r) for r in rows),
            bilateral=bilateral,
        )

    # equalities, then joint limits, then contacts by their dimension
    none = np.zeros(0, int)
    groups = [
        group(none, [rows], bilateral)
        for rows, bilateral in (
            (np.arange(int(efc.ne)), True),
            (np.arange(int(efc.ne), first), False),
        )
        if len(rows)
    ]
    for dimension in sorted({int(d) for d in dimensions}):
        index = np.flatnonzero(dimensions == dimension)
        groups.append(group(index, [address[index] + i for i in range(dimension)], False))
    full = mjx.full_m(model, data)
    return ContactProblem(
        mass=SymmetricMatrix([full[i, j] for j in free[: k + 1]] for k, i in enumerate(free)),
        smooth=Vector(smooth[j] for j in free),
        constraints=groups,
        free=free,
    )


@dataclass(frozen=True)
class ContactLaw:
    """MuJoCo's parameters of one kind of contact."""

    # time constant (s; may be traced) and damping ratio of the normal direction
    solref: tuple[Float[AnyArray, ""] | float, float]
    solref_friction: tuple[Float[AnyArray, ""] | float, float]  # of the other directions
    # impedance at no depth and at `width`, that width (m), midpoint 0.5 and power 2
    solimp: tuple[float, float, float, float, float]
    impratio: float  # how much stiffer friction is than the normal direction
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
    """Elliptic contacts from their geometry: what `mjx.make_constraint` computes from a scene.

    Args:
      law: of the contacts.
      distance: between the surfaces, m; a contact is open when it is positive.
      jacobian: rows (normal, tangents, torsion) of columns (free degrees of freedom).
      velocity: of each row, m/s (rad/s for torsion), prescribed motion included.
      friction: of each row but the first.
      inverse_mass: of the two bodies, summed: what MuJoCo scales regularisation with, 1/kg.
    """
    touches = distance < 0
    # regularisation and reference acceleration (MuJoCo documentation, "Solver parameters")
    impedance = computed_once(law.impedance(distance))
    regularisation = inverse_mass * (1.0 - impedance) / impedance
    sideways = regularisation / law.impratio
    stiffness, damping = law.stiffness_and_damping(friction=False)
    reference = [-damping * velocity[0] - stiffness * impedance * distance]
    _, damping = law.stiffness_and_damping(friction=True)
    reference += -damping * velocity[1:]
    row_regularisation = [regularisation, *(sideways * (friction[0] / mu) ** 2 for mu in friction)]
    # an open contact has rows of zeros
    count, zero = jnp.shape(distance), jnp.zeros_like(distance)

    def where_touching(x: Component) -> Array:
        return computed_once(jnp.where(touches, x, zero))

    mu = jnp.broadcast_to(friction[0], count)
    return Constraints(
        jacobian=jax.tree.map(where_touching, jacobian),
        reference=Vector(map(where_touching, reference)),
        weight=Vector(1.0 / jnp.maximum(r, mujoco.mjMINVAL) for r in row_regularisation),
        scale=Vector((mu / law.impratio**0.5, *(jnp.broadcast_to(f, count) for f in friction))),
        rows=tuple(
            tuple(range(i, i + len(jacobian) * count[0], len(jacobian)))
            for i in range(len(jacobian))
        ),
        bilateral=False,
    )


def constraint_residual(c: Constraints, acceleration: Vector) -> Vector:
    """J a - a_ref of every row, for all constraints of one kind."""
    side_by_side = Vector(a[None] for a in acceleration)
    return computed_once(c.jacobian @ side_by_side - c.reference)


def cone_forces(c: Constraints, slip: Vector) -> tuple[Vector, SymmetricMatrix]:
    """Force of each row and the second derivative of the cost, at `slip` = J a - a_ref.

    The three zones of the elliptic cone (mujoco/src/engine/engine_core_constraint.c,
    mj_constraintUpdate): open, quadratic (all rows stuck), and the cone's surface in between.
    """
    if c.bilateral:
        return -c.weight * slip, SymmetricMatrix([c.weight])
    # in coordinates in which the cone is circular: N = mu normal against T = |u[1:]|
    mu = c.scale[0]
    u = c.scale * slip
    normal = u[0]
    tangent_sq = u[1:] @ u[1:] if len(u) > 1 else jnp.zeros_like(normal)
    slides = tangent_sq > TINY
    inverse_tangent = jax.lax.rsqrt(jnp.where(slides, tangent_sq, 1.0))
    tangent = jnp.where(slides, tangent_sq * inverse_tangent, 0.0)
    # the zone of each constraint
    stuck = jnp.where(slides, mu * normal + tangent <= 0, normal < 0)
    surface = slides & (normal < mu * tangent) & ~stuck
    # cost on the surface: ½ d (N - mu T)²
    d = jnp.where(surface, c.weight[0] / (mu * mu * (1 + mu * mu)), 0.0)
    weight = Vector(jnp.where(stuck, w, 0.0) for w in c.weight)
    normal_force = -d * (normal - mu * tangent) * mu
    force = -weight * slip
    sliding = normal_force * inverse_tangent * u[1:] * c.scale[1:]
    force = Vector((force[0] + normal_force, *(force[1:] - sliding)))
    # second derivative on the surface, of which the lower half is written out
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
    return force, SymmetricMatrix(hessian)


def smooth_gradient(problem: ContactProblem, a: Vector) -> Vector:
    """M a - M a_smooth."""
    return problem.mass @ a - problem.smooth


def gradient(problem: ContactProblem, a: Vector) -> Vector:
    """Gradient of the cost, M (a - a_smooth) - Jᵀ f: zero at the acceleration."""
    total = smooth_gradient(problem, a)
    for c in problem.constraints:
        force = computed_once(cone_forces(c, constraint_residual(c, a))[0])
        total = total - Vector((column @ force).sum() for column in c.jacobian.T)
    return total


def gradient_and_hessian(problem: ContactProblem, a: Vector) -> tuple[Vector, SymmetricMatrix]:
    """Gradient and Hessian of the cost."""
    total, hessian = smooth_gradient(problem, a), problem.mass
    for c in problem.constraints:
        force, curvature = cone_forces(c, constraint_residual(c, a))
        columns = c.jacobian.T
        curved = [curvature @ column for column in columns]
        total = total - Vector((column @ force).sum() for column in columns)
        hessian = hessian + SymmetricMatrix(
            [(column @ curved[i]).sum() for i in range(j + 1)] for j, column in enumerate(columns)
        )
    return total, hessian


def row_forces(problem: ContactProblem, a: Vector, rows: int) -> Float[Array, " rows"]:
    """Force of every constraint row, in MJX's order."""
    force = jnp.zeros(rows, a[0].dtype)
    for c in problem.constraints:
        values, _ = cone_forces(c, constraint_residual(c, a))
        for index, value in zip(c.rows, values, strict=True):
            force = force.at[np.array(index)].set(value)
    return force
