"""Pushes made from the quasi-static laws alone, without a simulator."""

import jax
import jax.numpy as jnp
import numpy as np
from pushing.quasi_static_laws import sticking_twist

from mjx_inertia.pushing import PushRecord

RATE = 100.0


def quasi_static_push(com, c, max_force, velocity, samples=300, lead_in=2):
    """A push whose tip sticks to the object frame's point (0, 0), which it starts to push at once.

    Args:
      com: from the contact point, m: x along the inward normal.
      c: m_max / f_max, m.
      max_force: μ m g, N.
      velocity: of the tip, m/s.
      samples: at `RATE`.
      lead_in: samples at rest before.
    """
    dtype = jnp.zeros(()).dtype

    def turned(yaw, p):
        cos, sin = jnp.cos(yaw), jnp.sin(yaw)
        return jnp.stack([cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]])

    def state(yaw):
        lever = -turned(yaw, com)
        twist = sticking_twist(velocity, lever, c)
        load = twist * jnp.array([1.0, 1.0, c**2])
        load = load * max_force / jnp.sqrt(load[0] ** 2 + load[1] ** 2 + (load[2] / c) ** 2)
        return twist, load, lever

    def step(yaw, _):
        twist, load, lever = state(yaw)
        half = yaw + 0.5 * twist[2] / RATE
        next_yaw = yaw + state(half)[0][2] / RATE
        force, moment = load[:2], load[2] - lever[0] * load[1] + lever[1] * load[0]
        return next_yaw, (yaw, jnp.append(velocity, twist[2]), force, moment)

    _, (yaw, twist, force, moment) = jax.lax.scan(step, jnp.zeros((), dtype), None, samples)
    pad = [(lead_in, 0)]
    zeros = [(0, 0)]
    time = (jnp.arange(samples + lead_in) + 1) / RATE
    path = velocity * jnp.arange(samples)[:, None] / RATE
    tip_velocity = jnp.broadcast_to(velocity, (samples, 2))
    return PushRecord(
        time=time,
        force=jnp.pad(force, pad + zeros),
        moment=jnp.pad(moment, pad),
        pose=jnp.pad(jnp.column_stack([path, yaw]), pad + zeros),
        twist=jnp.pad(twist, pad + zeros),
        tip_position=jnp.pad(path, pad + zeros),
        tip_velocity=jnp.pad(tip_velocity, pad + zeros),
        contact_point=jnp.zeros(2),
        contact_normal=jnp.array([1.0, 0.0]),
        length=jnp.int32(samples + lead_in),
        status=jnp.int32(0),
    )


def random_pushes(seed, number):
    """Records of random objects, and (mass, com_x, com_y, c, friction) of each."""
    rng = np.random.default_rng(seed)
    mass, friction = rng.uniform(0.5, 5.0, number), rng.uniform(0.2, 0.6, number)
    com = rng.uniform([0.04, -0.05], [0.1, 0.05], (number, 2))
    com[:, 1] += np.sign(com[:, 1]) * 0.01
    c = rng.uniform(0.03, 0.08, number)
    angle = rng.uniform(-0.3, 0.3, number)
    velocity = rng.uniform(0.02, 0.05, (number, 1)) * np.stack([np.cos(angle), np.sin(angle)], 1)
    arguments = (jnp.asarray(x) for x in (com, c, friction * mass * 9.81, velocity))
    return jax.vmap(quasi_static_push)(*arguments), np.column_stack([mass, com, c, friction])
