"""The classical estimator: the CoM of one push by the quasi-static laws, without simulation.

In: the signals of pushes (`Examples.records`). Out: `Estimate`. Eqs 3.7 and 3.8 of the thesis are
solved for the CoM, c and f_max = μ m g; Eqs 3.9 and 3.10 follow from them, and whether the tip
sticks or slides is not asked. I_zz plays no part in them, and mass none without μ (errata 12): for
these the answer is the training mean with infinite variance.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from mjx_inertia.estimators.estimate import Estimate, Estimator, answer, usable_rows
from mjx_inertia.estimators.mean_estimator import FittedMean, fit_mean
from mjx_inertia.estimators.wrench_twist import (
    WrenchTwistFit,
    WrenchTwistGuess,
    com_from_wrench_twist,
)
from mjx_inertia.features import Examples, FeatureSettings
from mjx_inertia.features.signals import Signals, signals
from mjx_inertia.pushing import PushRecord
from mjx_inertia.pushing.settings import GRAVITY

_BLOCK = 256  # pushes in flight
_LONGEST_SETTLING = 0.2  # of the push


@dataclass(frozen=True)
class LimitSurfaceSettings:
    """What is assumed before a push is seen, and which samples are steady."""

    # μ between object and table; None if unknown, and then mass is too
    friction: float | None = None
    # standard deviation of the CoM about the training mean, m: wider than any object, so that it
    # shows only where the push tells nothing
    com_reach: float = 0.2
    radius: float = 0.06  # guess of c = m_max / f_max, m
    radius_factor: float = 3.0  # by which c may well differ from it
    # time after first contact that is left out, s; at most a fifth of the push
    settling: float = 0.3
    rows: int = 60  # parts of equal length into which the rest of a push is averaged

    def __post_init__(self) -> None:
        """Refuses what cannot be meant."""
        for name in ("friction", "com_reach", "radius", "rows"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ValueError(f"{name}={value} is not positive")
        if not self.radius_factor > 1:
            raise ValueError(f"radius_factor={self.radius_factor} is not above 1")
        if not self.settling >= 0:
            raise ValueError(f"settling={self.settling} is negative")


def steady_rows(
    push: Signals, settings: LimitSurfaceSettings
) -> tuple[Float[Array, "rows 3"], Float[Array, "rows 3"], Float[Array, " rows"]]:
    """Mean loads and twists of the parts of a push, and how many samples each is the mean of.

    Axes are those of the contact frame when first touched and turn with the object from then on;
    the origin is the material point touched first. Averaging comes before the laws because a tip
    that slides loses contact for single samples; their mean is what friction balances.
    """
    turned = push.displacement[:, 2]
    fx, fy, moment, ux, uy, w, _, _ = push.values.T
    force, velocity = (_in_object_axes(turned, *xy) for xy in ((fx, fy), (ux, uy)))
    after = jnp.minimum(settings.settling, _LONGEST_SETTLING * jnp.max(push.elapsed * push.valid))
    steady = push.valid & (push.elapsed >= after)
    rank = jnp.cumsum(steady) - 1
    part = jnp.where(steady, rank * settings.rows // jnp.maximum(steady.sum(), 1), settings.rows)
    padded = jnp.stack([*force, moment, *velocity, w, jnp.ones_like(fx)], 1)
    sums = jax.ops.segment_sum(padded, part, settings.rows + 1)[:-1]
    count = sums[:, 6]
    mean = sums[:, :6] / jnp.maximum(count, 1.0)[:, None]
    return mean[:, :3], mean[:, 3:], count


def _in_object_axes(
    turned: Float[Array, " t"], x: Float[Array, " t"], y: Float[Array, " t"]
) -> tuple[Float[Array, " t"], Float[Array, " t"]]:
    cos, sin = jnp.cos(turned), jnp.sin(turned)
    return cos * x + sin * y, cos * y - sin * x


def limit_surface_fit(
    record: PushRecord, com_guess: Float[Array, "2"], settings: LimitSurfaceSettings
) -> WrenchTwistFit:
    """What one push tells by the quasi-static laws; the CoM from its first contact point.

    Args:
      record: of one push.
      com_guess: the CoM where the push tells nothing, m.
      settings: of the estimator.
    """
    push = signals(record, FeatureSettings(reference="contact"))
    guess = WrenchTwistGuess(com_guess, settings.com_reach, settings.radius, settings.radius_factor)
    fit = com_from_wrench_twist(*steady_rows(push, settings), guess)
    return fit.replace(ok=fit.ok & push.usable)


def _answer_of(
    fit: WrenchTwistFit, mean: Float[Array, "4"], friction: float | None
) -> tuple[Float[Array, "4"], Float[Array, "4 4"]]:
    """Mean and covariance in the order of `TARGETS`."""
    weight_force = GRAVITY if friction is None else friction * GRAVITY
    mass = fit.max_force / weight_force
    slope = jnp.stack([mass, jnp.ones_like(mass), jnp.ones_like(mass)])
    order = jnp.array([3, 0, 1])  # log f_max, com_x, com_y
    known = slope[:, None] * fit.covariance[order][:, order] * slope
    place = jnp.array([0, 2, 3])
    covariance = jnp.zeros((4, 4), known.dtype).at[place[:, None], place].set(known)
    covariance = covariance.at[1, 1].set(jnp.inf)
    if friction is None:
        mass = mean[0]
        covariance = covariance.at[0].set(0.0).at[:, 0].set(0.0).at[0, 0].set(jnp.inf)
    return jnp.stack([mass, mean[1], *fit.com]), covariance


@partial(jax.jit, static_argnames="settings")
def _answers(
    mean: Float[Array, "4"], records: PushRecord, settings: LimitSurfaceSettings
) -> tuple[Float[Array, "n 4"], Float[Array, "n 4 4"], Bool[Array, " n"]]:
    def one(record: PushRecord) -> tuple[Array, Array, Array]:
        fit = limit_surface_fit(record, mean[2:], settings)
        return *_answer_of(fit, mean.astype(fit.com.dtype), settings.friction), fit.ok

    return jax.lax.map(one, records, batch_size=_BLOCK)


def predict_limit_surface(
    settings: LimitSurfaceSettings, fitted: FittedMean, examples: Examples
) -> Estimate:
    """The CoM that each push tells; mass too where the settings give μ.

    Raises:
      ValueError: the examples carry no signals.
    """
    if examples.records is None:
        raise ValueError(
            "limit_surface: `examples.records` is None and it needs the signals: extract with "
            "keep_records=True"
        )
    records = jax.tree.map(jnp.asarray, examples.records)
    mean, covariance, ok = _answers(fitted.mean, records, settings)
    return answer(mean, covariance, usable_rows(examples) & ok)


def limit_surface(settings: LimitSurfaceSettings = LimitSurfaceSettings()) -> Estimator:
    """Quasi-static laws; fitting takes the training mean for what they do not tell."""
    return Estimator("limit_surface", fit_mean, partial(predict_limit_surface, settings))
