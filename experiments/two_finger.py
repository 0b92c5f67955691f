"""Figs 3.19 to 3.22 of the thesis: 12 cuboids, 12 pushes with two fingers or 5 with one tip.

    python experiments/two_finger.py [overrides of the sweep]

The analytical method (Yu et al. 2005) pushes each cuboid of Table 3.5 (errata 10) 12 times with two
force-sensing fingers: 4 times straight on each of two faces and 4 times turning it by 30°, with 0.2
to 0.8 m/s². The trees are trained on cubes (`dataset=quick` unless overridden; the thesis has the
48,000 of `dataset=full`) and average 5 pushes at 20 mm/s, as long as those that they are trained on
(the thesis: 10 cm, on which these trees, which see the length of the path, halve the mass). The CoM
counts from the middle of the long face, x inward and y to the left, so that com_y is 0 and has no
percentage. All sensors have the noise of the data. Figures: fig_3.19 to fig_3.22.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia import runtime
from mjx_inertia.dataset import (
    CubesProtocol,
    PushBatch,
    PushConditions,
    PushTruth,
    SensorNoise,
    SimulatedSettings,
    add_noise,
    simulated_source,
)
from mjx_inertia.estimators import (
    ESTIMATORS,
    TARGETS,
    Estimate,
    EstimateStatus,
    TwoFingerLeastSquares,
    estimate_two_finger,
)
from mjx_inertia.estimators.sysid import (
    Fit,
    SysidProblem,
    SysidSettings,
    fit,
    observed,
    to_parameters,
)
from mjx_inertia.evaluation import percent_difference
from mjx_inertia.evaluation.appearance import DARK, SERIES, TARGET_AXES, grid_of_axes, styled
from mjx_inertia.experiment import experiment
from mjx_inertia.features import examples
from mjx_inertia.objects import ObjectModel, cuboid
from mjx_inertia.pushing import (
    PushSetup,
    StraightMotion,
    build_scene,
    object_parameters,
    simulate,
)
from mjx_inertia.pushing.settings import CLEARANCE
from mjx_inertia.pushing.two_finger_scene import (
    TwoFingerMotion,
    TwoFingerPush,
    TwoFingerSettings,
    measured,
    simulate_two_finger,
)
from mjx_inertia.settings import SweepSettings
from mjx_inertia.sweep import tabulate

SIZES = ((0.2, 0.3, 0.2), (0.15, 0.2, 0.15))  # m; the long face looks along x
MASSES, FRICTIONS = (1.0, 2.5, 4.0), (0.3, 0.5)  # kg (errata 10)
ACCELERATIONS = (0.2, 0.4, 0.6, 0.8)  # m/s²
STRAIGHT_LENGTH, TURN = 0.15, np.radians(30.0)  # m, rad
NEAR_MIDDLE = 0.01  # m: how well a robot hits the middle of a face
OFFSETS = (0.0, 0.04, -0.04, 0.08, -0.08)  # m, along the face; one push alone is the central one
SPEED = 0.02  # m/s
THESIS = (
    "analytical better on mass and com_y, forest better on inertia and com_x; forest scatters much "
    "on inertia; analytical poor on inertia, a finger losing contact (§3.7.3, no numbers printed)"
)


@dataclass(frozen=True)
class Case:
    """One cuboid of Table 3.5 on its table."""

    model: ObjectModel
    friction: float

    @property
    def truth(self) -> np.ndarray:
        """Mass, I_zz and CoM from the middle of the long face."""
        inertial = self.model.inertial
        depth = float(self.model.half_extents[0])
        return np.array([float(inertial.mass), float(inertial.inertia[2, 2]), depth, 0.0])


@dataclass(frozen=True)
class Answers:
    """One method's estimates of all cuboids, CoM from the middle of the long face, SI units."""

    label: str  # of the method
    mean: np.ndarray  # (12, 4); NaN where no push was usable
    std: np.ndarray  # (12, 4): over the pushes that are averaged, or what the method states


def table_3_5() -> list[Case]:
    """The twelve cuboids in the order of the table."""
    return [
        Case(cuboid(size, mass), friction)
        for mass in MASSES
        for friction in FRICTIONS
        for size in SIZES
    ]


