"""CoM, c and f_max from loads and twists of a sliding object: the quasi-static laws in reverse.

In: rows of load and twist in axes fixed to the object. Out: `WrenchTwistFit`. A steadily pushed
object bears the load that its table can just not bear, a point of an ellipsoid (thesis Eq. 3.7),
and moves along the ellipsoid's normal there (Eq. 3.8), both about the CoM, which is sought.
"""

import jax
import jax.numpy as jnp
import lineax as lx
import optimistix as optx
from flax import struct
from jaxtyping import Array, Bool, Float

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
