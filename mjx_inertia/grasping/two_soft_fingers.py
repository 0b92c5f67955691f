"""The forces of two soft fingers that hold a given wrench with the least effort.

Eight contact forces balance six components, so two numbers are free: the squeeze N along the line
between the contacts, and τ, how the two pads share the moment about that line. For given τ each
friction cone holds from one N on, a root of a quadratic; the least over τ of the greater root is a
convex problem in one variable, solved by bisection on its slope.
In: two contacts and the wrench they exert. Out: the least squeeze, or the least normal force,
differentiable in both (by the envelope theorem: τ is held where it is).
"""

import itertools

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.grasping.contact_model import SoftFinger, antipodal_margin
from mjx_inertia.grasping.grasp import Contacts

_HALVINGS = 40


@struct.dataclass
class _Cone:
    """One contact as a function of τ and N.

    Within the friction cone where a N² + 2 (b0 + b1 τ) N + c0 + 2 c1 τ + c2 τ² <= 0; the normal
    force is normal[0] + normal[1] τ + normal[2] N.
    """

    a: Float[Array, ""]
    b: tuple[Float[Array, ""], Float[Array, ""]]
    c: tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]
    normal: tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]


@struct.dataclass
class _Term:
    """start + slope τ + weight N(τ), where N is what one cone asks for."""

    start: Float[Array, ""]
    slope: Float[Array, ""]
    weight: Float[Array, ""]
    cone: _Cone


def least_squeeze(
    contacts: Contacts, pad: SoftFinger, wrench: Float[Array, "6"], reference: Float[Array, "3"]
) -> Float[Array, ""]:
    """Least force (N) of a jaw whose two fingers together exert `wrench` on the object.

    The fingers of a parallel jaw move as one, so the jaw's force is half the difference of the
    finger forces along the line between the contacts (virtual work); their sum is borne by the
    guide. Infinite where the contacts are not in force closure.

    Args:
      contacts: the two of one grasp.
      pad: friction; its torsion must be positive.
      wrench: force (N) and moment (N m) about `reference`, in the axes of the object.
      reference: m, in the object frame.
    """
    cones, reach = _cones(contacts, pad, wrench, reference)
    one, zero = jnp.ones_like(cones[0].a), jnp.zeros_like(cones[0].a)
    terms = [_Term(zero, zero, one, cone) for cone in cones]
    return _if_closed(contacts, pad, _least_maximum(terms, reach))


def least_normal_force(
    contacts: Contacts,
    pad: SoftFinger,
    wrench: Float[Array, "6"],
    reference: Float[Array, "3"],
    *,
    norm: str = "l1",
) -> Float[Array, ""]:
    """Least normal force (N) with which two contacts exert `wrench`; else as `least_squeeze`.

    With `norm` "l1" it is the sum of both normal forces, with "linf" the greater one.

    Raises:
      ValueError: another norm.
    """
    cones, reach = _cones(contacts, pad, wrench, reference)
    if norm == "l1":
        start, slope, weight = (x + y for x, y in zip(*(c.normal for c in cones), strict=True))
        terms = [_Term(start, slope, weight, cone) for cone in cones]
    elif norm == "linf":
        terms = [_Term(*one.normal, other) for one, other in itertools.product(cones, cones)]
    else:
        raise ValueError(f"`norm` is {norm!r}; choose 'l1' or 'linf'")
    return _if_closed(contacts, pad, _least_maximum(terms, reach))


def _if_closed(contacts: Contacts, pad: SoftFinger, value: Array) -> Array:
    return jnp.where(antipodal_margin(contacts, pad) > 0.0, value, jnp.inf)


def _dot(a: Array, b: Array) -> Array:
    return jnp.sum(a * b)


def _cones(
    contacts: Contacts, pad: SoftFinger, wrench: Array, reference: Array
) -> tuple[tuple[_Cone, _Cone], Array]:
    """Both contacts as functions of τ and N, and how large τ can be.

    With F the force and f = ±g + F/2 the forces of the fingers, the moment K that is left about the
    middle of the contacts is borne by g across the line d (lever: their distance) and by torsions.
    """
    p0, p1 = contacts.points
    n0, n1 = contacts.normals
    distance = jnp.linalg.norm(p1 - p0)
    d = (p1 - p0) / distance
    force = wrench[:3]
    moment = wrench[3:] - jnp.cross(0.5 * (p0 + p1) - reference, force)
    # torsions share the moment about the line evenly at τ = 0; g bears what is across it
    share = 0.5 * _dot(moment, d)
    along = (_guarded(_dot(n0, d)), -_guarded(-_dot(n1, d)))
    turn0, turn1 = n0 / along[0], n1 / along[1]
    across = jnp.cross(d, moment - share * (turn0 + turn1)) / distance
    lean = jnp.cross(d, turn1 - turn0) / distance
    one = _cone(pad, n0, (0.5 * force + across, lean, d), (share / along[0], 1.0 / along[0]))
    two = _cone(pad, n1, (0.5 * force - across, -lean, -d), (share / along[1], -1.0 / along[1]))
    # beyond what the torsion of the pads would take at the squeeze for evenly shared torsion
    even = jnp.maximum(_root(one, jnp.zeros_like(share)), _root(two, jnp.zeros_like(share)))
    force_scale = jnp.linalg.norm(force) + jnp.linalg.norm(across) + jnp.abs(even)
    return (one, two), 4.0 * (jnp.abs(share) + pad.torsion * force_scale)


