"""What was measured in a push and how well, in the form that a simulation is compared with.

Signals are taken where the sensors are: force, moment and velocity at the material point of the
object that was touched first. How far that point is from the tracker's origin follows from the
pose, so residuals use the simulated lever on both sides and noise of the pose does not leak in.

In: a `PushRecord`. Out: `Observation`; residuals of one sample given the simulated one; the
`SysidProblem` of many pushes.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.dataset import SensorNoise
from mjx_inertia.estimators.sysid.unknowns import CHANNELS, SensorErrors, SysidSettings
from mjx_inertia.pushing import PushRecord, PushSetup, PushStatus, Scene
from mjx_inertia.pushing.rollout import Sample
from mjx_inertia.spatial import AnyArray, planar_cross, planar_rotate

WIDTH = 9  # f_x, f_y, m_c, u_cx, u_cy, w, x, y, yaw


@struct.dataclass
class Observation:
    """One push as identification sees it; world axes."""

    force: Float[AnyArray, "*n t 2"]  # N, (t, 2), on the object as the sensor gives it
    moment: Float[AnyArray, "*n t"]  # about the object-frame origin, N m
    twist: Float[AnyArray, "*n t 3"]  # of the object frame, m/s and rad/s
    pose: Float[AnyArray, "*n t 3"]  # of the object frame, m and rad
    tip_acceleration: Float[AnyArray, "*n t 2"]  # m/s², what the probe's mass feels
    # from the object-frame origin to the point that was touched first, at the start, m
    arm: Float[AnyArray, "*n 2"]
    # inverse standard deviation of each residual; 0 where there is nothing to compare
    weight: Float[AnyArray, "*n t 9"]
    interval: Float[AnyArray, "*n"]  # between samples, s
    length: Int[AnyArray, "*n"]  # number of valid samples


@struct.dataclass
class SysidProblem:
    """Pushes to be identified, with a leading axis: signals, and what was known before them."""

    observation: Observation  # what was measured
    setup: PushSetup
    centroid: Float[AnyArray, "n 2"]  # of the outline, object frame, m
    body: Int[AnyArray, " n"]  # which body was pushed; pushes of one body share all unknowns
    scene: Scene = struct.field(pytree_node=False)  # of the object
    settings: SysidSettings = struct.field(pytree_node=False)

    @classmethod
    def of(
        cls,
        scene: Scene,
        observation: Observation,
        setup: PushSetup,
        settings: SysidSettings,
        *,
        centroid: Float[AnyArray, "2"] | tuple[float, float] = (0.0, 0.0),
        body: Int[AnyArray, " n"] | None = None,
    ) -> "SysidProblem":
        """Pushes of objects with one outline; by default each push stands for itself."""
        n = len(observation.length)
        body = np.arange(n) if body is None else np.asarray(body)
        return cls(observation, setup, np.tile(np.asarray(centroid), (n, 1)), body, scene, settings)

    def take(self, rows: Int[AnyArray, " m"]) -> "SysidProblem":
        """Some of the pushes, numpy arrays."""
        return jax.tree.map(lambda x: np.asarray(x)[rows], self)


def _at_contact(
    lever: Float[AnyArray, "*n 2"],
    force: Float[AnyArray, "*n 2"],
    moment: Float[AnyArray, "*n"],
    twist: Float[AnyArray, "*n 3"],
) -> Float[Array, "*n 6"]:
    """Force, moment about and velocity of the contact point, spin."""
    about = moment - planar_cross(lever, force)
    spin = twist[..., 2:]
    across = jnp.stack([-lever[..., 1], lever[..., 0]], -1)
    return jnp.concatenate([force, about[..., None], twist[..., :2] + spin * across, spin], -1)


def signal_values(
    force: Float[AnyArray, "t 2"],
    moment: Float[AnyArray, " t"],
    twist: Float[AnyArray, "t 3"],
    pose: Float[AnyArray, "t 3"],
    start: Float[AnyArray, "3"],
    arm: Float[AnyArray, "2"],
) -> Float[Array, "t 9"]:
    """The nine compared signals; positions from where the push began."""
    lever = planar_rotate(pose[:, 2] - start[2], arm)
    return jnp.concatenate([_at_contact(lever, force, moment, twist), pose - start], -1)


def standard_deviation(values: Float[AnyArray, "t 9"], noise: SensorNoise) -> Float[Array, "t 9"]:
    """Of the errors of the nine signals at their values."""
    floors = (
        noise.force, noise.force, noise.moment, noise.velocity, noise.velocity, noise.spin,
        noise.position, noise.position, noise.yaw,
    )  # fmt: skip
    columns = [noise.sigma(values[:, i], floor) for i, floor in enumerate(floors)]
    return jnp.maximum(jnp.stack(columns, -1), 1e-9)


def weights(
    values: Float[AnyArray, "t 9"], length: Int[AnyArray, ""], settings: SysidSettings
) -> Float[Array, "t 9"]:
    """Inverse standard deviations; 0 beyond the push and for channels that are not fitted.

    They are taken at values smoothed over five samples: at the measured ones, low readings would
    weigh more than high ones and pull every estimate down.
    """
    padded = jnp.pad(jnp.abs(values), ((2, 2), (0, 0)), mode="edge")
    values = jnp.stack([padded[i : i + len(values)] for i in range(5)]).mean(0)
    columns = [c for name in settings.channels for c in CHANNELS[name]]
    fitted = jnp.zeros(WIDTH).at[jnp.array(columns)].set(1.0)
    inside = jnp.arange(len(values)) < length
    return fitted * inside[:, None] / standard_deviation(values, settings.noise)


def observe(record: PushRecord, settings: SysidSettings) -> Observation:
    """One record as an observation; a push that may not be used or is not finite has no weight."""
    record = jax.tree.map(lambda x: jnp.asarray(x, float) if x.dtype.kind == "f" else x, record)
    start = record.pose[0]
    arm = record.contact_point - start[:2]
    values = signal_values(record.force, record.moment, record.twist, record.pose, start, arm)
    inside = (jnp.arange(len(values)) < record.length)[:, None]
    usable = jnp.all(jnp.isfinite(values) | ~inside) & (record.status == PushStatus.OK)
    usable &= jnp.all(jnp.isfinite(record.contact_point))
    interval = record.time[1] - record.time[0]
    change = jnp.diff(jnp.asarray(record.tip_velocity), axis=0, prepend=record.tip_velocity[:1])
    acceleration = change / interval

    def clean(x: Float[AnyArray, "..."]) -> Float[Array, "..."]:
        return jnp.where(jnp.isfinite(x), x, 0.0)

    return Observation(
        force=clean(record.force),
        moment=clean(record.moment),
        twist=clean(record.twist),
        pose=clean(record.pose),
        tip_acceleration=clean(acceleration),
        arm=clean(arm),
        weight=jnp.where(usable, weights(clean(values), record.length, settings), 0.0),
        interval=interval,
        length=jnp.where(usable, record.length, 0),
    )


_observe = jax.jit(jax.vmap(observe, in_axes=(0, None)), static_argnums=1)


def observed(records: PushRecord, settings: SysidSettings) -> Observation:
    """Records with a leading axis as observations in double precision, numpy arrays."""
    with jax.enable_x64(True):
        return jax.tree.map(np.asarray, _observe(records, settings))


def sample_residual(
    o: Observation,
    k: Int[AnyArray, ""],
    simulated: Sample,
    instrument: SensorErrors,
) -> Float[Array, "9"]:
    """Measured minus simulated signals of sample `k`, in standard deviations.

    The simulated pose starts where the observed one starts; the instrument is what the sensor adds
    to the contact force.
    """
    late = jnp.clip(k + instrument.force_delay / o.interval, 0.0, o.moment.shape[0] - 1.0)
    low = jnp.minimum(late.astype(jnp.int32), o.moment.shape[0] - 2)
    share = late - low
    force = (1 - share) * o.force[low] + share * o.force[low + 1]
    moment = (1 - share) * o.moment[low] + share * o.moment[low + 1]
    carried = instrument.probe_mass * o.tip_acceleration[k] + instrument.force_bias
    start = o.pose[0] + instrument.pose_error
    lever = planar_rotate(simulated.pose[2] - start[2], o.arm)
    predicted = _at_contact(lever, simulated.force, simulated.moment, simulated.twist)
    measured = _at_contact(
        lever, force - carried, moment - planar_cross(lever, carried), o.twist[k]
    )
    gap = jnp.concatenate([measured - predicted, o.pose[k] - simulated.pose])
    return gap * o.weight[k]
