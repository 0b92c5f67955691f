"""All that the library says of an arm at many states, by one program for all arms of a shape."""

import jax
import jax.numpy as jnp
from reference_models import Dynamics

from mjx_inertia.robots import (
    forward_dynamics,
    hand_jacobian,
    hand_pose,
    inverse_dynamics,
    link_poses,
    mass_matrix,
)
from mjx_inertia.robots.dynamics import bias_force, jacobian_rate_product


def dynamics(arm, states):
    """`Dynamics`, and what only some tests look at."""
    nameless = arm.replace(name="", joint_names=(), note="")
    quantities, more = _dynamics(nameless, *map(jnp.asarray, states))
    return Dynamics(**quantities), more


@jax.jit
def _dynamics(arm, q, qd, qdd):
    def one(q, qd, qdd):
        hand, torque = hand_pose(arm, q), inverse_dynamics(arm, q, qd, qdd)
        quantities = {
            "position": hand.translation,
            "rotation": hand.rotation,
            "jacobian": hand_jacobian(arm, q),
            "drift": jacobian_rate_product(arm, q, qd),
            "mass_matrix": mass_matrix(arm, q),
            "bias": bias_force(arm, q, qd),
            "torque": torque,
        }
        acceleration = forward_dynamics(arm, q, qd, torque)
        return quantities, {"acceleration": acceleration, "links": link_poses(arm, q)}

    return jax.vmap(one)(q, qd, qdd)
