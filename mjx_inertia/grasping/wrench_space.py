"""How well a grasp resists wrenches from anywhere: the quality measures of Ferrari and Canny 1992.

The wrenches that contacts can exert with normal forces of at most 1 N (in sum, "l1", or each,
"linf") are a convex set; ε is the radius of the largest ball around 0 in it, the volume its volume.
Moments about the reference point are divided by a length (m), so that all is in newtons per newton:
the distance of the contacts from the CoM or the object's radius of gyration are usual choices.
In: contacts. Out: ε with exact cones in JAX for two soft fingers; ε and volume with linearised
cones by Qhull for any contacts.
"""

import dataclasses
import itertools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpy import ndarray
from scipy.spatial import ConvexHull, QhullError

from mjx_inertia.grasping.contact_model import SoftFinger, grasp_map, is_force_closure, support
from mjx_inertia.grasping.grasp import Contacts
from mjx_inertia.grasping.two_soft_fingers import least_normal_force

_DIRECTIONS = 500
_STARTS = 24
_STEPS = 20


def epsilon_quality(
    contacts: Contacts,
    pad: SoftFinger,
    reference: Float[Array, "3"],
    length: Float[Array, ""] | float,
    *,
    norm: str = "l1",
) -> Float[Array, ""]:
    """ε of two soft fingers with exact friction cones; 0 without force closure. Differentiable.

    1/ε is the greatest normal force that a wrench of length 1 can ask for, the maximum of a convex
    function over a sphere. The step to the direction of its gradient never lowers it; it starts
    from the 24 weakest of 500 directions. A local maximum would give too large an ε; with 120 of
    2,000 none of 400 random grasps got a smaller one.

    Args:
      contacts: the two of one grasp.
      pad: friction.
      reference: of moments, m, in the object frame; usually the CoM.
      length: m, by which moments are divided.
      norm: "l1" or "linf": normal forces of at most 1 N in sum, or each.
    """
    held = jax.lax.stop_gradient((contacts, pad, reference, jnp.asarray(length)))

    def needed(
        direction: Array, contacts: Contacts, pad: SoftFinger, reference: Array, length: Array
    ) -> Array:
        wrench = jnp.concatenate([direction[:3], length * direction[3:]])
        return least_normal_force(contacts, pad, wrench, reference, norm=norm)

    def strength(direction: Array) -> Array:
        twist = jnp.concatenate([direction[:3], direction[3:] / held[3]])
        each = support(held[0], held[1], twist, held[2])
        return jnp.max(each) if norm == "l1" else jnp.sum(jnp.maximum(each, 0.0))

    def climb(direction: Array) -> tuple[Array, Array]:
        def step(_: Int[Array, ""], direction: Array) -> Array:
            gradient = jax.grad(needed)(direction, *held)
            size = jnp.sqrt(jnp.sum(gradient**2))
            usable = jnp.isfinite(size) & (size > 0.0)
            return jnp.where(usable, gradient / jnp.where(usable, size, 1.0), direction)

        direction = jax.lax.fori_loop(0, _STEPS, step, direction)
        return direction, needed(direction, *held)

    # climb from the weakest of many directions to the greatest force that is needed
    directions = jnp.asarray(_directions(), dtype=contacts.points.dtype)
    _, weakest = jax.lax.top_k(-jax.vmap(strength)(directions), _STARTS)
    ends, forces = jax.vmap(climb)(directions[weakest])
    worst = jax.lax.stop_gradient(ends[jnp.argmax(forces)])
    # ε there, differentiable by the envelope theorem
    closed = is_force_closure(contacts, pad)
    force = needed(worst, contacts, pad, reference, jnp.asarray(length))
    return jnp.where(closed, 1.0 / jnp.where(closed, force, 1.0), 0.0)


def _directions() -> Float[ndarray, "d 6"]:
    drawn = np.random.default_rng(0).normal(size=(_DIRECTIONS - 12, 6))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    return np.concatenate([np.eye(6), -np.eye(6), drawn])


@dataclasses.dataclass(frozen=True)
class WrenchHull:
    """The wrench space with linearised friction cones."""

    epsilon: float  # radius of the largest ball around 0 in it; 0 where 0 is not inside
    volume: float  # six-dimensional, in (N/N)⁶


def wrench_hull(
    contacts: Contacts,
    pad: SoftFinger,
    reference: Float[Array, "3"],
    length: float,
    *,
    norm: str = "l1",
    edges: int = 8,
) -> WrenchHull:
    """ε and volume of any number of contacts, on the host, by Qhull.

    Cones are replaced by the hull of points on them, so both figures are too low, by an amount that
    falls with the square of `edges`. Qhull's input is joggled, because points of a cone are
    cospherical. Arguments as for `epsilon_quality`, which is the one to use for ε of many grasps of
    two fingers; `edges` are those of a cone in each of its two directions. "linf" takes seconds,
    because its points are all sums.

    Raises:
      ValueError: another norm, or fewer than 4 edges.
    """
    if norm not in ("l1", "linf") or edges < 4:
        raise ValueError(f"`norm` is {norm!r} and `edges` {edges}; 'l1' or 'linf', and 4 or more")
    matrix = np.asarray(grasp_map(contacts, jnp.asarray(reference), length), dtype=np.float64)
    unit = _cone_points(float(pad.friction), float(pad.torsion), edges)
    blocks = np.split(matrix, matrix.shape[1] // 4, axis=1)
    each = [np.concatenate([unit @ block.T, np.zeros((1, 6))]) for block in blocks]
    if norm == "l1":
        points = np.concatenate(each)
    else:
        points = np.array([sum(combination) for combination in itertools.product(*each)])
    try:
        hull = ConvexHull(points, qhull_options="QJ Pp")
    except QhullError:  # flat: some wrench cannot be exerted at all
        return WrenchHull(0.0, 0.0)
    return WrenchHull(max(float(np.min(-hull.equations[:, -1])), 0.0), float(hull.volume))


def _cone_points(friction: float, torsion: float, edges: int) -> Float[ndarray, "p 4"]:
    """(normal, two tangential, torsion) on the boundary of what a normal force of 1 allows."""
    latitude = np.linspace(-0.5 * np.pi, 0.5 * np.pi, edges // 2 + 1)
    longitude = 2.0 * np.pi * np.arange(edges) / edges
    lat, lon = (x.ravel() for x in np.meshgrid(latitude, longitude))
    points = np.stack(
        [
            np.ones_like(lat),
            friction * np.cos(lat) * np.cos(lon),
            friction * np.cos(lat) * np.sin(lon),
            torsion * np.sin(lat),
        ],
        axis=1,
    )
    return np.unique(points.round(14), axis=0)
