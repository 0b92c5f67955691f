"""Inertial parameters of a body from recordings of real pushes.

In: `MeasuredPush`es of one body, the instrument. Out: `RecordedBody`, from all pushes together and
from each alone, by identification driven by the measured force and by Newton's law. The instrument
is learnt from objects of known mass by `calibrate_instrument`.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from mjx_inertia.dataset.recording import MeasuredPush
from mjx_inertia.estimators import EstimateStatus, NewtonSettings, predict_newton
from mjx_inertia.estimators.force_driven import (
    MCUBE_INSTRUMENT,
    BodyEstimate,
    BodyPrior,
    ForceDrivenSettings,
    Instrument,
    NextPush,
    calibrated,
    estimate_bodies,
    most_informative_push,
    probe_line,
    usable_samples,
    with_deviations,
)
from mjx_inertia.estimators.newton import FittedNewton
from mjx_inertia.pushing import PushRecord, PushStatus

_DEFAULT = ForceDrivenSettings()
_UNKNOWN_COM = 0.1  # of the mean diameter: deviation of a CoM that is not stated, each axis
_PROBE_UNCERTAINTY = 0.15  # of a stated probe mass
# relative deviation (of the CoM: share of its prior's) above which a parameter is not determined
_DETERMINED = np.array([0.5, 0.3, 0.5, 0.5])
_DISAGREE = 2.0  # deviations
_NAMES = (("Mass", "kg", 1.0), ("I_zz", "g m²", 1e3), ("CoM x", "mm", 1e3), ("CoM y", "mm", 1e3))
# Words for the user; the names of `PushStatus` are for programs.
_REASONS = {
    PushStatus.LOST_CONTACT: "the tip left the object before it slowed down",
    PushStatus.NEVER_MOVED: "the object moved less than 3 mm",
    PushStatus.DIVERGED: "a signal is not finite or beyond any table",
    PushStatus.FROZEN_FORCE: "the force signal repeats one value",
    PushStatus.TRACKING_JUMP: "the tracked pose jumps, or lies where the tip is",
    PushStatus.CLOCK_JUMP: "the stamps of a stream leap or repeat",
    PushStatus.FORCE_PULLS: "the force points from the object to the tip, which cannot pull",
    PushStatus.FORCE_LATE: "the force begins long after the object moves",
}


@dataclass(frozen=True, eq=False)
class RecordedBody:
    """Mass (kg), I_zz about the CoM (kg m²) and CoM x, y (m) of a body, as its pushes tell them.

    The CoM counts from the contact point of the first push that was used: x along the inward
    contact normal, y to its left.
    """

    mean: Float[ndarray, "4"]  # NaN where the status is not `OK`
    covariance: Float[ndarray, "4 4"]  # infinite variances where the status is not `OK`
    status: EstimateStatus
    determined: Bool[ndarray, "4"]  # whether the pushes tell each well enough to be reported
    pushes: tuple[MeasuredPush, ...]
    push_status: tuple[PushStatus, ...]  # of each
    # each push alone, as (mean, covariance) in the frame of its own first contact; None: not used
    alone: tuple[tuple[ndarray, ndarray] | None, ...]
    newton: tuple[tuple[float, float], ...]  # mass of each push by Newton's law and its sd, kg
    instrument: Instrument
    settings: ForceDrivenSettings
    fit: BodyEstimate | None = None  # of all pushes; None where no push was used

    def interval(self, level: float = 0.95) -> Float[ndarray, "4 2"]:
        """Lower and upper end of the interval of each parameter at a probability."""
        half = NormalDist().inv_cdf(0.5 + 0.5 * level) * np.sqrt(np.diagonal(self.covariance))
        return np.stack([self.mean - half, self.mean + half], 1)

    def explain(self) -> str:
        """What was determined, with 95 % intervals, what was not, and why; a sentence a line."""
        lines = [
            f"{Path(push.file).name} was not used: {_REASONS.get(status, 'it is too short')}."
            for push, status, alone in zip(self.pushes, self.push_status, self.alone, strict=True)
            if alone is None
        ]
        if self.status != EstimateStatus.OK:
            return "\n".join([*lines, _FAILED[self.status]])
        half = self.interval()[:, 1] - self.mean
        com_known = self.pushes[0].com is not None
        for i, (name, unit, scale) in enumerate(_NAMES):
            value, error = scale * self.mean[i], scale * half[i]
            if i >= 2 and com_known:
                lines.append(f"{name}: {value:.1f} {unit} (given).")
            elif self.determined[i]:
                digits = max(0, 1 - int(np.floor(np.log10(max(error, 1e-12)))))
                lines.append(f"{name}: {value:.{digits}f} ± {error:.{digits}f} {unit} (95 %).")
            else:
                lines.append(f"{name}: not determined. {_WHY[min(i, 2)]}")
        lines += self._doubts()
        return "\n".join(lines)

    def _doubts(self) -> list[str]:
        """What a reader should know beside the intervals."""
        lines = []
        if self.instrument.probe_mass_sd == 0.0:
            lines.append(
                f"The probe between sensor and object is taken to weigh "
                f"{self.instrument.probe_mass:.3g} kg exactly ({self.instrument.note}); "
                "what it weighs more is counted as mass of the object."
            )
        mass, sd = self.mean[0], np.sqrt(self.covariance[0, 0])
        found = [(m, s) for m, s in self.newton if np.isfinite(s)]
        if found:
            weight = np.array([1.0 / s**2 for _, s in found])
            other = float(weight @ [m for m, _ in found] / weight.sum())
            other_sd = float(weight.sum() ** -0.5)
            verdict = "agrees"
            if abs(other - mass) > _DISAGREE * np.hypot(sd, other_sd):
                verdict = (
                    "DISAGREES. It sees the motion through a filter of 60 ms, so it loses the mass "
                    "in a start that takes less; otherwise trust neither before you know why"
                )
            lines.append(
                f"Newton's law on the same pushes: {other:.3g} ± {2 * other_sd:.2g} kg; {verdict}."
            )
        return lines

    def next_push(self) -> NextPush:
        """The push along a normal of the outline that is expected to tell most.

        Raises:
          ValueError: there is no estimate to plan with.
        """
        if self.fit is None:
            raise ValueError("next_push: no push was used, so there is nothing to plan with")
        with jax.enable_x64(True):
            obj = self.pushes[0].obj
            return most_informative_push(self.fit, obj, self.settings, self.instrument.spread)

    def report(self, path: str | Path) -> None:
        """Writes a self-contained HTML page: signals, residuals, parameters, the next push.

        Raises:
          OSError: the file cannot be written.
        """
        from mjx_inertia.recorded.report import write_recorded_report  # noqa: PLC0415  (a circle)

        write_recorded_report(Path(path), self)


_FAILED = {
    EstimateStatus.BAD_INPUT: "No push can be used, so no parameter is reported.",
    EstimateStatus.NOT_CONVERGED: "The search did not converge, so no parameter is reported.",
}
_WHY = (
    "Push faster (50 mm/s and more, from rest), near the normal, and long enough to slide.",
    "Push off the middle, so that the object turns.",
    "Push several faces of the object and give all files together.",
)


def identify_recorded(
    pushes: Sequence[MeasuredPush],
    *,
    instrument: Instrument | None = None,
    settings: ForceDrivenSettings = _DEFAULT,
) -> RecordedBody:
    """The body that predicts the measured motion under the measured force.

    Args:
      pushes: of one body, with one outline.
      instrument: what the sensor adds. If None: the probe mass of the description; that of the
        M-dataset's robot for its files; else none.
      settings: noise, disturbances and priors.

    Raises:
      ValueError: no push, or pushes of objects with different outlines.
    """
    if not pushes:
        raise ValueError("push: an empty sequence; give at least one push")
    outline = pushes[0].obj.outline
    for push in pushes:
        other = push.obj.outline
        if other.shape != outline.shape or not np.allclose(other, outline):
            raise ValueError(f"{push.file}: another outline than {pushes[0].file}; one body a call")
    instrument = _instrument(pushes[0]) if instrument is None else instrument
    status = tuple(PushStatus(int(push.record.status)) for push in pushes)
    with jax.enable_x64(True):
        samples, rows = usable_samples(*_known(pushes), settings)
        newton = _newton(pushes, instrument)
        base = RecordedBody(
            mean=np.full(4, np.nan),
            covariance=np.diag(np.full(4, np.inf)),
            status=EstimateStatus.BAD_INPUT,
            determined=np.zeros(4, bool),
            pushes=tuple(pushes),
            push_status=status,
            alone=(None,) * len(pushes),
            newton=newton,
            instrument=instrument,
            settings=settings,
        )
        if samples is None:
            return base
        if pushes[0].com is None:
            spread = _UNKNOWN_COM * pushes[0].obj.mean_diameter
            samples = with_deviations(samples, com_x=spread, com_y=spread)
        singles = estimate_bodies(samples, np.arange(len(rows)), instrument, settings)
        fit = singles[0]
        if len(rows) > 1:
            (fit,) = estimate_bodies(samples, np.zeros(len(rows), int), instrument, settings)
    alone: list[tuple[ndarray, ndarray] | None] = [None] * len(pushes)
    for row, single in zip(rows, singles, strict=True):
        alone[row] = _from_contact(single, pushes[row])
    mean, covariance = _from_contact(fit, pushes[rows[0]])
    prior = np.append([0.5, 0.5], np.asarray(samples.deviations)[0, 2:4])
    return dataclasses.replace(
        base,
        mean=mean,
        covariance=covariance,
        status=fit.status,
        determined=_told(mean, covariance, prior),
        alone=tuple(alone),
        fit=fit,
    )


def calibrate_instrument(
    pushes: Sequence[MeasuredPush],
    masses: Sequence[float],
    *,
    settings: ForceDrivenSettings = _DEFAULT,
) -> Instrument:
    """The instrument's constants from pushes of objects of known mass (kg, one each push).

    The CoM of an object that is not stated is taken to be the centroid of its outline.

    Raises:
      ValueError: masses that are none, or fewer than two usable pushes.
    """
    if len(masses) != len(pushes) or not all(0 < m < np.inf for m in masses):
        raise ValueError(f"masses: expected {len(pushes)} in kg above 0, found {list(masses)}")
    with jax.enable_x64(True):
        samples, rows = usable_samples(*_known(pushes), settings)
        if samples is None:
            raise ValueError("calibrate_instrument: no push can be used")
        line = probe_line(samples, settings)
    objects = [(p.obj.name, float(m)) for p, m in zip(pushes, masses, strict=True)]
    names = sorted(set(objects))
    number = np.array([names.index(objects[row]) for row in rows])
    return calibrated(line, np.asarray(masses, float)[rows], number)


def told(mean: Float[ndarray, "4"], covariance: Float[ndarray, "4 4"]) -> Bool[ndarray, "4"]:
    """Which parameters of one push alone can be reported; the CoM where it is known to 10 mm."""
    return _told(mean, covariance, np.array([0.5, 0.5, 0.02, 0.02]))


def _told(mean: ndarray, covariance: ndarray, prior: ndarray) -> Bool[ndarray, "4"]:
    deviation = np.sqrt(np.diagonal(covariance))
    scale = np.array([mean[0], mean[1], *prior[2:]])
    return np.isfinite(mean) & (deviation <= _DETERMINED * np.abs(scale))


def _known(pushes: Sequence[MeasuredPush]) -> tuple[list[PushRecord], list[BodyPrior]]:
    return [p.record for p in pushes], [BodyPrior.of(p.obj, p.com) for p in pushes]


def _instrument(push: MeasuredPush) -> Instrument:
    if push.probe_mass is not None:
        deviation = _PROBE_UNCERTAINTY * push.probe_mass
        return Instrument(push.probe_mass, deviation, note="probe mass of the description")
    return MCUBE_INSTRUMENT if push.is_mcube else Instrument()


def _from_contact(fit: BodyEstimate, push: MeasuredPush) -> tuple[ndarray, ndarray]:
    """Mean and covariance with the CoM in the frame of the push's first contact."""
    record = push.record
    pose = np.asarray(record.pose, float)[0]
    normal = np.asarray(record.contact_normal, float)
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    R_world_obj = np.array([[cos, -sin], [sin, cos]])
    R_contact_world = np.array([normal, [-normal[1], normal[0]]])
    point = np.asarray(record.contact_point, float)
    turn = np.eye(4)
    turn[2:, 2:] = R_contact_world @ R_world_obj
    com = R_contact_world @ (R_world_obj @ fit.mean[2:] + pose[:2] - point)
    if not np.isfinite(fit.mean).all():
        return fit.mean, fit.covariance
    return np.array([*fit.mean[:2], *com]), turn @ fit.covariance @ turn.T


