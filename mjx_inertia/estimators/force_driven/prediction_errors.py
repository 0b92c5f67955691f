"""A filter around the step of a sliding body: how well parameters predict the next measured pose.

In: the samples of one push and its parameters. Out: whitened one-step prediction errors and, from
their derivatives, the normal equations of the parameters (prediction-error method, Ljung 1999,
ch. 7). The measured force is the input; the pose is what is predicted. A prescribed tip would be
wrong: the probe is compliant, and the point of contact swings about the path of the tip.

State of the filter: pose of the tracked frame, twist at the CoM, and three disturbances of the
friction (its size, its direction, its moment), Gauss-Markov processes in the path slid.
"""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.estimators.force_driven.planar_step import friction_matrix, inverse, sliding_twist
from mjx_inertia.estimators.force_driven.settings import UNKNOWNS, ForceDrivenSettings
from mjx_inertia.spatial import AnyArray, planar_rotate

_RATE = 250.0  # Hz, of most records; `force_noise` is stated for it


@struct.dataclass
class PushSamples:
    """One push as the filter takes it (or many, with a leading axis), at a fixed rate."""

    pose: Float[AnyArray, "*n t 3"]  # of the tracked frame, world, m and rad
    force: Float[AnyArray, "*n t 2"]  # on the object, mean over the interval before, world, N
    contact: Float[AnyArray, "*n t 2"]  # point of contact in the middle of it, object frame, m
    tangent: Float[AnyArray, "*n t 2"]  # to the left of the inward normal there, object frame
    twist: Float[AnyArray, "*n 3"]  # at the first sample, m/s and rad/s
    twist_deviation: Float[AnyArray, "*n 3"]  # of that
    used: Float[AnyArray, "*n t"]  # 1 for samples that are predicted, 0 for others
    interval: Float[AnyArray, "*n"]  # between samples, s
    com: Float[AnyArray, "*n 2"]  # centre of the prior, object frame, m
    squared_gyration: Float[AnyArray, "*n"]  # I_zz / m of uniform density, m²
    friction_radius: Float[AnyArray, "*n"]  # c of uniform pressure, m
    log_mass: Float[AnyArray, "*n"]  # centre of the prior, kg
    log_friction_force: Float[AnyArray, "*n"]  # centre of the prior, N
    probe_mass: Float[AnyArray, "*n"]  # of what moves between sensor and object, kg
    # white noise of the point of contact along the face, m, at 250 samples a second
    contact_noise: Float[AnyArray, "*n"]
    deviations: Float[AnyArray, "*n u"]  # of the priors of `UNKNOWNS`; 0: held at the centre


@struct.dataclass
class NormalTerms:
    """Sums over the samples of one push, in units of the priors' standard deviations."""

    information: Float[Array, "*n u u"]  # Jᵀ J of the whitened errors
    score: Float[Array, "*n u"]  # Jᵀ r
    scatter: Float[Array, "*n u u"]  # covariance of the score, with the errors' correlation in time
    misfit: Float[Array, "*n"]  # half the sum of squares, and the log of the predicted deviations


@struct.dataclass
class _Parameters:
    mass: Array  # kg
    inertia: Array  # I_zz about the CoM, kg m²
    com: Array  # m, object frame
    friction_radius: Array  # m
    friction_force: Array  # N
    bias: Array  # N, world axes
    shift: Array  # m


def _parameters(z: Float[Array, " u"], samples: PushSamples) -> _Parameters:
    """Physical values of the unknowns in units of their priors."""
    value = dict(zip(UNKNOWNS, z * samples.deviations, strict=True))
    mass = jnp.exp(samples.log_mass + value["mass"])
    return _Parameters(
        mass=mass,
        inertia=mass * samples.squared_gyration * jnp.exp(value["inertia"]),
        com=jnp.asarray(samples.com) + jnp.stack([value["com_x"], value["com_y"]]),
        friction_radius=jnp.asarray(samples.friction_radius) * jnp.exp(value["friction_radius"]),
        friction_force=jnp.exp(samples.log_friction_force + value["friction_force"]),
        bias=jnp.stack([value["bias_x"], value["bias_y"]]),
        shift=value["shift"],
    )


