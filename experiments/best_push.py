r"""What a push can tell, and which push to make next.

    python experiments/best_push.py [objects=8] [draws=200] [rounds=4] [random_rounds=7] \
        [parts=[check,maps,sequence,rate]]

1. Check: 200 noise draws of three pushes are fitted; the scatter of the estimates over the
   Cramér-Rao bound should be near 1. MAP estimates lean to the belief, so their bound is
   H⁻¹ F H⁻¹ with F the information of the data and H = F + I; it is F⁻¹ where the data decide.
2. Maps of the bound over contact point, angle, speed, acceleration and sampling rate.
3. Sequence: push, estimate from all pushes so far, choose again, against random choice.
Figures: information_*.svg, which docs/ shows.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure

from mjx_inertia import runtime
from mjx_inertia.estimators.sysid import (
    SysidProblem,
    SysidSettings,
    equations_at,
    observed,
    search,
    to_coordinates,
)
from mjx_inertia.estimators.sysid.next_push import (
    Paths,
    Pushes,
    predicted,
    straight_pushes,
    target_slopes,
)
from mjx_inertia.evaluation.appearance import styled
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import cube
from mjx_inertia.pushing import SceneSettings, build_scene
from parts.information_figures import draw_bound_maps, draw_sequences
from parts.push_campaign import (
    LIMITS,
    Lab,
    campaign,
    deviations,
    half_and_radius,
    joined,
    rows_of,
)

EDGE = 0.15  # m, of the cube of check and maps
TYPICAL = {
    "mass": 2.0, "inertia": 1.0, "com_x": 0.0, "com_y": 0.0, "friction": 0.4,
    "tip_friction": 0.3, "tip_time_constant": 0.02,
}  # fmt: skip
# face, offset, angle (degrees), speed (m/s), acceleration (m/s²) of the pushes of the check
CHECKED = ((0, 0.6, -25.0, 0.2, 2.0), (0, -0.4, 30.0, 0.1, math.inf), (1, 0.3, -30.0, 0.15, 1.0))
BODY = ("mass", "inertia", "com")
Part = Literal["check", "maps", "sequence", "rate"]


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    objects: int = 8  # of the sequences
    draws: int = 200  # of the noise, for each push of the check
    rounds: int = 4  # pushes of a sequence that chooses
    random_rounds: int = 7  # pushes of one that does not
    parts: tuple[Part, ...] = ("check", "maps", "sequence", "rate")


def pushes_of_cube(paths: Paths) -> Pushes:
    """Pushes of the cube of check and maps."""
    return straight_pushes(*half_and_radius(EDGE), paths, length=LIMITS.length)


def check(lab: Lab, draws: int) -> dict[str, Any]:
    """Scatter of estimates over the bound, for every unknown."""
    names, settings = lab.settings.estimated, lab.settings
    truth = to_coordinates(TYPICAL, settings)
    face, offset, angle, speed, acceleration = np.array(CHECKED).T
    few = pushes_of_cube(Paths(face.astype(int), offset, np.radians(angle), speed, acceleration))
    fisher = lab.information(np.tile(truth, (len(few), 1)), few)
    many = rows_of(few, np.repeat(np.arange(len(few)), draws))
    z = np.tile(truth, (len(many), 1))
    observation = observed(lab.measured(z, many, 0, seed=1), settings)
    start = z + 0.05 * np.random.default_rng(2).standard_normal(z.shape)
    problem = SysidProblem.of(lab.scene, observation, many.setup, settings)
    found = search(problem, start)
    combined = np.eye(len(names))
    if "mass" in names and "inertia" in names:  # log I_zz rather than the ratio to a plate
        combined[names.index("inertia")] = target_slopes(settings)[1]
    ratios, toward = [], []
    for i in range(len(few)):
        h = np.linalg.inv(fisher[i] + np.eye(len(names)))
        bound = np.sqrt(np.diag(combined @ h @ fisher[i] @ h @ combined.T))
        error = (found.z[i * draws : (i + 1) * draws] - truth) @ combined.T
        ratios.append(error.std(0, ddof=1) / bound)
        toward.append(error.mean(0) / bound)
        decided = np.diag(h) < 1 / 9
        print(f"push {i}, ratio:", dict(zip(names, ratios[-1].round(3).tolist(), strict=True)))
        print("   bias over bound:", toward[-1].round(2).tolist(), "data decide:", decided.tolist())
    pooled = np.sqrt(np.mean(np.square(ratios), 0))
    return {
        **{f"mc_ratio_{n}": round(float(r), 3) for n, r in zip(names, pooled, strict=True)},
        "mc_ratio_lowest": round(float(np.min(ratios)), 3),
        "mc_ratio_highest": round(float(np.max(ratios)), 3),
        "mc_bias_over_bound_highest": round(float(np.abs(toward).max()), 3),
        "mc_draws": draws,
        "mc_pushes": len(few),
    }


def save(figure: Figure, folder: Path, name: str) -> None:
    """Writes information_<name>.svg."""
    with styled():
        figure.savefig(folder / f"information_{name}.svg", metadata={"Date": None})


def contact_and_acceleration(lab: Lab, folder: Path) -> dict[str, float]:
    """Maps over contact point and angle, and over acceleration and speed."""
    truth = to_coordinates(TYPICAL, lab.settings)
    offset, angle = np.linspace(-0.9, 0.9, 13), np.linspace(-40, 40, 11)
    speed, acceleration = np.geomspace(0.02, 0.32, 9), np.geomspace(0.05, 12.8, 9)
    a, o = (g.ravel() for g in np.meshgrid(np.radians(angle), offset, indexing="ij"))
    r, v = (g.ravel() for g in np.meshgrid(acceleration, speed, indexing="ij"))
    both = joined(
        [
            pushes_of_cube(Paths(0, o, a, 0.1, LIMITS.acceleration)),
            pushes_of_cube(Paths(0, 0.4, math.radians(-15), v, r)),
        ]
    )
    fisher = lab.information(np.tile(truth, (len(both), 1)), both)
    size = deviations(fisher, lab.settings, EDGE)
    by_contact = size[: len(o)].reshape(len(angle), len(offset), 3)
    by_ramp = size[len(o) :].reshape(len(acceleration), len(speed), 3)
    of = ("contact point, half edges from the middle", offset)
    figure = draw_bound_maps(of, ("angle to the normal, degrees", angle), by_contact, "")
    save(figure, folder, "contact")
    of = ("speed, m/s", speed)
    figure = draw_bound_maps(of, ("acceleration, m/s²", acceleration), by_ramp, "xy")
    save(figure, folder, "acceleration")
    middle = by_contact[len(angle) // 2, len(offset) // 2]
    return {
        "map_mass_percent_straight_central": round(float(middle[0]), 3),
        "map_mass_percent_best_contact": round(float(by_contact[..., 0].min()), 3),
        "map_inertia_percent_best_contact": round(float(by_contact[..., 1].min()), 3),
        "map_com_mm_best_contact": round(float(by_contact[..., 2].min()), 4),
        "map_mass_percent_slow_soft": round(float(by_ramp[0, 0, 0]), 3),
        "map_mass_percent_fast_hard": round(float(by_ramp[-1, -1, 0]), 3),
    }


def sampling(lab: Lab, folder: Path) -> dict[str, float]:
    """Map over speed and sampling rate: of 200 samples a second every k-th is kept."""
    fast = replace(lab.settings, scene=replace(lab.settings.scene, rate=200.0, max_timestep=0.005))
    scene, truth = build_scene(cube(EDGE, 1.0), fast.scene), to_coordinates(TYPICAL, fast)
    speed, keep = np.geomspace(0.02, 0.32, 9), np.array([16, 8, 4, 2, 1])
    pushes = pushes_of_cube(Paths(0, 0.4, math.radians(-15), speed, LIMITS.acceleration))
    z = np.tile(truth, (len(pushes), 1))
    samples = int(np.ceil(pushes.setup.motion.duration.max() * 200)) + 1
    exact = observed(predicted(scene, z, pushes, np.zeros(2), fast, samples=samples), fast)
    chosen = np.arange(samples) % keep[:, None] == keep[:, None] - 1
    kept = [exact.replace(weight=exact.weight * c[:, None]) for c in chosen]
    every = np.tile(np.arange(len(pushes)), len(keep))
    problem = SysidProblem.of(scene, joined(kept), rows_of(pushes, every).setup, fast)
    found = equations_at(problem, z[every])
    size = deviations(np.asarray(found.hessian) - np.eye(z.shape[1]), fast, EDGE)
    size = size.reshape(len(keep), len(speed), 3)
    rates = ("sampling rate, Hz", 200.0 / keep)
    save(draw_bound_maps(("speed, m/s", speed), rates, size, "xy"), folder, "rate")
    return {
        f"map_mass_percent_at_{200 / k:g}_hz_{speed[i]:.2g}_m_s": round(float(size[j, i, 0]), 3)
        for j, k in ((0, 16), (4, 1))
        for i in (0, 8)
    }


def sequence(lab: Lab, options: Options, folder: Path) -> dict[str, Any]:
    """Chosen against random pushes."""
    table, chooses, counts = campaign(lab, options.objects, options.rounds, options.random_rounds)
    return {**summary(table, chooses, options.rounds, folder), **counts}


def pushes_needed(wanted: float, errors: np.ndarray) -> float | None:
    """Pushes after which an error is as small as `wanted`, between two in proportion of logs."""
    below = np.flatnonzero(errors <= wanted)
    if not len(below):
        return None
    k = int(below[0])
    if k == 0:
        return 1.0
    share = math.log(errors[k - 1] / wanted) / math.log(errors[k - 1] / errors[k])
    return round(k + share, 2)


def summary(table: np.ndarray, chooses: np.ndarray, rounds: int, folder: Path) -> dict[str, Any]:
    """Medians over sequences (their error, and the deviation that they state), and the figure."""
    chosen = np.median(table[:rounds, chooses], 1)
    random = np.median(table[:, ~chooses], 1)
    figure = draw_sequences(table[:rounds, chooses], table[:, ~chooses])
    save(figure, folder, "sequence")
    result: dict[str, Any] = {"objects": int(chooses.sum())}
    for i, (name, unit) in enumerate(zip(BODY, ("percent", "percent", "mm"), strict=True)):
        result[f"chosen_{name}_{unit}_after"] = chosen[:, i].round(4).tolist()
        result[f"random_{name}_{unit}_after"] = random[:, i].round(4).tolist()
        result[f"chosen_{name}_{unit}_stated"] = chosen[:, 3 + i].round(4).tolist()
        result[f"random_{name}_{unit}_stated"] = random[:, 3 + i].round(4).tolist()
        for k in (1, 2, 3):
            if k <= rounds:
                needed = pushes_needed(chosen[k - 1, i], random[:, i])
                result[f"random_pushes_for_{name}_error_of_{k}_chosen"] = needed
                needed = pushes_needed(chosen[k - 1, 3 + i], random[:, 3 + i])
                result[f"random_pushes_for_{name}_stated_of_{k}_chosen"] = needed
    result["random_pushes_for_error_of_2_chosen"] = result[
        "random_pushes_for_mass_error_of_2_chosen"
    ] if rounds > 1 else None  # fmt: skip
    return result


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Runs the parts."""
    runtime.configure(float64=True)
    settings = SysidSettings(progress=False, iterations=20, coarse=0.3)
    lab = Lab(build_scene(cube(EDGE, 1.0), SceneSettings()), settings)
    what: dict[Part, Callable[[], dict[str, Any]]] = {
        "check": lambda: check(lab, options.draws),
        "maps": lambda: contact_and_acceleration(lab, folder),
        "sequence": lambda: sequence(lab, options, folder),
        "rate": lambda: sampling(lab, folder),
    }
    result: dict[str, Any] = {"experiment": "best_push"}
    for part in options.parts:
        begun = time.perf_counter()
        result |= what[part]()
        print(f"{part}: {time.perf_counter() - begun:.0f} s", flush=True)
    return result


if __name__ == "__main__":
    main()
