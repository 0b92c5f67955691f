"""The mass of a pushed object from one push with unknown friction: Newton's law, calibrated.

In: records at a high rate, and for each push the CoM and the friction radius of its object, which
are inputs of this method (from its outline, or from slow pushes before). Out: `FittedNewton`,
`Estimate`. What is learnt from objects of known mass are two constants of the instrument: the mass
of the probe behind the sensor, and by how much residuals understate the error.
"""

from dataclasses import dataclass, field
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Bool, Float

from mjx_inertia.dataset import PushTruth
from mjx_inertia.estimators.estimate import Estimate, answer
from mjx_inertia.estimators.force_balance_fit import BalanceFit, BalanceSettings, force_balance
from mjx_inertia.pushing import PushRecord, PushStatus
from mjx_inertia.spatial import AnyArray

_BLOCK = 64  # pushes in flight
_ROUNDS = (
    3  # of calibration: the deviations that weigh the pushes depend on the probe mass a little
)
_NORMAL_MEDIAN = 0.455  # of the square of a standard normal error
_HUBER = 1.5  # deviations beyond which a push loses weight


@dataclass(frozen=True)
class NewtonSettings:
    """How the mass is found and calibrated."""

    balance: BalanceSettings = field(default_factory=BalanceSettings)  # of one push
    # relative error of a mass beside that of its residuals, which bounds the weight of a push in
    # the calibration
    model_error: float = 0.05


@struct.dataclass
class FittedNewton:
    """Constants of the instrument, and the answer where a push tells nothing."""

    probe_mass: Float[Array, ""]  # of what moves between the force sensor and the object, kg
    spread: Float[Array, ""]  # factor of the standard deviations, at least 1
    mean: Float[Array, "4"]  # training mean of (mass, I_zz, com_x, com_y), SI units


@partial(jax.jit, static_argnames="settings")
def _balances(
    records: PushRecord,
    com: Float[Array, "n 2"],
    friction_radius: Float[Array, " n"],
    settings: BalanceSettings,
) -> BalanceFit:
    def one(push: tuple[PushRecord, Array, Array]) -> BalanceFit:
        return force_balance(*push, settings)

    return jax.lax.map(one, (records, com, friction_radius), batch_size=_BLOCK)


def _force_balances(
    records: PushRecord,
    com: Float[AnyArray, "n 2"],
    friction_radius: Float[AnyArray, " n"],
    settings: BalanceSettings,
) -> BalanceFit:
    """`force_balance` of many pushes.

    Raises:
      ValueError: the records have another rate than the settings.
    """
    time = np.asarray(records.time, dtype=np.float64)
    last = np.maximum(np.asarray(records.length) - 1, 1)
    took = time[np.arange(len(time)), last] - time[:, 0]
    rates = last / np.maximum(took, 1e-9)
    if np.any(np.abs(rates / settings.rate - 1.0) > 0.01):
        raise ValueError(
            f"records: {np.median(rates):.4g} samples a second where settings.rate is "
            f"{settings.rate:g}; load them with rate={settings.rate:g}"
        )
    dtype = jnp.asarray(records.pose).dtype
    return _balances(
        jax.tree.map(jnp.asarray, records),
        jnp.asarray(com, dtype),
        jnp.asarray(friction_radius, dtype),
        settings,
    )


def fit_newton(
    records: PushRecord,
    com: Float[AnyArray, "n 2"],
    friction_radius: Float[AnyArray, " n"],
    truth: PushTruth,
    settings: NewtonSettings = NewtonSettings(),
) -> FittedNewton:
    """Calibrates the instrument on pushes of objects of known mass.

    Records have the rate of the settings; `com` (object frame, m) and `friction_radius` (m) are
    those of each push's object.

    Raises:
      ValueError: fewer than two pushes tell anything, or records of another rate.
    """
    fits = _force_balances(records, com, friction_radius, settings.balance)
    ok = np.asarray(fits.ok)
    if ok.sum() < 2:
        raise ValueError(
            f"fit_newton: {ok.sum()} of {len(ok)} pushes slide long enough to calibrate on; "
            "give more pushes, or faster ones"
        )
    targets = np.stack(
        [np.asarray(truth.mass), np.asarray(truth.inertia), *np.asarray(truth.com).T], axis=1
    )
    probe_mass, spread = _calibrate(fits, ok, targets[:, 0], settings.model_error)
    usable = np.asarray(records.status) == PushStatus.OK
    return FittedNewton(
        probe_mass=jnp.asarray(probe_mass),
        spread=jnp.asarray(spread),
        mean=jnp.asarray(targets[usable].mean(axis=0)),
    )


def _calibrate(
    fits: BalanceFit,
    ok: Bool[np.ndarray, " n"],
    mass: Float[np.ndarray, " n"],
    model_error: float,
) -> tuple[float, float]:
    """Probe mass by robust weighted least squares on total - slope m_p = mass, and spread."""
    total, slope, variance, mass = (
        np.asarray(x, dtype=np.float64)[ok] for x in (fits.total, fits.slope, fits.variance, mass)
    )
    probe_mass = 0.0
    for _ in range(_ROUNDS):
        error = total - slope * probe_mass - mass
        spread = variance @ probe_mass ** np.arange(3)
        weight = 1.0 / (spread + (model_error * mass) ** 2)
        weight = weight / np.maximum(1.0, np.abs(error) * np.sqrt(weight) / _HUBER)
        probe_mass += float(np.sum(weight * slope * error) / np.sum(weight * slope**2))
    squares = (total - slope * probe_mass - mass) ** 2 / (variance @ probe_mass ** np.arange(3))
    return probe_mass, max(1.0, float(np.sqrt(np.median(squares) / _NORMAL_MEDIAN)))


def predict_newton(
    fitted: FittedNewton,
    records: PushRecord,
    com: Float[AnyArray, "n 2"],
    friction_radius: Float[AnyArray, " n"],
    settings: NewtonSettings = NewtonSettings(),
) -> Estimate:
    """The mass that each push tells; for I_zz and CoM the training mean with infinite variance.

    A push that slides too little to tell the mass answers the training mean, with infinite variance
    too. The arguments are those of `fit_newton`.

    Raises:
      ValueError: records of another rate.
    """
    fits = _force_balances(records, com, friction_radius, settings.balance)
    mass = jnp.where(fits.ok, fits.total - fits.slope * fitted.probe_mass, fitted.mean[0])
    residual = fits.variance @ fitted.probe_mass ** jnp.arange(3)
    variance = jnp.where(fits.ok, fitted.spread**2 * residual, jnp.inf)
    mean = jnp.broadcast_to(fitted.mean, (len(mass), 4)).at[:, 0].set(mass)
    nothing = jnp.diag(jnp.full(4, jnp.inf, mean.dtype))
    covariance = jnp.broadcast_to(nothing, (len(mass), 4, 4)).at[:, 0, 0].set(variance)
    return answer(mean, covariance, jnp.asarray(records.status) == PushStatus.OK)
