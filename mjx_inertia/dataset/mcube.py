"""One measured push as the record that a simulated push gives too.

In: a measurement file (Yu et al. 2016) and the outlines of objects. Out: `PushRecord`, cut to the
push and brought to common times, with what is wrong in its signals as status.

The force is minus the reaction on the pusher and keeps its first sample: recordings start with
the tip touching, often pre-loaded. Its moment is taken from the contact point, the point of the
outline that is closest to the tip's centre.
"""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.mcube_file import (
    McubeFileError,
    McubeSignals,
    Signal,
    parse_name,
    read_bytes,
    read_signals,
)
from mjx_inertia.dataset.mcube_status import McubeSamples, mcube_push_status
from mjx_inertia.objects import (
    ObjectModel,
    OutlineContact,
    closest_on_outline,
    in_object_frame,
    load_mcube_objects,
    turn_vectors,
)
from mjx_inertia.pushing import PushRecord

VELOCITY_HALF_WINDOW = 0.03  # s: 15 stamps at 250 Hz; 0.1 mm of noise becomes about 4 mm/s
LEAD_IN = 0.1  # s kept before the tip moves: what pre-loads it
MOTION_STARTS = 2e-4  # m from its first position: the tip moves; at rest it is steady to 0.01 mm
TOUCHING = 2e-3  # m of gap within which tracking cannot tell that the tip does not touch
TIP_RADIUS = 0.00475  # m, of the published measurements
_FEWEST_SAMPLES = 5
_LONGEST = 600.0  # s; the slowest published push takes 5 s: a wrong time stamp, not a push


def interpolated(signal: Signal, time: Float[ndarray, " t"]) -> Float[ndarray, "t d"]:
    """Values at `time` on straight lines between stamps, the end values beyond the stamps."""
    return np.stack([np.interp(time, signal.time, column) for column in signal.value.T], axis=-1)


def interval_means(
    signal: Signal, time: Float[ndarray, " t"], interval: float
) -> Float[ndarray, "t d"]:
    """Means over the `interval` (s) that ends at each time, of straight lines between stamps."""
    return (_integral(signal, time) - _integral(signal, time - interval)) / interval


def _integral(signal: Signal, time: Float[ndarray, " t"]) -> Float[ndarray, "t d"]:
    """Integral from the first stamp, exact for straight lines between stamps."""
    step = np.diff(signal.time)[:, None]
    panels = 0.5 * step * (signal.value[1:] + signal.value[:-1])
    total = np.concatenate([np.zeros_like(panels[:1]), np.cumsum(panels, axis=0)])
    before = np.clip(np.searchsorted(signal.time, time, side="right") - 1, 0, len(step) - 1)
    here = interpolated(signal, time)
    since = (time - signal.time[before])[:, None]
    return total[before] + 0.5 * since * (signal.value[before] + here)


def velocities(
    signal: Signal, time: Float[ndarray, " t"], half_window: float = VELOCITY_HALF_WINDOW
) -> Float[ndarray, "t d"]:
    """Time derivative at `time`: the slope there of a weighted cubic through nearby stamps.

    The stamps need no regular spacing. Weights fall as 1 - (Δt / h)² to zero at the half window
    h, which widens where stamps are missing until it holds seven, four of them on each side.
    Exact for motion of constant jerk. A sine of 11 Hz, at which a held probe and an object of 1 kg
    swing, keeps 98 % of its velocity (a parabola would take 13 % of it), one of 20 Hz 82 %.
    """
    spacing = float(np.median(np.diff(signal.time)))
    count = min(len(signal.time), 2 * int(np.ceil(half_window / spacing)) + 7)
    first = np.searchsorted(signal.time, time) - count // 2
    first = np.clip(first, 0, len(signal.time) - count)
    rows = first[:, None] + np.arange(count)
    offset = signal.time[rows] - time[:, None]
    seventh = np.sort(np.abs(offset), axis=1)[:, min(7, count - 1)]
    here = np.searchsorted(signal.time, time)
    before = signal.time[np.clip(here - 4, 0, None)]
    after = signal.time[np.clip(here + 3, None, len(signal.time) - 1)]
    reach = np.maximum.reduce([seventh, time - before, after - time])
    window = np.maximum(half_window, 1.001 * reach)[:, None]
    x = offset / window
    weight = np.clip(1.0 - x**2, 0.0, None)
    powers = np.stack([np.ones_like(x), x, x**2, x**3], axis=-1)
    normal = np.einsum("tk,tki,tkj->tij", weight, powers, powers)
    centred = signal.value[rows] - signal.value[rows].mean(axis=1, keepdims=True)
    right = np.einsum("tk,tki,tkd->tid", weight, powers, centred)
    # Stamps in one cluster do not tell a slope: the pseudo-inverse then takes the smallest one.
    return (np.linalg.pinv(normal, rcond=1e-9, hermitian=True) @ right)[:, 1] / window


