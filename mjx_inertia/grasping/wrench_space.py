"""How well a grasp resists wrenches from anywhere: ε of Ferrari and Canny 1992.

The wrenches that contacts can exert with normal forces of at most 1 N (in sum, "l1", or each,
"linf") are a convex set, the grasp wrench space; ε is the radius of the largest ball around 0 in
it. Moments are divided by a length (m), so that all is in newtons per newton.
In: two soft fingers, with exact friction cones, or the contacts of many grasps of a payload. Out:
ε, which knows no task: 0 without force closure.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.grasping.contact_model import SoftFinger, is_force_closure, support
from mjx_inertia.grasping.grasp import Contacts
from mjx_inertia.grasping.two_soft_fingers import least_normal_force
from mjx_inertia.robots import over_states
from mjx_inertia.spatial import InertialParameters

_DIRECTIONS = 500  # that are looked at
_STARTS = 24  # the weakest of them, from which the climb sets out
_STEPS = 20  # of each climb
_BLOCK = 32  # grasps at once


@jax.jit
def payload_epsilon(
    contacts: Contacts, pad: SoftFinger, payload: InertialParameters
) -> Float[Array, " n"]:
    """ε of n grasps of one payload, moments about its CoM over its radius of gyration.

    The radius is that of the whole body about its CoM, √(tr I / 2m): the root of the mean square
    distance of its mass. Contacts and payload are in the object frame.
    """
    gyration = jnp.sqrt(0.5 * jnp.trace(payload.inertia) / payload.mass)

    def one(pair: Contacts) -> Float[Array, ""]:
        return epsilon_quality(pair, pad, payload.com, gyration)

    return over_states(one, _BLOCK)(contacts)


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

    Moments are about `reference` (m, object frame; usually the CoM) and divided by `length` (m);
    `norm` is "l1" or "linf": normal forces of at most 1 N in sum, or each.
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