def _newton(
    pushes: Sequence[MeasuredPush], instrument: Instrument
) -> tuple[tuple[float, float], ...]:
    """Mass of each push by Newton's law, and its deviation; infinite where it cannot tell."""
    settings = NewtonSettings()
    fitted = FittedNewton(
        probe_mass=jnp.asarray(instrument.probe_mass),
        spread=jnp.asarray(instrument.spread),
        mean=jnp.full(4, jnp.nan),
    )
    answers = []
    for push in pushes:
        record = push.record_at(settings.balance.rate)
        prior = BodyPrior.of(push.obj, push.com)
        batch = jax.tree.map(lambda x: jnp.asarray(x)[None], record)
        radius = np.array([prior.friction_radius])
        found = predict_newton(fitted, batch, prior.com[None], radius, settings)
        mass, variance = float(found.mean[0, 0]), float(found.covariance[0, 0, 0])
        usable = np.isfinite(mass) and mass > 0.0
        answers.append((mass, float(np.sqrt(variance))) if usable else (np.nan, np.inf))
    return tuple(answers)


@dataclass(frozen=True)
class PushRow:
    """What one push alone tells; None where it cannot tell."""

    file: str
    mass_kg: float | None
    mass_sd_kg: float | None
    inertia_zz_kgm2: float | None
    inertia_zz_sd_kgm2: float | None
    com_m: tuple[float, float] | None  # from the first contact point
    com_sd_m: tuple[float, float] | None
    newton_mass_kg: float | None
    newton_mass_sd_kg: float | None
    status: str


