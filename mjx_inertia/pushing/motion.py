"""How the tip moves: prescribed motions, each a pytree with a start and a velocity.

In: a description of the path. Out: `StraightMotion` or `SampledMotion`; the simulation asks one
for its velocity, averaged over a step, so the tip follows the path exactly.
"""

import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.spatial import AnyArray


@struct.dataclass
class StraightMotion:
    """A straight path at constant speed, after a ramp of constant acceleration."""

    start: Float[AnyArray, "*n 2"]  # centre of the tip at time 0, m, world
    direction: Float[AnyArray, "*n 2"]  # unit vector of the path
    speed: Float[AnyArray, "*n"]  # reached after the ramp, m/s
    ramp: Float[AnyArray, "*n"]  # duration of the acceleration from rest, s (0: full speed at once)
    duration: Float[AnyArray, "*n"]  # after which the tip stands still, s

    def velocity(self, time: Float[Array, ""], step: float) -> Float[Array, "2"]:
        """Mean velocity from `time` to `time + step`, m/s (the midpoint, exact on a ramp)."""
        middle = time + 0.5 * step
        share = jnp.where(self.ramp > 0, middle / jnp.where(self.ramp > 0, self.ramp, 1.0), 1.0)
        moving = middle < self.duration
        return jnp.asarray(self.direction) * (self.speed * jnp.minimum(share, 1.0) * moving)


@struct.dataclass
class SampledMotion:
    """A path through sampled positions, straight between them: one measured in a file, say."""

    start: Float[AnyArray, "*n 2"]  # centre of the tip at time 0, m, world
    offsets: Float[AnyArray, "*n k 2"]  # (knots, 2) positions minus `start`, m
    # time between knots, s; after the last one the tip stands still
    interval: Float[AnyArray, "*n"]
    duration: Float[AnyArray, "*n"]  # s

    def velocity(self, time: Float[Array, ""], step: float) -> Float[Array, "2"]:
        """Mean velocity from `time` to `time + step`, m/s."""
        knots = jnp.arange(self.offsets.shape[0])

        def at(t: Float[Array, ""]) -> Float[Array, "2"]:
            x = t / self.interval
            return jnp.stack([jnp.interp(x, knots, self.offsets[:, i]) for i in range(2)])

        return (at(time + step) - at(time)) / step


Motion = StraightMotion | SampledMotion
