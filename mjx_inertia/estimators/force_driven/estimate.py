"""Mass, I_zz and CoM of bodies from measured pushes, each fit beside its checks.

In: records, what is known of their objects, the instrument. Out: `BodyEstimate` of each body,
single or joint. Three fits are made of each body: the mass with I_zz at that of the outline; the
mass again with a heavier probe, which tells how far the probe's mass matters; and I_zz with the
mass free, because a free I_zz spoils the mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from mjx_inertia.estimators.estimate import EstimateStatus
from mjx_inertia.estimators.force_driven.fit import ForceDrivenFit, fit_bodies
from mjx_inertia.estimators.force_driven.instrument import Instrument, ProbeLine
from mjx_inertia.estimators.force_driven.prediction_errors import PushSamples
from mjx_inertia.estimators.force_driven.samples import BodyPrior, push_samples, stack_samples
from mjx_inertia.estimators.force_driven.settings import SHARED, UNKNOWNS, ForceDrivenSettings
from mjx_inertia.pushing import PushRecord

_PROBE_STEP = 0.05  # kg, between the two fits
_FREE_INERTIA = 0.5  # deviation of log I_zz about uniform density where it is estimated
# white noise of the point of contact in that fit, m: the moment about the CoM is the least certain
# of the loads, and the mass does not need it
_CONTACT_NOISE = 7e-3
# Factors of the deviations of mass and CoM where the CoM is free. Its errors come from the moment
# of the friction, which a whole push shares: without them errors of 35 real pushes had an rms of
# 1.5 and 2.1 deviations.
_FREE_COM = {"mass": 1.5, "com_x": 2.0, "com_y": 2.0}
# Relative error of the mass that the pushes of one object share (one place, one probe), beside
# that of each: it does not fall with their number.
_SHARED_ERROR = 0.03
_MASS = UNKNOWNS.index("mass")
_INERTIA = UNKNOWNS.index("inertia")
_COM = [UNKNOWNS.index("com_x"), UNKNOWNS.index("com_y")]


@dataclass(frozen=True)
class BodyEstimate:
    """(mass kg, I_zz kg m², CoM x, y m in the object frame) of one body."""

    mean: Float[ndarray, "4"]  # NaN where the status is not `OK`
    covariance: Float[ndarray, "4 4"]
    status: EstimateStatus
    friction_force: Float[ndarray, " n"]  # of each push, N
    friction_radius: float  # c of the limit surface, m
    information: Float[ndarray, "s s"]  # of the shared unknowns in units of their priors
    z: Float[ndarray, "n u"]  # all unknowns of each push in units of their priors
    samples: PushSamples  # of its pushes, as they were fitted


def with_deviations(samples: PushSamples, **deviations: float) -> PushSamples:
    """The pushes with other priors of some unknowns; names are those of `UNKNOWNS`."""
    changed = np.array(samples.deviations)
    for name, value in deviations.items():
        changed[..., UNKNOWNS.index(name)] = value
    return samples.replace(deviations=changed)


def estimate_bodies(
    samples: PushSamples,
    body: Int[ndarray, " n"],
    instrument: Instrument,
    settings: ForceDrivenSettings,
) -> list[BodyEstimate]:
    """Estimates of each body from all of its pushes together.

    A joint fit starts at the average of the fits of single pushes, weighted by what each tells.
    """
    bodies = int(body.max()) + 1
    # pushes of one body share the centre of the mass's prior
    count = np.bincount(body, minlength=bodies)
    centre = np.bincount(body, samples.log_mass, bodies) / count
    at = samples.replace(
        probe_mass=np.full(len(body), instrument.probe_mass), log_mass=centre[body]
    )
    start = _from_singles(at, body, settings) if len(body) > bodies else None
    main = fit_bodies(at, body, settings, start)
    # derivative of the estimates by the probe mass
    heavier = at.replace(probe_mass=at.probe_mass + _PROBE_STEP)
    here = _z(main, body)
    moved = fit_bodies(heavier, body, settings, here) if instrument.probe_mass_sd else main
    by_probe = (moved.mean - main.mean) * (instrument.probe_mass_sd / _PROBE_STEP)
    turning = with_deviations(at, inertia=_FREE_INERTIA)
    turning = turning.replace(contact_noise=np.full(len(body), _CONTACT_NOISE))
    freed = fit_bodies(turning, body, settings, here)
    return [
        _estimate(b, np.flatnonzero(body == b), at, main, freed, by_probe[b], instrument.spread)
        for b in range(bodies)
    ]


def probe_line(samples: PushSamples, settings: ForceDrivenSettings) -> ProbeLine:
    """The mass that each push tells, as a line through its values at two probe masses."""
    alone = np.arange(len(samples.probe_mass))
    low, high = 0.1, 0.3  # kg, about what robots carry between a wrist sensor and an object
    fits = []
    for probe in (low, high):
        at = samples.replace(probe_mass=np.full(len(alone), probe))
        fits.append(fit_bodies(at, alone, settings))
    deviation = np.asarray(samples.deviations)[:, _MASS]
    masses = [np.exp(samples.log_mass + deviation * fit.mean[:, _MASS]) for fit in fits]
    slope = (masses[0] - masses[1]) / (high - low)
    variance = 0.5 * sum(_covariance(fit)[:, _MASS, _MASS] for fit in fits)
    return ProbeLine(masses[0] + low * slope, slope, deviation * np.sqrt(variance))


def usable_samples(
    records: Sequence[PushRecord],
    priors: Sequence[BodyPrior],
    settings: ForceDrivenSettings,
) -> tuple[PushSamples | None, Int[ndarray, " m"]]:
    """The pushes that can be fitted, and their numbers; None where there are none."""
    found = [push_samples(r, p, settings) for r, p in zip(records, priors, strict=True)]
    rows = np.array([i for i, x in enumerate(found) if x is not None], int)
    used = [x for x in found if x is not None]
    return (stack_samples(used) if used else None), rows


def _from_singles(
    samples: PushSamples, body: Int[ndarray, " n"], settings: ForceDrivenSettings
) -> Float[ndarray, "n u"]:
    """Start of a joint fit: single fits, averaged with their information."""
    alone = fit_bodies(samples, np.arange(len(body)), settings)
    z = _z(alone, np.arange(len(body)))
    free = np.asarray(samples.deviations)[:, :SHARED] > 0
    for b in range(int(body.max()) + 1):
        rows = np.flatnonzero(body == b)
        inside = np.flatnonzero(free[rows[0]])
        total, right = np.zeros((len(inside), len(inside))), np.zeros(len(inside))
        for row in rows:
            information = np.linalg.inv(alone.white_covariance[row][np.ix_(inside, inside)])
            total += information
            right += information @ z[row, inside]
        z[np.ix_(rows, inside)] = np.linalg.solve(total, right)
    return z


def _z(fit: ForceDrivenFit, body: Int[ndarray, " n"]) -> Float[ndarray, "n u"]:
    return np.concatenate([fit.mean[body], fit.own], 1)


def _covariance(fit: ForceDrivenFit) -> Float[ndarray, "b s s"]:
    """That of white errors, widened where the residuals scatter more than it says."""
    white = np.diagonal(fit.white_covariance, axis1=1, axis2=2)
    found = np.diagonal(fit.covariance, axis1=1, axis2=2)
    wider = np.sqrt(np.maximum(1.0, found / np.where(white > 0, white, 1.0)))
    return fit.white_covariance * wider[:, :, None] * wider[:, None, :]


def _estimate(
    b: int,
    rows: Int[ndarray, " k"],
    samples: PushSamples,
    main: ForceDrivenFit,
    freed: ForceDrivenFit,
    by_probe: Float[ndarray, " s"],
    spread: float,
) -> BodyEstimate:
    """Physical values of one body and their covariance (first order)."""
    one = jax.tree.map(lambda x: np.asarray(x)[rows[0]], samples)
    deviation = one.deviations[:SHARED]
    mass = float(np.exp(one.log_mass + deviation[_MASS] * main.mean[b, _MASS]))
    heavy = float(np.exp(one.log_mass + deviation[_MASS] * freed.mean[b, _MASS]))
    ratio = np.exp(_FREE_INERTIA * freed.mean[b, _INERTIA])
    inertia = float(heavy * one.squared_gyration * ratio)
    com = one.com + deviation[_COM] * main.mean[b, _COM]
    # mass and CoM from the main fit, log I_zz = log mass + log ratio from the other
    scaled = _covariance(main)[b] * np.outer(deviation, deviation) * spread**2
    if deviation[_COM].any():
        factor = np.array([_FREE_COM.get(name, 1.0) for name in UNKNOWNS[:SHARED]])
        scaled = scaled * np.outer(factor, factor)
    scaled += np.outer(by_probe * deviation, by_probe * deviation)
    if len(rows) > 1:
        scaled[_MASS, _MASS] += _SHARED_ERROR**2
    wide = np.where(np.arange(SHARED) == _INERTIA, _FREE_INERTIA, deviation)
    other = _covariance(freed)[b] * np.outer(wide, wide) * spread**2
    log_inertia = np.zeros(SHARED)
    log_inertia[[_MASS, _INERTIA]] = 1.0
    covariance = np.zeros((4, 4))
    places = [_MASS, *_COM]
    covariance[np.ix_([0, 2, 3], [0, 2, 3])] = scaled[np.ix_(places, places)]
    covariance[1, 1] = log_inertia @ other @ log_inertia
    scale = np.array([mass, inertia, 1.0, 1.0])
    ok = bool(main.converged[b]) and np.isfinite(scale).all()
    status = EstimateStatus.OK if ok else EstimateStatus.NOT_CONVERGED
    own = main.own[rows]
    force = UNKNOWNS.index("friction_force")
    forces = samples.log_friction_force[rows] + (
        np.asarray(samples.deviations)[rows, force] * own[:, force - SHARED]
    )
    radius = UNKNOWNS.index("friction_radius")
    radius_ratio = np.exp(deviation[radius] * main.mean[b, radius])
    return BodyEstimate(
        mean=np.array([mass, inertia, *com]) if ok else np.full(4, np.nan),
        covariance=covariance * np.outer(scale, scale) if ok else np.diag(np.full(4, np.inf)),
        status=status,
        friction_force=np.exp(forces),
        friction_radius=float(one.friction_radius * radius_ratio),
        information=np.linalg.pinv(_covariance(main)[b] * spread**2),
        z=np.concatenate([np.tile(main.mean[b], (len(rows), 1)), own], 1),
        samples=jax.tree.map(lambda x: np.asarray(x)[rows], samples),
    )
