"""Sensor noise of thesis §3.6.1, applied when pushes are read, never to what is stored.

In: noiseless records and a key. Out: the same records as a noisy sensor would give them.
"""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, UInt

from mjx_inertia.pushing import PushRecord
from mjx_inertia.spatial import AnyArray


def _contact_lever(record: PushRecord) -> Float[Array, "t 2"]:
    """From the object-frame origin to the material point that was touched first, m, world."""
    turn = record.pose[:, 2] - record.pose[0, 2]
    arm = record.contact_point - record.pose[0, :2]
    cos, sin = jnp.cos(turn), jnp.sin(turn)
    return jnp.stack([cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]], -1)


def _cross(lever: Float[Array, "t 2"], force: Float[AnyArray, "t 2"]) -> Float[Array, " t"]:
    return lever[:, 0] * force[:, 1] - lever[:, 1] * force[:, 0]


def _noisy(key: PRNGKeyArray, record: PushRecord, spread: float) -> PushRecord:
    """One push: every measured value is off by a normal error of sigma = spread/3 of it.

    Moment and velocity are measured at the contact, where the sensor is, and carried over to the
    tracker's origin: an error in proportion to their values at that origin, which in simulation is
    the CoM, would give the CoM away. Positions are measured from where the push began: an error in
    proportion to the distance from the world's origin would be none of a sensor's.
    """
    keys = iter(jax.random.split(key, 7))

    def scale(x: Float[AnyArray, "..."]) -> Float[Array, "..."]:
        error = jax.random.normal(next(keys), x.shape, x.dtype)
        return jnp.asarray(x) * (1 + spread / 3 * error)

    def displace(x: Float[AnyArray, "t d"]) -> Float[Array, "t d"]:
        return x[0] + scale(x - x[0])

    lever = _contact_lever(record)
    across = jnp.stack([-lever[:, 1], lever[:, 0]], -1)
    spin = record.twist[:, 2]
    force, noisy_spin = scale(record.force), scale(spin)
    moment = scale(record.moment - _cross(lever, record.force)) + _cross(lever, force)
    velocity = scale(record.twist[:, :2] + spin[:, None] * across) - noisy_spin[:, None] * across
    return record.replace(
        force=force,
        moment=moment,
        twist=jnp.concatenate([velocity, noisy_spin[:, None]], -1),
        tip_velocity=scale(record.tip_velocity),
        pose=displace(record.pose),
        tip_position=displace(record.tip_position),
    )


@functools.partial(jax.jit, static_argnames="spread")
def add_noise(
    records: PushRecord, index: UInt[Array, " n"], spread: float, *, key: PRNGKeyArray
) -> PushRecord:
    """Adds sensor noise to many pushes.

    Args:
      records: noiseless, leading axis n.
      index: number of each push in its dataset: its noise depends on this and the key alone.
      spread: three standard deviations over the value (0.05: the ±5 % of the thesis).
      key: of the noise.

    Returns:
      The noisy records.
    """
    keys = jax.vmap(functools.partial(jax.random.fold_in, key))(index)
    return jax.vmap(functools.partial(_noisy, spread=spread))(
        keys, jax.tree.map(jnp.asarray, records)
    )
