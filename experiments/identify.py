"""Every estimator on the same test pushes, beside the Cramér-Rao bound of each push.

    python experiments/identify.py [identify.pushes=480] [overrides of the sweep]

Trained on the training pushes of the dataset (thesis and grouped splits), judged on test pushes
that are simulated anew in double precision, with the noise of the dataset and its floors. `sysid`
is told the outline of the object, as a camera would; the regressors are not. The bound of a push is
that of `sysid`'s seven unknowns, beliefs included; ratios to it are taken where the push, and not
the belief, decides (the bound is below a third of the belief).
"""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia import runtime
from mjx_inertia.dataset import (
    PushBatch,
    PushPlan,
    SensorNoise,
    SimulatedSettings,
    add_noise,
    known_setup,
    select_pushes,
    simulated_source,
)
from mjx_inertia.estimators import ESTIMATORS, TARGETS, Estimate, EstimateStatus
from mjx_inertia.estimators.sysid import (
    SysidProblem,
    SysidSettings,
    equations_at,
    observed,
    planar_values,
    to_coordinates,
)
from mjx_inertia.evaluation import percent_difference
from mjx_inertia.experiment import experiment
from mjx_inertia.features import examples, take_examples as take_rows
from mjx_inertia.objects import cube
from mjx_inertia.pushing import PushRecord, build_scene, simulate
from mjx_inertia.settings import SweepSettings
from mjx_inertia.sweep import tabulate

DECIDED = 1 / 3  # bound over the belief's deviation, above which the belief decides
UNITS = {"mass": "percent", "inertia": "percent", "com_x": "mm", "com_y": "mm"}


@dataclass(frozen=True)
class Options:
    """Command-line options beside those of the sweep."""

    pushes: int = 480  # of each split's test pushes, evenly chosen


def exact_records(settings: SimulatedSettings, plan: PushPlan) -> PushRecord:
    """The pushes of a plan, simulated in double precision, without noise."""
    with jax.enable_x64(True):
        return simulate(
            build_scene(cube(0.15, 1.0), settings.generate.scene),
            plan.parameters,
            plan.motion,
            contact_point=plan.contact_point,
            contact_normal=plan.contact_normal,
        )


def true_coordinates(plan: PushPlan, settings: SysidSettings) -> np.ndarray:
    """Where the truth of each push lies in the search of `sysid`."""
    p, n = plan.parameters, len(plan)
    truth = {
        "mass": p.mass,
        "inertia": np.ones(n),
        "com_x": np.zeros(n),
        "com_y": np.zeros(n),
        "friction": p.friction,
        "tip_friction": p.tip_friction,
        "tip_time_constant": p.tip_time_constant,
    }
    return np.asarray(to_coordinates(truth, settings))


