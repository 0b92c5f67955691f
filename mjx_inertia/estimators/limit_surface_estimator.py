"""The classical estimator: the CoM of one push by the quasi-static laws, without simulation.

In: the signals of pushes (`Examples.records`); or rows of load and twist in axes fixed to the
object. Out: `Estimate`; or `WrenchTwistFit`. A steadily pushed object bears the load that its table
can just not bear, a point of an ellipsoid (thesis Eq. 3.7), and moves along the ellipsoid's normal
there (Eq. 3.8), both about the CoM. The two are solved for the CoM, c and f_max = μ m g; Eqs 3.9
and 3.10 follow from them, and whether the tip sticks or slides is not asked. I_zz plays no part in
them, and mass none without μ (errata 12): for these the answer is the training mean with infinite
variance.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import lineax as lx
import optimistix as optx
from flax import struct
from jaxtyping import Array, Bool, Float

from mjx_inertia.estimators.estimate import Estimate, Estimator, answer, usable_rows
from mjx_inertia.estimators.training import FittedMean, fit_mean
from mjx_inertia.features import Examples, FeatureSettings
from mjx_inertia.features.signals import Signals, signals
from mjx_inertia.pushing import PushRecord
from mjx_inertia.pushing.settings import GRAVITY

_STEPS = 60  # of Levenberg-Marquardt; seven to thirty do
_ROUNDS = 4  # of reweighting, each from the answer of the one before
_START_SPREAD = 0.1  # of both laws' residuals in the first round
_OUTLIER = 2.0  # standard deviations at which a row has lost half its weight (Cauchy's loss)
_MOST_CORRELATED = 0.95
_FEWEST_ROWS = 4
# rad: motion that has so little to do with the force is none that the laws describe. Real pushes
# lie below 0.3, a frozen force sensor gives 1.1.
_UNLIKE = 0.7
# Medians of the length of two standard normal errors and of the size of one.
_MEDIANS = (1.1774, 0.6745)
_BLOCK = 256  # pushes in flight
_LONGEST_SETTLING = 0.2  # of the push


@struct.dataclass
class WrenchTwistGuess:
    """What is assumed before a row is seen: a normal distribution wide enough not to matter."""

    com: Float[Array, "2"]  # m, in the frame of the rows
    # standard deviation of the CoM about it along each axis, m
    com_reach: Float[Array, ""] | float = 0.2
    radius: Float[Array, ""] | float = 0.06  # c, m
    radius_factor: Float[Array, ""] | float = 3.0  # by which c may well differ from it


@struct.dataclass
class WrenchTwistFit:
    """What rows of load and twist tell."""

    # in the frame of the rows, m: strictly the centre of friction, which lies under the CoM where
    # the table is even
    com: Float[Array, "2"]
    radius: Float[Array, ""]  # c = m_max / f_max, m
    max_force: Float[Array, ""]  # f_max = μ m g, N
    covariance: Float[Array, "4 4"]  # of (com_x m, com_y m, log c, log f_max)
    # standard deviation of the rows about Eq. 3.8 (rad) and about Eq. 3.7 (relative).
    spread: Float[Array, "2"]
    # there were enough rows, they obey Eq. 3.8 roughly, and the answer is finite.
    ok: Bool[Array, ""]


@struct.dataclass
class _Rows:
    """Rows, the roots of their weights (at most 1), and mean and deviation of the unknowns."""

    load: Float[Array, "n 3"]
    twist: Float[Array, "n 3"]
    share: Float[Array, " n"]
    guess: Float[Array, "4"]
    reach: Float[Array, "4"]


def com_from_wrench_twist(
    load: Float[Array, "n 3"],
    twist: Float[Array, "n 3"],
    weight: Float[Array, " n"],
    guess: WrenchTwistGuess,
) -> WrenchTwistFit:
    """Least squares of Eqs 3.7 and 3.8 over rows of load and twist.

    The two laws' residuals have spreads of their own, estimated along with the answer, and rows
    far off lose weight. The covariance comes from these spreads, which hold noise and model error
    alike, and is widened where neighbouring rows err alike. It knows nothing of an error that all
    rows share, such as that of an uneven table.

    Args:
      load: of the pusher on the object, N, N, N m, moment about the frame's origin.
      twist: of the object at that origin, m/s, m/s, rad/s; in order of time, if they have one.
      weight: number of samples that a row is the mean of; 0 leaves it out.
      guess: the answer where the rows say nothing.
    """
    rows = _rows(load, twist, weight, guess)
    tolerance = float(jnp.finfo(load.dtype).eps) ** 0.5
    solver = optx.LevenbergMarquardt(
        rtol=tolerance, atol=tolerance, linear_solver=lx.Normal(lx.Cholesky())
    )

    def residuals(z: Float[Array, "4"], scale: Float[Array, "n 2"]) -> tuple[Array, Array]:
        direction, size = _off(rows, z)
        return jnp.column_stack([direction * scale[:, :1], size * scale[:, 1]]), z

    def reweighted(
        carry: tuple[Float[Array, "4"], Float[Array, "n 2"]], _: None
    ) -> tuple[tuple[Float[Array, "4"], Float[Array, "n 2"]], Float[Array, "2"]]:
        solution = optx.least_squares(residuals, solver, *carry, max_steps=_STEPS, throw=False)
        spread, robust = _spread(rows, solution.value)
        return (solution.value, rows.share[:, None] * robust / spread), spread

    scale = jnp.broadcast_to(rows.share[:, None] / _START_SPREAD, (len(weight), 2))
    (z, scale), spreads = jax.lax.scan(
        reweighted, (jnp.zeros(4, load.dtype), scale), None, length=_ROUNDS
    )
    off, _ = residuals(z, scale)
    jacobian, _ = jax.jacfwd(residuals)(z, scale)
    information = jnp.einsum("nri,nrj->ij", jacobian, jacobian) / _persistence(off)
    covariance = jnp.linalg.inv(information + jnp.eye(4, dtype=load.dtype))
    theta = rows.guess + rows.reach * z
    return WrenchTwistFit(
        com=theta[:2],
        radius=jnp.exp(theta[2]),
        max_force=jnp.exp(theta[3]),
        covariance=covariance * rows.reach[:, None] * rows.reach,
        spread=spreads[-1],
        ok=(jnp.sum(weight > 0) >= _FEWEST_ROWS)
        & jnp.isfinite(covariance).all()
        & (spreads[-1, 0] < _UNLIKE),
    )


def _rows(
    load: Float[Array, "n 3"],
    twist: Float[Array, "n 3"],
    weight: Float[Array, " n"],
    guess: WrenchTwistGuess,
) -> _Rows:
    force = jnp.linalg.norm(load[:, :2], axis=1)
    middle = jnp.nanmedian(jnp.where((weight > 0) & (force > 0), force, jnp.nan))
    logs = jnp.log(jnp.stack([jnp.asarray(guess.radius, load.dtype), middle]))
    # the rows tell f_max whatever they are: ten factors of e are no assumption
    reach = [guess.com_reach, guess.com_reach, jnp.log(guess.radius_factor), 10.0]
    return _Rows(
        load=load,
        twist=twist,
        share=jnp.sqrt(weight / jnp.maximum(weight.max(), 1.0)).astype(load.dtype),
        guess=jnp.concatenate([guess.com.astype(load.dtype), logs]),
        reach=jnp.stack([jnp.asarray(x, load.dtype) for x in reach]),
    )


def _off(rows: _Rows, z: Float[Array, "4"]) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
    """How far rows are off Eq. 3.8 (difference of unit vectors) and Eq. 3.7 (relative).

    With moments over c and angular velocities times c, both laws are those of a sphere.
    """
    x, y, log_c, log_force = rows.guess + rows.reach * z
    c = jnp.exp(log_c)
    fx, fy, moment = rows.load.T
    ux, uy, w = rows.twist.T
    bears = jnp.stack([fx, fy, (moment - (x * fy - y * fx)) / c], -1)  # about the CoM
    moves = jnp.stack([ux - w * y, uy + w * x, w * c], -1)
    tiny = jnp.finfo(fx.dtype).tiny ** 0.5
    size = jnp.sqrt(jnp.maximum(jnp.sum(bears**2, -1), tiny))
    speed = jnp.sqrt(jnp.maximum(jnp.sum(moves**2, -1), tiny))
    return bears / size[:, None] - moves / speed[:, None], jnp.log(size) - log_force


def _spread(rows: _Rows, z: Float[Array, "4"]) -> tuple[Float[Array, "2"], Float[Array, "n 2"]]:
    """Standard deviation of the rows about each law, and the root weights that outliers keep."""
    direction, size = _off(rows, z)
    off = jnp.stack([jnp.linalg.norm(direction, axis=1), jnp.abs(size)], 1) * rows.share[:, None]
    used = rows.share > 0
    median = jnp.nanmedian(jnp.where(used[:, None], off, jnp.nan), axis=0)
    number = 3.0 * jnp.sum(used)
    freedom = jnp.sqrt(number / jnp.maximum(number - 4.0, 1.0))
    least = 10 * jnp.finfo(off.dtype).eps
    spread = jnp.maximum(freedom * median / jnp.array(_MEDIANS, off.dtype), least)
    return spread, 1.0 / jnp.sqrt(1.0 + (off / (_OUTLIER * spread)) ** 2)


def _persistence(off: Float[Array, "n r"]) -> Float[Array, ""]:
    """Rows that tell no more than one, from the correlation of neighbours (a process AR(1))."""
    both = jnp.sum(off[1:] * off[:-1])
    correlation = jnp.clip(both / jnp.maximum(jnp.sum(off**2), 1e-30), 0.0, _MOST_CORRELATED)
    return (1 + correlation) / (1 - correlation)


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


def _steady_rows(
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

    `com_guess` (m) is the CoM where the push tells nothing.
    """
    push = signals(record, FeatureSettings(reference="contact"))
    guess = WrenchTwistGuess(com_guess, settings.com_reach, settings.radius, settings.radius_factor)
    fit = com_from_wrench_twist(*_steady_rows(push, settings), guess)
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