def _cone(
    pad: SoftFinger, normal: Array, force: tuple[Array, ...], torsion: tuple[Array, Array]
) -> _Cone:
    """`force` is (at 0, per τ, per N), `torsion` (at 0, per τ)."""
    alpha, beta = 1.0 / pad.friction**2, 1.0 / pad.torsion**2
    p, q, e = force
    n_p, n_q, n_e = (_dot(normal, x) for x in force)
    r, s = torsion

    def form(x: Array, y: Array, n_x: Array, n_y: Array) -> Array:
        return alpha * _dot(x, y) - (1.0 + alpha) * n_x * n_y

    a = form(e, e, n_e, n_e)
    return _Cone(
        a=jnp.where(a < 0.0, a, -1.0),
        b=(form(p, e, n_p, n_e), form(q, e, n_q, n_e)),
        c=(
            form(p, p, n_p, n_p) + beta * r * r,
            form(p, q, n_p, n_q) + beta * r * s,
            form(q, q, n_q, n_q) + beta * s * s,
        ),
        normal=(n_p, n_q, n_e),
    )


def _guarded(cosine: Array) -> Array:
    """Away from zero, where the contacts are no force closure anyway."""
    return jnp.maximum(cosine, 1e-3)


def _root(cone: _Cone, tau: Array) -> Array:
    """The least N for which the cone holds."""
    b = cone.b[0] + cone.b[1] * tau
    return -(b + jnp.sqrt(_discriminant(cone, tau))) / cone.a


def _discriminant(cone: _Cone, tau: Array) -> Array:
    b = cone.b[0] + cone.b[1] * tau
    c = cone.c[0] + tau * (2.0 * cone.c[1] + tau * cone.c[2])
    return jnp.maximum(b * b - cone.a * c, jnp.finfo(b.dtype).tiny)


def _value(term: _Term, tau: Array) -> Array:
    return term.start + term.slope * tau + term.weight * _root(term.cone, tau)


def _slope(term: _Term, tau: Array) -> Array:
    cone = term.cone
    b = cone.b[0] + cone.b[1] * tau
    half = b * cone.b[1] - cone.a * (cone.c[1] + cone.c[2] * tau)
    root_slope = -(cone.b[1] + half / jnp.sqrt(_discriminant(cone, tau))) / cone.a
    return term.slope + term.weight * root_slope


def _greatest(terms: list[_Term], tau: Array) -> Array:
    return jnp.argmax(jnp.stack([_value(term, tau) for term in terms]))


def _least_maximum(terms: list[_Term], reach: Array) -> Array:
    """The least over |τ| <= reach of the greatest term."""
    held = jax.lax.stop_gradient(terms)
    reach = jax.lax.stop_gradient(reach)

    def halve(_: Int[Array, ""], bracket: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = bracket
        middle = 0.5 * (low + high)
        best, slope = _value(held[0], middle), _slope(held[0], middle)
        for term in held[1:]:
            value = _value(term, middle)
            slope = jnp.where(value > best, _slope(term, middle), slope)
            best = jnp.maximum(best, value)
        return jnp.where(slope > 0.0, low, middle), jnp.where(slope > 0.0, middle, high)

    low, high = jax.lax.fori_loop(0, _HALVINGS, halve, (-reach, reach))
    tau = 0.5 * (low + high)
    # Two terms cross at the minimum, or one is flat there: the mixture of both without slope in τ
    # has the gradient of the minimum (Danskin's theorem).
    falling, rising = _greatest(held, low), _greatest(held, high)
    slopes = jnp.stack([_slope(term, tau) for term in held])
    down, up = jnp.maximum(-slopes[falling], 0.0), jnp.maximum(slopes[rising], 0.0)
    flat = down + up == 0.0
    share = jnp.where(flat, 0.5, up / jnp.where(flat, 1.0, down + up))
    values = jnp.stack([_value(term, tau) for term in terms])
    return share * values[falling] + (1.0 - share) * values[rising]
