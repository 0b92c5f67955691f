"""Sensor noise of thesis §3.6.1, applied when pushes are read, never to what is stored.

In: noiseless records and a key. Out: the same records as a noisy sensor would give them.
"""

import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, UInt

from mjx_inertia.pushing import PushRecord, first_samples, with_few_lengths
from mjx_inertia.spatial import AnyArray, planar_cross, planar_rotate


@dataclass(frozen=True)
class SensorNoise:
    """Independent normal errors: standard deviation `spread / 3` of the value, and a floor."""

    spread: float = 0.05  # three standard deviations over the value (0.05: the ±5 % of the thesis)
    # times the floors below (0: an error in proportion alone, as in the thesis; a signal that is
    # nearly zero is then measured nearly exactly, which no sensor does)
    floor: float = 0.0
    force: float = 0.02  # floor, N
    moment: float = 2e-4  # N m, about the point of contact
    velocity: float = 2e-4  # of the contact point and of the tip, m/s
    spin: float = 2e-3  # rad/s
    position: float = 1e-4  # m
    yaw: float = 1e-3  # rad

    def sigma(self, value: Float[AnyArray, "*n"], floor: float) -> Float[Array, "*n"]:
        """Standard deviation of the error at a value, one of the floors being given."""
        return self.spread / 3 * jnp.abs(jnp.asarray(value)) + self.floor * floor


def _contact_lever(record: PushRecord) -> Float[Array, "t 2"]:
    """From the object-frame origin to the material point that was touched first, m, world."""
    turn = record.pose[:, 2] - record.pose[0, 2]
    arm = record.contact_point - record.pose[0, :2]
    return planar_rotate(turn, arm)


def _noisy(key: PRNGKeyArray, record: PushRecord, noise: SensorNoise) -> PushRecord:
    """One push: every measured value is off by a normal error.

    Moment and velocity are measured at the contact, where the sensor is, and carried over to the
    tracker's origin: an error in proportion to their values at that origin, which in simulation is
    the CoM, would give the CoM away. Positions are measured from where the push began: an error in
    proportion to the distance from the world's origin would be none of a sensor's.
    """
    # One loop draws for all signals: eight draws written out take eight times as long to compile.
    # A signal takes the first numbers of its key's, which do not depend on how many are drawn.
    most, dtype = record.force.size, record.force.dtype
    keys = jax.random.split(key, 8)
    drawn = iter(jax.lax.map(lambda key: jax.random.normal(key, (most,), dtype), keys))

    def measured(x: Float[AnyArray, "..."], floor: float) -> Float[Array, "..."]:
        error = next(drawn)[: x.size].reshape(x.shape)
        return jnp.asarray(x) + noise.sigma(x, floor) * error

    def displaced(x: Float[AnyArray, "t d"], floor: float) -> Float[Array, "t d"]:
        return x[0] + measured(x - x[0], floor)

    lever = _contact_lever(record)
    across = jnp.stack([-lever[:, 1], lever[:, 0]], -1)
    spin = record.twist[:, 2]
    force, noisy_spin = measured(record.force, noise.force), measured(spin, noise.spin)
    about_contact = measured(record.moment - planar_cross(lever, record.force), noise.moment)
    at_contact = measured(record.twist[:, :2] + spin[:, None] * across, noise.velocity)
    return record.replace(
        force=force,
        moment=about_contact + planar_cross(lever, force),
        twist=jnp.concatenate([at_contact - noisy_spin[:, None] * across, noisy_spin[:, None]], -1),
        tip_velocity=measured(record.tip_velocity, noise.velocity),
        pose=jnp.concatenate(
            [
                displaced(record.pose[:, :2], noise.position),
                displaced(record.pose[:, 2:], noise.yaw),
            ],
            -1,
        ),
        tip_position=displaced(record.tip_position, noise.position),
    )


def add_noise(
    records: PushRecord, index: UInt[AnyArray, " n"], noise: SensorNoise, *, key: PRNGKeyArray
) -> PushRecord:
    """Adds sensor noise to many pushes.

    Args:
      records: noiseless, leading axis n.
      index: number of each push in its dataset: its noise depends on this and the key alone.
      noise: of the sensors.
      key: of the noise.

    Returns:
      The noisy records.
    """
    noisy = _add_noise(with_few_lengths(records), index, noise, key=key)
    return first_samples(noisy, records.time.shape[1])


@functools.partial(jax.jit, static_argnames="noise")
def _add_noise(
    records: PushRecord, index: UInt[Array, " n"], noise: SensorNoise, *, key: PRNGKeyArray
) -> PushRecord:
    keys = jax.vmap(functools.partial(jax.random.fold_in, key))(index)
    return jax.vmap(functools.partial(_noisy, noise=noise))(
        keys, jax.tree.map(jnp.asarray, records)
    )