def bounds(
    plan: PushPlan, exact: PushRecord, settings: SysidSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Least standard deviation of the four targets, (n, 4), and that of the belief alone."""
    with jax.enable_x64(True):
        scene = build_scene(cube(0.15, 1.0), settings.scene)
        z = true_coordinates(plan, settings)
        observation = observed(exact, settings)
        setup = known_setup(plan)
        found = equations_at(SysidProblem.of(scene, observation, setup, settings), z)

        def values(z: Any, setup: Any, point: Any, normal: Any) -> Any:
            return planar_values(z, setup, jnp.zeros(2), point, normal, settings)

        slope = jax.vmap(jax.jacfwd(values))(
            jnp.asarray(z), setup, plan.contact_point, plan.contact_normal
        )
        slope = np.asarray(slope)
    covariance = np.linalg.inv(found.hessian)
    least = np.einsum("nij,njk,nik->ni", slope, covariance, slope)
    return np.sqrt(least), np.sqrt(np.einsum("nij,nij->ni", slope, slope))


def judged(
    estimate: Estimate, truth: np.ndarray, bound: np.ndarray, belief: np.ndarray, seconds: float
) -> dict[str, float | int]:
    """Errors, ratio to the bound and coverage of one estimator."""
    status = np.asarray(estimate.status)
    fine = status == EstimateStatus.OK
    error = np.asarray(estimate.mean)[fine] - truth[fine]
    sigma = np.sqrt(np.einsum("nii->ni", np.asarray(estimate.covariance)[fine]))
    result: dict[str, float | int] = {
        "n": len(fine),
        "failed": int((~fine).sum()),
        "seconds_per_push": round(seconds / len(fine), 4),
    }
    for i, target in enumerate(TARGETS):
        relative = UNITS[target] == "percent"
        percent = np.abs(percent_difference(truth[fine, i], np.asarray(estimate.mean)[fine, i]))
        size = percent if relative else 1e3 * np.abs(error[:, i])
        decided = (bound[fine, i] < DECIDED * belief[fine, i]) & np.isfinite(error[:, i])
        ratio = np.sqrt(np.mean((error[decided, i] / bound[fine, i][decided]) ** 2))
        covered = np.abs(error[:, i]) < 1.96 * sigma[:, i]
        result |= {
            f"{target}_abs_mean_{UNITS[target]}": round(float(size.mean()), 3),
            f"{target}_abs_median_{UNITS[target]}": round(float(np.median(size)), 3),
            f"crb_ratio_{target}": round(float(ratio), 3),
            f"crb_n_{target}": int(decided.sum()),
            f"coverage95_{target}": round(float(covered.mean()), 4),
        }
    counts = np.bincount(status, minlength=len(EstimateStatus))
    result["statuses"] = {s.name: int(counts[s]) for s in EstimateStatus if counts[s]}  # type: ignore[assignment]
    return result


def compare(settings: SweepSettings, pushes: int) -> dict[str, dict[str, Any]]:
    """Fits and judges every estimator on every split of the dataset."""
    data = settings.dataset
    if not isinstance(data, SimulatedSettings):
        raise ValueError("identify needs a simulated dataset: its truth and its bound")
    source = simulated_source(data, progress=settings.progress)
    if source is None:
        raise ValueError("the store lacks other shards; run without dataset.shard")
    plain = {k: v for k, v in settings.estimators.items() if not ESTIMATORS[k].signals}
    trained = SweepSettings(data, plain or {"mean": None}, settings.features)
    tables, _ = tabulate(source, trained)
    plan, noise = data.generate.plan(), SensorNoise(data.spread, data.floor)
    results = {}
    for split in source.splits:
        train, test = split.folds[0]
        rows = np.asarray(test)[np.linspace(0, len(test) - 1, min(pushes, len(test))).astype(int)]
        part = select_pushes(plan, rows)
        exact = exact_records(data, part)
        single = jax.tree.map(lambda x: np.asarray(x, np.float32) if x.dtype == float else x, exact)
        noisy = add_noise(single, rows.astype(np.uint32), noise, key=jax.random.key(1))
        batch = PushBatch(noisy, part.truth, part.conditions, known_setup(part))
        truth = np.column_stack([part.truth.mass, part.truth.inertia, part.truth.com])
        reference = SysidSettings(scene=data.generate.scene, noise=noise)
        bound, belief = bounds(part, exact, reference)
        for name, choice in settings.estimators.items():
            print(f"{split.name}: {name} ...", flush=True)
            feature_set = getattr(choice, "features", None) or "onset"
            table = examples(batch, feature_set, settings.features, keep_records=True,
                             shapes=source.shapes)  # fmt: skip
            estimator = ESTIMATORS[name].factory(choice)
            learnt = take_rows(tables[feature_set], train)
            fitted = estimator.fit(learnt, key=jax.random.key(settings.seed))
            begin = time.perf_counter()
            estimate = jax.tree.map(np.asarray, estimator.predict(fitted, table))
            seconds = time.perf_counter() - begin
            results[f"{split.name}.{name}"] = judged(estimate, truth, bound, belief, seconds)
            print(results[f"{split.name}.{name}"], flush=True)
        fine = bound / np.abs(truth)
        results[f"{split.name}.bound"] = {
            "mass_percent_median": round(100 * float(np.median(fine[:, 0])), 3),
            "inertia_percent_median": round(100 * float(np.median(fine[:, 1])), 3),
            "com_x_mm_median": round(1e3 * float(np.median(bound[:, 2])), 4),
            "com_y_mm_median": round(1e3 * float(np.median(bound[:, 3])), 4),
        }
    return results


@experiment(SweepSettings, Options, prefix="identify")
def main(settings: SweepSettings, options: Options, _folder: Path) -> dict[str, Any]:
    """Prints one line for each estimator and split."""
    runtime.configure(settings.devices)
    results = compare(settings, options.pushes)
    return {"experiment": "identify", "pushes": options.pushes, **results}


if __name__ == "__main__":
    main()