def two_finger_pushes(
    case: Case, pusher: TwoFingerSettings, rng: np.random.Generator
) -> dict[str, list[TwoFingerPush]]:
    """Twelve pushes without noise, in the groups that the method takes.

    The pusher turns about a point such that the force that turns a uniform cuboid of this outline
    passes between the fingers: it must not lose contact with one of them.
    """
    x, y = case.model.half_extents[:2]

    def near() -> float:
        return float(rng.uniform(-NEAR_MIDDLE, NEAR_MIDDLE))

    side = y - 0.5 * pusher.width - NEAR_MIDDLE
    radius = side + (x**2 + y**2) / (3 * side)  # the centre of percussion: k² = (x² + y²)/3
    motions: dict[str, list[TwoFingerMotion]] = {"straight": [], "across": [], "turning": []}
    for a in ACCELERATIONS:
        motions["straight"].append(TwoFingerMotion((-x, near()), (1.0, 0.0), a, STRAIGHT_LENGTH))
        motions["across"].append(TwoFingerMotion((near(), -y), (0.0, 1.0), a, STRAIGHT_LENGTH))
        motions["turning"].append(
            TwoFingerMotion((-x, -side), (1.0, 0.0), a, float(radius * TURN), float(radius), x)
        )
    return {
        name: [simulate_two_finger(case.model, case.friction, m, pusher) for m in group]
        for name, group in motions.items()
    }


def two_finger_answers(
    cases: Sequence[Case],
    pushes: Sequence[dict[str, list[TwoFingerPush]]],
    fit: TwoFingerLeastSquares,
    label: str,
) -> Answers:
    """The analytical method on all cuboids, 12 pushes each."""
    mean, std = [], []
    for case, groups in zip(cases, pushes, strict=True):
        told = estimate_two_finger(**groups, settings=fit)
        depth = case.model.half_extents[0]
        mean.append([told.mass, told.inertia, told.com[0] + depth, told.com[1]])
        std.append([told.mass_std, told.inertia_std, *told.com_std])
    return Answers(label, np.array(mean), np.array(std))


def one_tip_pushes(cases: Sequence[Case], settings: SimulatedSettings, seed: int) -> PushBatch:
    """Pushes of every cuboid at each of `OFFSETS`, cuboid by cuboid, with the data's noise.

    Friction of the tip and stiffness of its contact are drawn as for the training cubes.
    """
    rng = np.random.default_rng(seed)
    protocol = settings.generate.protocol
    ranges = protocol if isinstance(protocol, CubesProtocol) else CubesProtocol()
    n = len(cases) * len(OFFSETS)
    pushed = [case for case in cases for _ in OFFSETS]
    offset = np.tile(OFFSETS, len(cases))
    drawn = rng.uniform(*ranges.tip_friction, n), rng.uniform(*ranges.tip_time_constant, n)
    parameters = [
        object_parameters(case.model, case.friction, tip, stiffness)
        for case, tip, stiffness in zip(pushed, *drawn, strict=True)
    ]
    truth = np.stack([case.truth for case in pushed])
    point = np.stack([-truth[:, 2], offset], 1)
    normal = np.tile([1.0, 0.0], (n, 1))
    scene = settings.generate.scene
    motion = StraightMotion(
        start=point - (scene.tip_radius + CLEARANCE) * normal,
        direction=normal,
        speed=np.full(n, SPEED),
        ramp=np.zeros(n),
        duration=np.full(n, ranges.length / SPEED),
    )
    records = simulate(
        build_scene(cases[0].model, scene),
        jax.tree.map(lambda *leaves: np.stack([np.asarray(x) for x in leaves]), *parameters),
        motion,
        contact_point=point,
        contact_normal=normal,
    )
    noisy = add_noise(
        records,
        np.arange(n, dtype=np.uint32),
        SensorNoise(settings.spread, settings.floor),
        key=jax.random.key(seed),
    )
    size = 2 * np.array([case.model.half_extents[1] for case in pushed])
    return PushBatch(
        records=noisy,
        truth=PushTruth(
            mass=truth[:, 0], inertia=truth[:, 1], com=np.stack([truth[:, 2], -offset], 1)
        ),
        conditions=PushConditions(
            object_id=np.repeat(np.arange(len(cases)), len(OFFSETS)),
            friction=np.array([case.friction for case in pushed]),
            size=size,
            speed=np.full(n, SPEED),
            contact_offset=2 * offset / size,
            angle=np.zeros(n),
        ),
        setup=PushSetup(
            motion=motion,
            pose=np.zeros((n, 3)),
            half_extents=np.stack([case.model.half_extents for case in pushed]),
            friction_radius=np.array([p.friction_radius for p in parameters]),
            shape=np.zeros(n, np.int32),
        ),
    )