def _predict(
    state: Float[Array, "9"],
    noise: Float[Array, "3"],
    sample: tuple[Array, Array, Array],
    p: _Parameters,
    samples: PushSamples,
    settings: ForceDrivenSettings,
) -> Float[Array, "9"]:
    """The state one interval later, under the measured force of that interval."""
    measured, contact, tangent = sample
    pose, twist, disturbance = state[:3], state[3:6], state[6:]
    h = jnp.asarray(samples.interval)
    # contact and force about the CoM, in the middle of the interval
    arm = planar_rotate(pose[2] + 0.5 * h * twist[2], contact + p.shift * tangent - p.com)
    touches = jnp.linalg.norm(measured) > settings.least_force
    force = jnp.where(touches, measured + p.bias + noise[:2], 0.0)
    probe = jnp.where(touches, samples.probe_mass, 0.0)
    # the sensor moves the probe too: its mass rides on the point of contact
    jacobian = (
        jnp.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).at[:, 2].set(jnp.stack([-arm[1], arm[0]]))
    )
    mass_matrix = jnp.diag(jnp.stack([p.mass, p.mass, p.inertia]))
    mass_matrix = mass_matrix + probe * jacobian.T @ jacobian
    wrench = jacobian.T @ (force + probe * twist[2] ** 2 * arm)
    moment = disturbance[2] * p.friction_force * p.friction_radius + noise[2]
    wrench = wrench.at[2].add(moment)
    friction = friction_matrix(p.friction_radius, 1.0 + disturbance[0], disturbance[1])
    after = sliding_twist(
        twist,
        wrench,
        mass_matrix,
        p.friction_force,
        p.friction_radius,
        friction,
        h,
        settings.creep,
    )
    # the CoM and the yaw advance by the trapezoidal rule
    yaw = pose[2] + 0.5 * h * (twist[2] + after[2])
    com = pose[:2] + planar_rotate(pose[2], p.com) + 0.5 * h * (twist[:2] + after[:2])
    origin = com - planar_rotate(yaw, p.com)
    kept = jnp.exp(-_slid(after, p.friction_radius, h) / settings.correlation_length)
    return jnp.concatenate([origin, yaw[None], after, kept * disturbance])


def _slid(twist: Array, friction_radius: Array, interval: Array) -> Array:
    """Path slid in an interval, m."""
    square = twist[0] ** 2 + twist[1] ** 2 + (friction_radius * twist[2]) ** 2
    return interval * jnp.sqrt(square + 1e-18)


def _whitened(
    covariance: Float[Array, "3 3"], error: Float[Array, "3"]
) -> tuple[Float[Array, "3"], Float[Array, ""]]:
    """L⁻¹ error with covariance = L Lᵀ, and the log of the determinant of L; entry by entry."""
    s, e = covariance, error
    a = jnp.sqrt(s[0, 0])
    b, d = s[1, 0] / a, s[2, 0] / a
    c = jnp.sqrt(s[1, 1] - b**2)
    f = (s[2, 1] - d * b) / c
    g = jnp.sqrt(s[2, 2] - d**2 - f**2)
    x = e[0] / a
    y = (e[1] - b * x) / c
    return jnp.stack([x, y, (e[2] - d * x - f * y) / g]), jnp.log(a * c * g)


@struct.dataclass
class Predictions:
    """One-step predictions of a push; the axis counts the samples after the first."""

    errors: Float[Array, "*n t 3"]  # of the pose, whitened; 0 where a sample is not used
    log_deviation: Float[Array, "*n t"]  # sum of the logs of the predicted deviations
    pose: Float[Array, "*n t 3"]  # predicted, m and rad
    twist: Float[Array, "*n t 3"]  # at the CoM after the update, m/s and rad/s