def load_mcube(
    path: str | Path,
    objects: dict[str, ObjectModel] | None = None,
    rate: float = 100.0,
    tip_radius: float = TIP_RADIUS,
) -> PushRecord:
    """Reads one push from an HDF5 or JSON file, which may lie in a zip archive on the path.

    The record runs from at most 0.1 s before the tip moves until it has come to rest, on times
    that all three streams cover. At each time stand the force averaged over the sampling interval
    that ends there, pose and tip interpolated, and velocities by a cubic through the stamps
    within 30 ms. First contact is the first sample at which the tip is within 2 mm of touching.

    Args:
      path: of the file; its name tells the object.
      objects: outlines by name; the published objects if None.
      rate: samples a second, Hz.
      tip_radius: of the cylindrical tip, m.

    Returns:
      The record in float32, with the status of the first check that it fails.

    Raises:
      McubeFileError: the file is not a push, with its path, the key, what was expected and found.
      FileNotFoundError: there is no such file.
      ValueError: a rate or radius that is not positive, or above 10 kHz or 1 m.
    """
    objects = load_mcube_objects() if objects is None else objects
    return record_from_bytes(read_bytes(path), str(path), objects, rate, tip_radius)


def check_sampling(rate: float, tip_radius: float) -> None:
    """Raises ValueError for a rate (Hz) or a radius of the tip (m) that cannot be."""
    for name, value, most in (("rate", rate, 1e4), ("tip_radius", tip_radius, 1.0)):
        if not 0.0 < value <= most:
            raise ValueError(f"{name}={value}: expected a positive number up to {most:g}")


def record_from_bytes(
    content: bytes,
    file: str,
    objects: dict[str, ObjectModel],
    rate: float,
    tip_radius: float,
) -> PushRecord:
    """As `load_mcube`, from the content of a file of the given name."""
    check_sampling(rate, tip_radius)
    shape = parse_name(file).shape
    if shape not in objects:
        raise McubeFileError(
            file,
            "object",
            f"one of {sorted(objects)}",
            f"{shape!r}; pass `objects` with its outline, mass and I_zz "
            "(mjx_inertia.objects.load_mcube_objects reads a table of your own)",
        )
    return record_from_signals(read_signals(content, file), file, objects[shape], rate, tip_radius)


def record_from_signals(
    signals: McubeSignals, file: str, obj: ObjectModel, rate: float, tip_radius: float
) -> PushRecord:
    """The push in some streams, on common times; `file` is for messages."""
    interval = 1.0 / rate
    time = _push_times(signals, interval, file)
    pose = interpolated(signals.pose, time)
    tip = interpolated(signals.tip, time)
    force = interval_means(signals.force, time, interval)
    contact = contact_in_world(obj, pose, tip)
    gap = contact.distance - tip_radius
    touching = np.flatnonzero(gap <= TOUCHING)
    first = int(touching[0]) if len(touching) else int(np.argmin(gap))
    arm = contact.point - pose[:, :2]
    tip_velocity = velocities(signals.tip, time)
    samples = McubeSamples(time, pose, tip_velocity, force, gap)
    status = mcube_push_status(obj.outline, signals, samples)

    def single(values: Float[ndarray, "..."]) -> jnp.ndarray:
        return jnp.asarray(values, dtype=jnp.float32)

    return PushRecord(
        time=single(time - time[0] + interval),
        force=single(force),
        moment=single(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]),
        pose=single(pose),
        twist=single(velocities(signals.pose, time)),
        tip_position=single(tip),
        tip_velocity=single(tip_velocity),
        contact_point=single(contact.point[first]),
        contact_normal=single(contact.normal[first]),
        length=jnp.asarray(len(time), dtype=jnp.int32),
        status=jnp.asarray(int(status), dtype=jnp.int32),
    )


def contact_in_world(
    model: ObjectModel, pose: Float[ndarray, "t 3"], tip: Float[ndarray, "t 2"]
) -> OutlineContact:
    """Closest outline point to the tip's centre at each time, with point and normal in the world.

    `distance` is from the outline to the tip's centre, m.
    """
    contact = closest_on_outline(model.outline, in_object_frame(pose, tip))
    return OutlineContact(
        point=turn_vectors(pose[:, 2], contact.point) + pose[:, :2],
        distance=contact.distance,
        normal=turn_vectors(pose[:, 2], contact.normal),
        edge=contact.edge,
    )


def _push_times(signals: McubeSignals, interval: float, file: str) -> Float[ndarray, " t"]:
    """Sampling times from just before the tip moves until it rests, within all streams.

    A tip that never moves gives the whole recording.
    """
    streams = (signals.pose, signals.tip, signals.force)
    begin = max(stream.time[0] for stream in streams) + interval
    end = min(stream.time[-1] for stream in streams)
    travel = np.linalg.norm(signals.tip.value - signals.tip.value[0], axis=1)
    moving = travel > MOTION_STARTS
    # Three stamps in a row, so that one wrong position does not start the push.
    starts = np.flatnonzero(moving[:-2] & moving[1:-1] & moving[2:])
    if len(starts):
        arrived = np.flatnonzero(travel >= travel.max() - MOTION_STARTS)[0]
        begin = max(begin, signals.tip.time[starts[0]] - LEAD_IN)
        end = min(end, signals.tip.time[arrived])
    count = int(np.floor((end - begin) / interval + 1e-6)) + 1
    if end - begin > _LONGEST:
        raise McubeFileError(
            file, "time stamps", f"a push of at most {_LONGEST:g} s", f"{end - begin:g} s"
        )
    if count < _FEWEST_SAMPLES:
        raise McubeFileError(
            file,
            "time stamps",
            f"a push of {_FEWEST_SAMPLES} samples or more that all three streams cover",
            f"{max(end - begin, 0.0):.3f} s at {1.0 / interval:g} Hz",
        )
    return begin + interval * np.arange(count)
