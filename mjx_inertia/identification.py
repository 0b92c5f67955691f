"""Inertial parameters of a body from its pushes, in one call.

In: a `Push`, or several of one body. Out: `IdentifiedBody`. Identification runs through the
simulator (`estimators/sysid`), in double precision whatever JAX is set to.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist
from typing import Any, overload

import jax
import numpy as np
from jaxtyping import Bool, Float
from matplotlib.figure import Figure

from mjx_inertia.dataset import SensorNoise
from mjx_inertia.dataset.push import Push, shared_scene
from mjx_inertia.dataset.recording import MeasuredPush
from mjx_inertia.estimators import TARGETS, EstimateStatus
from mjx_inertia.estimators.force_driven import (
    ForceDrivenSettings,
    Instrument,
    NextPush,
    load_instrument,
)
from mjx_inertia.estimators.sysid import (
    Fit,
    SysidProblem,
    SysidSettings,
    explain_identifiability,
    fit,
    observed,
    planar_estimates,
)
from mjx_inertia.estimators.sysid.next_push import (
    PusherLimits,
    candidates,
    choose,
    expected_information,
    target_slopes,
)
from mjx_inertia.evaluation import draw_fit, fit_signals
from mjx_inertia.pushing import PushRecord, PushSetup, PushStatus, with_few_lengths, with_samples
from mjx_inertia.recorded import RecordedBody, identify_recorded
from mjx_inertia.recorded.report import write_page
from mjx_inertia.spatial import AnyArray

_DEFAULT = SysidSettings(progress=False)
_LIMITS = PusherLimits()
_ORIGIN = np.zeros(2)  # where the centroid of the outline lies in the tracked frame of a `Push`
_DETERMINED = 0.5  # share of the prior variance below which the pushes determine a parameter
# Name, unit and its factor, in the order of `TARGETS`.
_SHOWN = (("Mass", "kg", 1.0), ("I_zz", "g m²", 1e3), ("CoM x", "mm", 1e3), ("CoM y", "mm", 1e3))
_FAILURES = {
    EstimateStatus.BAD_INPUT: "No push can be used.",
    EstimateStatus.NOT_IDENTIFIABLE: "The mass is not determined, so no parameter is reported.",
    EstimateStatus.AT_BOUND: "A parameter of the body ended at a bound of its prior.",
    EstimateStatus.NOT_CONVERGED: "No parameters explain the signals to within their noise.",
    EstimateStatus.DIVERGED: "The simulation diverged wherever the search went.",
}


@dataclass(frozen=True)
class IdentifiedBody:
    """Mass (kg), I_zz about the CoM (kg m²) and CoM x, y (m) of a body, as its pushes tell them.

    The CoM counts from the contact point of the first push that was used: x along the inward
    contact normal, y to its left.
    """

    mean: Float[np.ndarray, "4"]  # the estimate; NaN where the status is not `OK`
    # of the mean, the priors included; infinite variances where the status is not `OK`
    covariance: Float[np.ndarray, "4 4"]
    status: EstimateStatus
    # whether the pushes take away at least half of the prior variance; without that the mean is
    # mostly the prior's
    determined: Bool[np.ndarray, "4"]
    push_status: tuple[PushStatus, ...]  # of each push
    record: PushRecord  # of all pushes, with a leading axis
    setup: PushSetup  # of all pushes
    settings: SysidSettings  # of the identification
    fit: Fit | None = None  # of all unknowns, friction among them; None where no push was used

    def interval(self, level: float = 0.95) -> Float[np.ndarray, "4 2"]:
        """Lower and upper end of the interval of each parameter at a probability."""
        half = NormalDist().inv_cdf(0.5 + 0.5 * level) * np.sqrt(np.diagonal(self.covariance))
        return np.stack([self.mean - half, self.mean + half], 1)

    def explain(self) -> str:
        """What was determined, with 95 % intervals, what was not, and why; a sentence a line."""
        lines = [
            f"Push {number} was not used: {status.name}."
            for number, status in enumerate(self.push_status, 1)
            if status != PushStatus.OK
        ]
        if self.status == EstimateStatus.OK:
            error = self.interval()[:, 1] - self.mean
            for i, (name, unit, scale) in enumerate(_SHOWN):
                if self.determined[i]:
                    found = _rounded(scale * self.mean[i], scale * error[i])
                    lines.append(f"{name}: {found} {unit} (95 %).")
                else:
                    lines.append(f"{name}: not determined.")
        else:
            lines.append(_FAILURES[self.status])
        if self.fit is not None:
            known = jax.tree.map(lambda x: x[0], self.fit.known)
            used = sum(status == PushStatus.OK for status in self.push_status)
            if why := explain_identifiability(known, self.settings.estimated, pushes=used):
                lines.append(f"{why[0].upper()}{why[1:]}.")
        return "\n".join(lines)

    def draw(self, push: int = 0) -> Figure:
        """Measured and simulated signals of a push, all unknowns with intervals, the search.

        Raises:
          ValueError: there is no such push, or it was not used.
        """
        if not 0 <= push < len(self.push_status):
            raise ValueError(f"push={push}: there are {len(self.push_status)}, counted from 0")
        if self.fit is None or self.push_status[push] != PushStatus.OK:
            raise ValueError(f"push={push} was not used, so there is no fit of it to draw")
        record, setup = _rows((self.record, self.setup), push)
        with jax.enable_x64(True):
            scene, s = shared_scene(self.settings.scene), self.settings
            signals = fit_signals(scene, record, setup, self.fit, 0, _ORIGIN, s)
        return draw_fit(signals, self.fit, 0, self.settings)

    def report(self, path: str | Path) -> None:
        """Writes a self-contained HTML page: parameters, signals and their fit.

        Raises:
          OSError: the file cannot be written.
        """
        used = [i for i, s in enumerate(self.push_status) if s == PushStatus.OK]
        pictures = [(f"Push {i + 1}", self.draw(i)) for i in used if self.fit is not None]
        lines = self.explain().split("\n")
        write_page(Path(path), "Body", lines, pictures, notes=(self.settings,))

    def next_push(self, limits: PusherLimits = _LIMITS) -> NextPush:
        """The push of a box that is expected to tell most, among normals of its faces.

        Its point counts from the centroid of the outline.

        Raises:
          ValueError: there is no estimate to plan with, or the object is no box.
        """
        if self.fit is None or self.status != EstimateStatus.OK:
            raise ValueError("next_push: there is no estimate to plan with")
        if self.setup.polygons is not None:
            raise ValueError("next_push: candidates are known for boxes alone")
        settings, names = self.settings, self.settings.estimated
        half, radius = self.setup.half_extents[0], float(self.setup.friction_radius[0])
        pushes = candidates(limits, half, radius, offsets=5, angles=1, speeds=1)
        with jax.enable_x64(True):
            z = np.tile(self.fit.search.z[0], (len(pushes), 1))
            scene = shared_scene(settings.scene)
            samples = math.ceil(float(pushes.setup.motion.duration.max()) * scene.settings.rate) + 1
            gained = expected_information(scene, z, pushes, _ORIGIN, settings, samples=samples)
        known = np.linalg.inv(np.asarray(self.fit.known.covariance)[0])
        best, _ = choose(known, gained, target_slopes(settings))
        after = np.linalg.inv(known + gained[best])
        mass = names.index("mass") if "mass" in names else 0
        return NextPush(
            contact_point=np.asarray(pushes.contact_point)[best],
            direction=np.asarray(pushes.setup.motion.direction)[best],
            speed=float(pushes.setup.motion.speed[best]),
            mass_sd=float(np.sqrt(after[mass, mass])) * settings.beliefs.mass.spread,
        )


def _rounded(value: float, error: float) -> str:
    """Both with as many decimals as give two digits of the error."""
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


@overload
def identify(
    push: Push | Sequence[Push],
    *,
    noise: SensorNoise | None = None,
    settings: SysidSettings = _DEFAULT,
    seed: int = 0,
) -> IdentifiedBody: ...


@overload
def identify(
    push: MeasuredPush | Sequence[MeasuredPush],
    *,
    instrument: Instrument | str | Path | None = None,
    settings: ForceDrivenSettings | None = None,
) -> RecordedBody: ...


def identify(push: Any, **options: Any) -> IdentifiedBody | RecordedBody:
    """Inertial parameters of one body from its pushes, simulated or real.

    A `Push` of `simulate_push` goes to `identify_simulated`, which drives the simulation by the
    path of the tip; a `MeasuredPush` of `read_push` goes to `identify_recorded`, which drives it by
    the measured force, because a real tip is compliant. Options are those of the function.

    Raises:
      ValueError: no push, both kinds at once, or what the function refuses.
    """
    pushes = list(push) if isinstance(push, Sequence) else [push]
    if pushes and all(isinstance(p, MeasuredPush) for p in pushes):
        instrument = options.pop("instrument", None)
        if isinstance(instrument, str | Path):
            instrument = load_instrument(instrument)
        return identify_recorded(pushes, instrument=instrument, **options)
    if any(isinstance(p, MeasuredPush) for p in pushes):
        raise ValueError("push: recorded and simulated pushes together; give one kind a call")
    return identify_simulated(pushes, **options)


def identify_simulated(
    push: Push | Sequence[Push],
    *,
    noise: SensorNoise | None = None,
    settings: SysidSettings = _DEFAULT,
    seed: int = 0,
) -> IdentifiedBody:
    """Finds the body, the friction and the contact whose simulation gives the measured signals.

    Several pushes of one body share all unknowns: their information adds up. The search starts at
    the priors of `settings`; `settings.start_features` has no effect. The first call compiles the
    simulation with its derivatives (tens of seconds); a call with as many unknowns, on an object
    of the same kind, takes about a second.

    Args:
      push: one push, or several of one body. Pushes whose status is not `OK` are left out.
      noise: of the sensors; that of `settings` if None (5 % and the floors of `SensorNoise`).
      settings: of the identification: unknowns, priors, table, signals that are fitted.
      seed: of the further starts of the search.

    Raises:
      ValueError: no push, pushes of objects with different outlines, or
        `settings.uniform_density`, which needs the object.
    """
    if settings.uniform_density:
        raise ValueError("settings.uniform_density: set the centers of settings.beliefs instead")
    pushes = [push] if isinstance(push, Push) else list(push)
    if noise is not None:
        settings = dataclasses.replace(settings, noise=noise)
    with jax.enable_x64(True):
        # which pushes can be used; a record that is not finite cannot, whatever its status says
        record, setup = _stacked(pushes)
        observation = observed(record, settings)
        used = observation.length > 0
        bad = np.where(record.status == PushStatus.OK, int(PushStatus.DIVERGED), record.status)
        status = tuple(PushStatus(int(s)) for s in np.where(used, int(PushStatus.OK), bad))
        none = IdentifiedBody(
            mean=np.full(4, np.nan),
            covariance=np.diag(np.full(4, np.inf)),
            status=EstimateStatus.BAD_INPUT,
            determined=np.zeros(4, bool),
            push_status=status,
            record=record,
            setup=setup,
            settings=settings,
        )
        if not used.any():
            return none
        # the least-squares fit of all pushes as those of one body
        scene, body = shared_scene(settings.scene), np.zeros(len(pushes), int)
        problem = SysidProblem.of(scene, observation, setup, settings, body=body)
        start = np.zeros((1, len(settings.estimated)))
        found = fit(problem, start, key=jax.random.key(seed))
        # mass, I_zz and the CoM from the first contact, and how much of them is the prior's
        first = _rows((record, setup), int(np.argmax(used)))
        (mean,), (covariance,), (code,) = planar_estimates(found, *first, _ORIGIN, settings)
        determined = _determined(found, covariance, *first, settings)
    outcome = EstimateStatus(int(code))
    fitted = dataclasses.replace(none, status=outcome, determined=determined, fit=found)
    if outcome != EstimateStatus.OK:
        return fitted
    return dataclasses.replace(fitted, mean=mean, covariance=covariance)


def _rows(pushes: tuple[PushRecord, PushSetup], row: int) -> tuple[PushRecord, PushSetup]:
    """One of the pushes, with its leading axis."""
    return jax.tree.map(lambda x: x[row : row + 1], pushes)


def _determined(
    found: Fit,
    covariance: Float[np.ndarray, "4 4"],
    record: PushRecord,
    setup: PushSetup,
    settings: SysidSettings,
) -> Bool[np.ndarray, "4"]:
    """Which of the four parameters the pushes tell, and not the priors."""
    # the covariance of the four before any push is that of a fit which learnt nothing
    unit = np.eye(len(settings.estimated))[None]
    blank = found.replace(misfit=np.ones(1), known=found.known.replace(covariance=unit))
    prior = planar_estimates(blank, record, setup, _ORIGIN, settings)[1][0]
    share = np.diagonal(covariance) / np.maximum(np.diagonal(prior), 1e-300)
    # I_zz is the mass times a ratio: the mass alone does not tell it
    if "inertia" in settings.estimated:
        ratio = settings.estimated.index("inertia")
        own = found.known.covariance[0, ratio, ratio] * max(float(found.misfit[0]), 1.0)
        share[TARGETS.index("inertia")] = own
    held = [name not in settings.estimated for name in TARGETS]
    return (share < _DETERMINED) & ~np.array(held)


def _stacked(pushes: Sequence[Push]) -> tuple[PushRecord, PushSetup]:
    """Records and setups with a leading axis, in double precision.

    Records are continued to one of few lengths, so that one program serves many durations.
    """
    if not pushes:
        raise ValueError("push: an empty sequence; give at least one push")
    alike = {jax.tree.structure(p.setup) for p in pushes}
    shapes = {tuple(np.shape(x) for x in jax.tree.leaves(p.setup)) for p in pushes}
    first = pushes[0].setup

    def is_first(other: PushSetup) -> bool:
        pairs = [(other.half_extents, first.half_extents)]
        if first.polygons is not None and other.polygons is not None:
            pairs.append((other.polygons, first.polygons))
        return all(np.allclose(a, b) for a, b in pairs)

    if len(alike) > 1 or len(shapes) > 1 or not all(is_first(p.setup) for p in pushes):
        raise ValueError("push: the outlines differ; give pushes of one body with the same setup")

    def double(*rows: AnyArray) -> np.ndarray:
        x = np.concatenate([np.asarray(row) for row in rows])
        return x.astype(np.float64) if x.dtype.kind == "f" else x

    longest = max(len(p.record.time) for p in pushes)
    batches = [jax.tree.map(lambda x: np.asarray(x)[None], (p.record, p.setup)) for p in pushes]
    record = jax.tree.map(double, *[with_samples(record, longest) for record, _ in batches])
    setup = jax.tree.map(double, *[setup for _, setup in batches])
    return jax.tree.map(np.asarray, with_few_lengths(record)), setup
