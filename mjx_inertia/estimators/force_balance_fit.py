"""Newton's law on the measured motion of one push: mass by regression, friction unknown.

In: one `PushRecord` at a high rate, where the CoM is, and c of the outline. Out: `BalanceFit`.

While the object slides, with a the acceleration of the CoM, a_c that of its point under the tip,
v its velocity and S = |(v, c ω)|,

    F = m a + m_p a_c + f(s) v / S,        f(s) = f0 + f1 P1(s) + f2 P2(s).

The last term is the friction of an ellipsoidal limit surface (thesis Eqs 3.7 and 3.8), whose size
f = μ m g is free and may drift along the path s (Legendre polynomials), because friction on one
table differs twofold between objects and by tenths along one push. m_p is what moves between the
force sensor and the object: the sensor weighs the probe too. It rides on the arm's compliance and
moves with the object, so its acceleration is that of the object's point under the tip.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Bool, Float, Int

from mjx_inertia.pushing import PushRecord, PushStatus
from mjx_inertia.spatial import planar_rotate


@dataclass(frozen=True)
class BalanceSettings:
    """Which samples tell the mass, and through which filter they are seen."""

    # of the records, Hz. At 100 Hz force and motion would be seen through unlike filters.
    rate: float = 500.0
    # full width of the filter of force, pose and tip, s. Half of it lets the tracker's noise
    # through, twice as much takes the onset and the swing of the probe (11 Hz) away.
    kernel: float = 0.06
    # passes of a moving mean that make the filter; five leave no side lobes to speak of
    boxes: int = 5
    # S above which the object slides, m/s. Coulomb's law has a direction only then.
    slowest: float = 0.01
    # s before and after a sample in which it must slide too: most of the filter's half
    clear: float = 0.024
    # of its steady speed below which the tip slows down and lets go of the object
    tip_share: float = 0.9
    drift: int = 2  # degree of f(s)
    # least duration of usable samples, s; a shorter push gives no estimate
    least_sliding: float = 0.1
    memory: float = 0.1  # s beyond which residuals are not correlated; they swing with the probe

    def __post_init__(self) -> None:
        """Refuses what cannot be meant."""
        for name in ("rate", "kernel", "boxes", "slowest", "clear", "least_sliding", "memory"):
            value = getattr(self, name)
            if not value > 0:
                raise ValueError(f"{name}={value} is not positive")
        if not self.drift >= 0:
            raise ValueError(f"drift={self.drift} is negative")
        if not 0 < self.tip_share < 1:
            raise ValueError(f"tip_share={self.tip_share} is not between 0 and 1")


@struct.dataclass
class BalanceFit:
    """What one push tells, for any probe mass m_p; not finite where `ok` is not set."""

    total: Float[Array, "*n"]  # m where the probe weighed nothing, kg
    slope: Float[Array, "*n"]  # by which m falls with m_p: m = total - slope m_p, exactly
    # of m from the residuals and their autocorrelation, kg²: coefficients of 1, m_p (kg) and m_p²
    variance: Float[Array, "*n 3"]
    # f0 where the probe weighed nothing, and by how much it falls with m_p, N, N/kg
    friction: Float[Array, "*n 2"]
    ok: Bool[Array, "*n"]  # there were enough sliding samples, and the answer is finite


@struct.dataclass
class _Motion:
    """Filtered signals, world axes: of the CoM, the point under the tip, and the tip."""

    force: Float[Array, "t 2"]
    velocity: Float[Array, "t 2"]
    turning: Float[Array, " t"]
    acceleration: Float[Array, "t 2"]
    tip_acceleration: Float[Array, "t 2"]  # of the object's point under the tip
    tip_speed: Float[Array, " t"]


def force_balance(
    record: PushRecord,
    com: Float[Array, "2"],
    friction_radius: Float[Array, ""],
    settings: BalanceSettings,
) -> BalanceFit:
    """Least squares of the balance of forces over the sliding part of one push.

    The moment balance is left out: it would need c, CoM and contact point to a few mm. The record
    has `settings.rate` samples a second. `com` (object frame, m) is an input; 5 mm off can add 2 %
    to the error. `friction_radius` is c = m_max / f_max of the outline, m.
    """
    motion = _motion(record, com, settings)
    size = jnp.hypot(jnp.linalg.norm(motion.velocity, axis=1), friction_radius * motion.turning)
    used = _sliding(record, motion.tip_speed, size, settings)
    direction = motion.velocity / jnp.maximum(size, settings.slowest)[:, None]
    drift = _legendre(_place(size, used), settings.drift)

    def rows(values: Float[Array, "t 2"]) -> Float[Array, " r"]:
        return jnp.where(used[:, None], values, 0.0).T.ravel()

    columns = [motion.acceleration, *(direction * p[:, None] for p in drift)]
    basis, triangle = jnp.linalg.qr(jnp.stack([rows(column) for column in columns], axis=1))
    sides = jnp.stack([rows(motion.force), rows(motion.tip_acceleration)], axis=1)
    load = basis.T @ sides
    answer = solve_triangular(triangle, load)
    unit = jnp.zeros(len(load), load.dtype).at[0].set(1.0)
    share = basis @ solve_triangular(triangle, unit, trans=1)  # of each row in the mass
    residual = (sides - basis @ load).T.reshape(2, 2, -1)
    variance = _variance(share.reshape(2, -1), residual, jnp.sum(used), settings)
    enough = jnp.sum(used) >= settings.least_sliding * settings.rate
    finite = jnp.isfinite(answer).all() & jnp.isfinite(variance).all()
    return BalanceFit(
        total=answer[0, 0],
        slope=answer[0, 1],
        variance=variance,
        friction=answer[1],
        ok=(record.status == PushStatus.OK) & enough & finite,
    )


def _motion(record: PushRecord, com: Float[Array, "2"], settings: BalanceSettings) -> _Motion:
    kernel = jnp.asarray(_kernel(settings), record.pose.dtype)
    half = len(kernel) // 2

    def smooth(values: Float[Array, "t d"]) -> Float[Array, "t d"]:
        padded = jnp.pad(values, ((half, half), (0, 0)), mode="edge")
        return jax.vmap(lambda x: jnp.convolve(x, kernel, mode="valid"), 1, 1)(padded)

    def rate(values: Float[Array, "t d"]) -> Float[Array, "t d"]:
        return jnp.asarray(jnp.gradient(values, axis=0)) * settings.rate

    pose, tip, force = map(jnp.asarray, (record.pose, record.tip_position, record.force))
    # Small numbers, so that two derivatives in float32 keep their digits.
    origin = pose[0].at[2].set(0.0)
    pose = smooth(_both_intervals(pose - origin))
    tip = smooth(_both_intervals(tip - origin[:2]))
    # A sample is the mean over the interval that ends there; two of them are centred on their time.
    force = smooth(0.5 * (force + jnp.concatenate([force[1:], force[-1:]])))
    velocity = rate(pose)
    acceleration = rate(velocity)
    turning, spin_up = velocity[:, 2], acceleration[:, 2]
    to_com = planar_rotate(pose[:, 2], com)

    def accelerated(arm: Float[Array, "t 2"]) -> Float[Array, "t 2"]:
        square = turning[:, None] ** 2
        return acceleration[:, :2] + spin_up[:, None] * _across(arm) - square * arm

    return _Motion(
        force=force,
        velocity=velocity[:, :2] + turning[:, None] * _across(to_com),
        turning=turning,
        acceleration=accelerated(to_com),
        # The tip's centre stands for the contact: its radius of 5 mm changes some 0.01 N.
        tip_acceleration=accelerated(tip - pose[:, :2]),
        tip_speed=jnp.linalg.norm(rate(tip), axis=1),
    )


def _both_intervals(values: Float[Array, "t d"]) -> Float[Array, "t d"]:
    """Means over the intervals before and after each sample (Simpson), as the force is one."""
    before, after = (
        jnp.concatenate(x) for x in ((values[:1], values[:-1]), (values[1:], values[-1:]))
    )
    return (before + 4.0 * values + after) / 6.0


def _across(arm: Float[Array, "t 2"]) -> Float[Array, "t 2"]:
    return jnp.stack([-arm[:, 1], arm[:, 0]], axis=1)


def _kernel(settings: BalanceSettings) -> Float[np.ndarray, " k"]:
    """Repeated moving mean, of odd length and sum 1."""
    width = max(1, round(settings.kernel * settings.rate / settings.boxes))
    kernel = box = np.full(width, 1.0 / width)
    for _ in range(settings.boxes - 1):
        kernel = np.convolve(kernel, box)
    return kernel if len(kernel) % 2 else np.convolve(kernel, [0.5, 0.5])


def _sliding(
    record: PushRecord,
    tip_speed: Float[Array, " t"],
    size: Float[Array, " t"],
    settings: BalanceSettings,
) -> Bool[Array, " t"]:
    """Samples around which the object slides and before which the tip has not slowed down.

    The filter must not reach beyond the record either.
    """
    steps = jnp.arange(len(size))
    half = len(_kernel(settings)) // 2
    inside = (steps >= half) & (steps < record.length - half)
    clear = round(settings.clear * settings.rate)
    stands = jnp.concatenate([jnp.zeros(1, int), jnp.cumsum(~((size > settings.slowest) & inside))])
    first = jnp.maximum(steps - clear, 0)
    last = jnp.minimum(steps + clear + 1, len(size))
    fast = inside & (tip_speed > 0.5 * jnp.max(jnp.where(inside, tip_speed, 0.0)))
    steady = jnp.nanmedian(jnp.where(fast, tip_speed, jnp.nan))
    slows = jnp.max(jnp.where(inside & (tip_speed > settings.tip_share * steady), steps, 0))
    return (stands[last] == stands[first]) & (steps <= slows - clear // 2)


def _place(size: Float[Array, " t"], used: Bool[Array, " t"]) -> Float[Array, " t"]:
    """Path slid, from -1 at the first sample used to 1 at the last."""
    path = jnp.cumsum(size)
    first = jnp.min(jnp.where(used, path, jnp.inf))
    last = jnp.max(jnp.where(used, path, -jnp.inf))
    return jnp.where(used, 2.0 * (path - first) / (last - first) - 1.0, 0.0)


def _legendre(x: Float[Array, " t"], degree: int) -> list[Float[Array, " t"]]:
    terms = [jnp.ones_like(x), x]
    for n in range(1, degree):
        terms.append(((2 * n + 1) * x * terms[n] - n * terms[n - 1]) / (n + 1))
    return terms[: degree + 1]


def _variance(
    share: Float[Array, "2 t"],
    residual: Float[Array, "2 2 t"],
    used: Int[Array, ""],
    settings: BalanceSettings,
) -> Float[Array, "3"]:
    """qᵀ K q: q the shares, K the autocovariance of the residual of both axes, tapered.

    The residual is the first one minus m_p times the second; the answer holds the coefficients of
    1, m_p and m_p².
    """
    lags = round(settings.memory * settings.rate)
    lag = jnp.arange(lags)

    def products(a: Float[Array, "2 t"], b: Float[Array, "2 t"]) -> Float[Array, " l"]:
        later = jnp.pad(b, ((0, 0), (0, lags)))
        return jax.vmap(
            lambda n: jnp.sum(a * jax.lax.dynamic_slice_in_dim(later, n, a.shape[1], axis=1))
        )(lag)

    taper = jnp.where(lag == 0, 1.0, 2.0) * (1.0 - lag / lags)
    weight = taper * products(share, share) / (2.0 * jnp.maximum(used, 1))
    first, second = residual
    crossed = products(first, second) + products(second, first)
    terms = jnp.stack([products(first, first), -crossed, products(second, second)])
    return terms @ weight