def push_rows(found: RecordedBody) -> list[PushRow]:
    """The pushes one by one."""
    rows = []
    for push, status, alone, newton in zip(
        found.pushes, found.push_status, found.alone, found.newton, strict=True
    ):
        mean, covariance = alone if alone else (np.full(4, np.nan), np.diag(np.full(4, np.inf)))
        sd = np.sqrt(np.diagonal(covariance))
        shown = told(mean, covariance)
        com = bool(shown[2] and shown[3])
        word = status.name
        if status == PushStatus.OK and not np.isfinite(mean[0]):
            word = "NOT_CONVERGED" if alone else "TOO_SHORT"
        elif status == PushStatus.OK and not shown[0]:
            word = "NOT_IDENTIFIABLE"
        known = bool(np.isfinite(newton[1]))
        rows.append(
            PushRow(
                file=push.file,
                mass_kg=float(mean[0]) if shown[0] else None,
                mass_sd_kg=float(sd[0]) if shown[0] else None,
                inertia_zz_kgm2=float(mean[1]) if shown[1] else None,
                inertia_zz_sd_kgm2=float(sd[1]) if shown[1] else None,
                com_m=(float(mean[2]), float(mean[3])) if com else None,
                com_sd_m=(float(sd[2]), float(sd[3])) if com else None,
                newton_mass_kg=newton[0] if known else None,
                newton_mass_sd_kg=newton[1] if known else None,
                status=word,
            )
        )
    return rows