def predictions(
    z: Float[Array, " u"], samples: PushSamples, settings: ForceDrivenSettings
) -> Predictions:
    """Predicts each pose from those before it.

    Gains and predicted covariances are held constant under differentiation.
    """
    s = settings
    h = jnp.asarray(samples.interval)
    p = _parameters(z, samples)
    held = jax.lax.stop_gradient(p)
    white = jnp.diag(jnp.array([s.position_noise, s.position_noise, s.yaw_noise]) ** 2)
    fields = jnp.array([s.friction_field, s.lateral_field, s.moment_field]) ** 2
    of_rate = jnp.sqrt(1.0 / (_RATE * h))

    def step(carry: tuple[Array, Array], sample: tuple[Array, ...]) -> tuple[Any, Any]:
        state, covariance = carry
        measured_pose, force, contact, tangent, used = sample
        push = (force, contact, tangent)
        predicted = _predict(state, jnp.zeros(3), push, p, samples, s)
        # covariance of the prediction
        at = jax.lax.stop_gradient(state)
        F, B = jax.jacfwd(_predict, (0, 1))(at, jnp.zeros(3), push, held, samples, s)
        of_force = s.force_noise + s.relative_force_noise * jnp.abs(force)
        of_moment = samples.contact_noise * jnp.linalg.norm(force)
        deviation = jnp.append(of_force, of_moment) * of_rate
        slid = _slid(jax.lax.stop_gradient(predicted)[3:6], held.friction_radius, h)
        renewed = fields * -jnp.expm1(-2.0 * slid / s.correlation_length)
        covariance = F @ covariance @ F.T + (B * deviation**2) @ B.T
        covariance = covariance + jnp.diag(jnp.concatenate([jnp.zeros(6), renewed]))
        # update by the measured pose
        innovation = covariance[:3, :3] + white
        gain = covariance[:, :3] @ inverse(innovation)
        error = measured_pose - predicted[:3]
        keep = jnp.eye(9).at[:, :3].add(-gain)
        covariance = keep @ covariance @ keep.T + gain @ white @ gain.T
        whitened, log = _whitened(innovation, error)
        updated = predicted + gain @ error
        out = Predictions(used * whitened, used * log, predicted[:3], updated[3:6])
        return (updated, covariance), out

    start = jnp.concatenate(
        [jnp.asarray(samples.pose)[0], jnp.asarray(samples.twist), jnp.zeros(3)]
    )
    still = jnp.asarray(samples.twist_deviation) ** 2
    covariance = jnp.diag(jnp.concatenate([jnp.diagonal(white), still, fields]))
    series = (samples.pose, samples.force, samples.contact, samples.tangent, samples.used)
    following = jax.tree.map(lambda x: jnp.asarray(x)[1:], series)
    return jax.lax.scan(step, (start, covariance), following)[1]


@partial(jax.jit, static_argnames="settings")
def normal_terms(
    z: Float[Array, "n u"], samples: PushSamples, settings: ForceDrivenSettings
) -> NormalTerms:
    """Normal equations of many pushes about their parameters `z`, in units of the priors."""
    window = max(1, round(settings.memory * _RATE))

    def one(z: Float[Array, " u"], samples: PushSamples) -> NormalTerms:
        def twice(z: Array) -> tuple[Array, tuple[Array, Array]]:
            found = predictions(z, samples, settings)
            return found.errors, (found.errors, found.log_deviation)

        jacobian, (errors, log) = jax.jacfwd(twice, has_aux=True)(z)
        scores = jnp.einsum("tdu,td->tu", jacobian, errors)
        # sums over a window: their second moment is the tapered sum of the autocovariances
        total = jnp.cumsum(jnp.pad(scores, ((window, window), (0, 0))), axis=0)
        sums = total[window:] - total[:-window]
        return NormalTerms(
            information=jnp.einsum("tdu,tdw->uw", jacobian, jacobian),
            score=scores.sum(0),
            scatter=sums.T @ sums / window,
            misfit=0.5 * jnp.sum(errors**2) + jnp.sum(log),
        )

    return jax.vmap(one)(z, samples)


@partial(jax.jit, static_argnames="settings")
def predicted_pushes(
    z: Float[Array, "n u"], samples: PushSamples, settings: ForceDrivenSettings
) -> Predictions:
    """`predictions` of many pushes."""
    return jax.vmap(lambda z, samples: predictions(z, samples, settings))(z, samples)