def averaged(estimate: Estimate, batch: PushBatch, pushes: int, label: str) -> Answers:
    """Mean over the first `pushes` usable pushes of each cuboid, and their standard deviation."""
    rows = np.array(estimate.mean, float)
    rows[:, 3] += np.tile(OFFSETS, len(rows) // len(OFFSETS))  # from the middle of the face
    rows[np.asarray(estimate.status) != EstimateStatus.OK] = np.nan
    by_case = rows.reshape(-1, len(OFFSETS), len(TARGETS))[:, :pushes]
    return Answers(label, np.nanmean(by_case, 1), np.nanstd(by_case, 1))


def boosted_on_cubes(batch: PushBatch, settings: SweepSettings) -> Estimate:
    """Trees fitted to all pushes of the configured cubes, on these pushes."""
    assert isinstance(settings.dataset, SimulatedSettings)
    source = simulated_source(settings.dataset, progress=settings.progress)
    if source is None:
        raise ValueError("the store lacks other shards; run without dataset.shard")
    choice = settings.estimators["boosted"]
    tables, _ = tabulate(source, settings)
    estimator = ESTIMATORS["boosted"].factory(choice)
    fitted = estimator.fit(tables[choice.features], key=jax.random.key(settings.seed))
    return estimator.predict(fitted, examples(batch, choice.features, settings.features))


def identified(cases: Sequence[Case], batch: PushBatch, data: SimulatedSettings) -> list[Answers]:
    """`sysid` with one push of each cuboid (off centre), and with all five together."""
    scene = data.generate.scene
    options = SysidSettings(scene=scene, noise=SensorNoise(data.spread, max(data.floor, 1.0)))
    count, each = len(cases), len(OFFSETS)
    answers = []
    for label, chosen in (("sysid, 1 push", [1]), ("sysid, 5 pushes", range(each))):
        rows = (np.arange(count)[:, None] * each + np.array(chosen)).ravel()
        body = np.repeat(np.arange(count), len(chosen))
        with jax.enable_x64(True):
            records, setup = jax.tree.map(
                lambda x: np.asarray(x, float)[rows] if x.dtype.kind == "f" else x[rows],  # noqa: B023
                (batch.records, batch.setup),
            )
            seen = observed(records, options)
            start = np.zeros((count, len(options.estimated)))
            model = build_scene(cases[0].model, scene)
            problem = SysidProblem.of(model, seen, setup, options, body=body)
            found = fit(problem, start, key=jax.random.key(0))
            answers.append(_told(label, found, setup, body, options))
    return answers


def _told(
    label: str, found: Fit, setup: PushSetup, body: np.ndarray, options: SysidSettings
) -> Answers:
    first = jax.tree.map(lambda x: jnp.asarray(x)[np.unique(body, return_index=True)[1]], setup)

    def values(z: jax.Array, setup: PushSetup) -> jax.Array:
        p, _ = to_parameters(z, setup, jnp.zeros(2), options)
        return jnp.stack([p.mass, p.inertia[2], p.com[0] + setup.half_extents[0], p.com[1]])

    z = jnp.asarray(found.search.z)
    mean, slope = jax.vmap(values)(z, first), jax.vmap(jax.jacfwd(values))(z, first)
    variance = jnp.einsum("nij,njk,nik->ni", slope, jnp.asarray(found.known.covariance), slope)
    return Answers(label, np.asarray(mean), np.sqrt(np.asarray(variance)))


def errors_of(answers: Answers, truth: np.ndarray) -> np.ndarray:
    """(12, 4): Eq. 3.12 in % for mass and I_zz, mm for the CoM; signed, truth less estimate."""
    percent = percent_difference(truth[:, :2], answers.mean[:, :2])
    return np.concatenate([percent, 1e3 * (truth[:, 2:] - answers.mean[:, 2:])], 1)


def draw(target: int, methods: Sequence[Answers], truth: np.ndarray, path: Path) -> None:
    """Errors of every cuboid, method beside method, with the scatter that each has (Fig. 3.19+)."""
    name = TARGETS[target]
    with styled():
        figure, axes = grid_of_axes(1, 1, 3.2)
        area = axes[0, 0]
        width = 0.8 / len(methods)
        for k, (answers, color) in enumerate(zip(methods, SERIES, strict=False)):
            unit = 100 / truth[:, target] if target < 2 else np.full(len(truth), 1e3)
            place = np.arange(1, len(truth) + 1) + (k - 0.5 * (len(methods) - 1)) * width
            size = np.abs(errors_of(answers, truth)[:, target])
            scatter = answers.std[:, target] * unit
            area.bar(place, size, 0.9 * width, color=color, label=answers.label)
            area.errorbar(place, size, scatter, fmt="none", ecolor=DARK, elinewidth=0.7, capsize=2)
        area.set_xticks(np.arange(1, len(truth) + 1))
        area.set_ylim(bottom=0)
        area.grid(axis="y")
        area.set_xlabel("cuboid of Table 3.5; thin lines: standard deviation")
        area.set_ylabel(f"|error| of {TARGET_AXES[name].symbol}, {'%' if target < 2 else 'mm'}")
        area.legend(loc="upper left", ncols=len(methods), bbox_to_anchor=(0, 1.12))
        figure.savefig(path, metadata={"Date": None})


def report(methods: Sequence[Answers], truth: np.ndarray) -> dict[str, float]:
    """Prints the table; returns the entries of the headline."""
    units = ("percent", "percent", "mm", "mm")
    print(f"{'mean |error| (signed mean ± std)':34}" + "".join(f"{t:>24}" for t in TARGETS))
    entries: dict[str, float] = {}
    for answers in methods:
        signed = errors_of(answers, truth)
        cells = []
        for target, unit, e in zip(TARGETS, units, signed.T, strict=True):
            key = f"{answers.label.replace(', ', '.').replace(' ', '_')}.{target}_abs_mean_{unit}"
            entries[key] = round(float(np.nanmean(np.abs(e))), 3)
            sign = "%" if unit == "percent" else "mm"
            cells.append(
                f"{entries[key]:.2f} {sign} ({np.nanmean(e):+.2f} ± {np.nanstd(e):.2f})".rjust(24)
            )
        print(f"{answers.label:34}" + "".join(cells))
    print("thesis: " + THESIS)
    return entries


def in_contact(pushes: Sequence[dict[str, list[TwoFingerPush]]]) -> float:
    """Share of the samples of turning pushes in which both fingers push."""
    force = [np.linalg.norm(p.force, axis=-1) for groups in pushes for p in groups["turning"]]
    return float(np.mean(np.concatenate(force).min(1) > 1e-3))


@experiment(SweepSettings)
def main(settings: SweepSettings, folder: Path) -> dict[str, Any]:
    """Runs both experiments, prints the table and writes the figures."""
    start = time.perf_counter()
    runtime.configure(settings.devices)
    if not isinstance(settings.dataset, SimulatedSettings):
        raise ValueError(f"dataset={settings.dataset.name} has no cubes to train on")
    cases, rng = table_3_5(), np.random.default_rng(settings.seed)
    truth = np.stack([case.truth for case in cases])
    clean = [two_finger_pushes(case, TwoFingerSettings(), rng) for case in cases]
    noisy = [
        {k: [measured(p, settings.dataset.spread, rng) for p in v] for k, v in groups.items()}
        for groups in clean
    ]
    fits = {
        "two fingers, 12 pushes": TwoFingerLeastSquares(rows="samples"),
        "two fingers, 12 pushes, means": TwoFingerLeastSquares(rows="pushes"),
    }
    methods = [two_finger_answers(cases, noisy, fit, label) for label, fit in fits.items()]
    batch = one_tip_pushes(cases, settings.dataset, settings.seed)
    told = boosted_on_cubes(batch, settings)
    methods.append(averaged(told, batch, 5, "boosted trees, 5 pushes"))
    methods += identified(cases, batch, settings.dataset)
    entries = report(methods, truth)
    contact = round(in_contact(clean), 4)
    lost = int((np.asarray(batch.records.status) != 0).sum())
    print(f"both fingers push in {100 * contact:.1f} % of the samples of turning pushes")
    print(f"{lost} of {len(batch.truth.mass)} pushes with one tip are not usable")
    for target, figure in enumerate(("3.19", "3.20", "3.21", "3.22")):
        draw(target, methods, truth, folder / f"fig_{figure}_{TARGETS[target]}.svg")
    seconds = round(time.perf_counter() - start, 1)
    headline = {"experiment": "two_finger", "seconds": seconds, "cuboids": len(cases)}
    return {**headline, "turning_contact_share": contact, **entries}


if __name__ == "__main__":
    main()
