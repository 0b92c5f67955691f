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

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from mjx_inertia import runtime
from mjx_inertia.dataset import add_noise
from mjx_inertia.dataset.plan import SQUARE_FRICTION_RADIUS
from mjx_inertia.estimators.sysid import (
    SysidSettings,
    equations_at,
    fit,
    observed,
    search,
    to_coordinates,
)
from mjx_inertia.estimators.sysid.next_push import (
    Paths,
    PusherLimits,
    Pushes,
    candidates,
    choose,
    expected_information,
    predicted,
    straight_pushes,
    target_slopes,
)
from mjx_inertia.evaluation.appearance import styled
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import cube
from mjx_inertia.pushing import PushRecord, Scene, SceneSettings, build_scene
from parts.information_figures import draw_bound_maps, draw_sequences

LIMITS = PusherLimits(speed=(0.05, 0.2), length=0.08)
SAMPLES = 432  # every record is padded to this: one compiled program for all
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


def half_and_radius(edge: float) -> tuple[np.ndarray, float]:
    """Half extents and c of a cube."""
    return np.full(3, edge / 2), SQUARE_FRICTION_RADIUS * edge


def joined(parts: list[Any]) -> Any:
    """Trees with a leading axis, one after the other."""
    return jax.tree.map(lambda *x: np.concatenate([np.asarray(i) for i in x]), *parts)


def rows_of(tree: Any, rows: np.ndarray) -> Any:
    """Rows of a tree with a leading axis."""
    return jax.tree.map(lambda x: np.asarray(x)[rows], tree)


@dataclass(frozen=True)
class Lab:
    """The scene and the sensors of all three parts."""

    scene: Scene
    settings: SysidSettings

    def information(self, z: np.ndarray, pushes: Pushes, samples: int = SAMPLES) -> np.ndarray:
        """Fisher information of pushes."""
        return expected_information(
            self.scene, z, pushes, np.zeros(2), self.settings, samples=samples
        )

    def measured(self, z: np.ndarray, pushes: Pushes, first: int, seed: int) -> PushRecord:
        """Records with noise; push i has the noise of number first + i."""
        exact = predicted(self.scene, z, pushes, np.zeros(2), self.settings, samples=SAMPLES)
        number = np.arange(first, first + len(pushes), dtype=np.uint32)
        key = jax.random.key(seed)
        return add_noise(exact, jnp.asarray(number), self.settings.noise, key=key)


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
    found = search(lab.scene, start, observation, many.setup, np.zeros(2), settings)
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


def deviations(fisher: np.ndarray, settings: SysidSettings, edge: Any) -> np.ndarray:
    """Bounds of mass (%), I_zz (%) and the CoM's place (mm), beliefs included, (..., 3)."""
    slope = target_slopes(settings)
    covariance = slope @ np.linalg.inv(fisher + np.eye(fisher.shape[-1])) @ slope.T
    variance = np.diagonal(covariance, axis1=-2, axis2=-1)
    com = np.sqrt(variance[..., 2] + variance[..., 3]) * 1e3 * np.asarray(edge) / 2
    return np.stack([*(100 * np.sqrt(variance[..., :2])).T, com.T]).T


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
    found = equations_at(
        scene, z[every], joined(kept), rows_of(pushes, every).setup, np.zeros(2), fast
    )
    size = deviations(np.asarray(found.hessian) - np.eye(z.shape[1]), fast, EDGE)
    size = size.reshape(len(keep), len(speed), 3)
    rates = ("sampling rate, Hz", 200.0 / keep)
    save(draw_bound_maps(("speed, m/s", speed), rates, size, "xy"), folder, "rate")
    return {
        f"map_mass_percent_at_{200 / k:g}_hz_{speed[i]:.2g}_m_s": round(float(size[j, i, 0]), 3)
        for j, k in ((0, 16), (4, 1))
        for i in (0, 8)
    }


def drawn_objects(count: int, settings: SysidSettings, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and edges of random cubes whose CoM and I_zz are not those of uniform ones."""
    rng = np.random.default_rng(seed)
    values = {
        "mass": np.exp(rng.uniform(np.log(0.5), np.log(5.0), count)),
        "inertia": rng.uniform(0.7, 1.3, count),
        "com_x": rng.uniform(-0.3, 0.3, count),
        "com_y": rng.uniform(-0.3, 0.3, count),
        "friction": rng.uniform(0.2, 0.6, count),
        "tip_friction": rng.uniform(0.2, 0.5, count),
        "tip_time_constant": rng.uniform(0.012, 0.04, count),
    }
    return np.asarray(to_coordinates(values, settings)), rng.uniform(0.1, 0.2, count)


@dataclass
class Campaign:
    """Sequences of pushes under way: some choose, the others push at random."""

    truth: np.ndarray  # coordinates of each sequence's object
    grid: list[Pushes]  # its candidates
    chooses: np.ndarray  # whether it chooses
    z: np.ndarray  # estimate so far
    known: np.ndarray  # information so far, belief included
    pushes: list[Pushes]  # made so far, all sequences together
    observation: list[Any]  # of each
    group: np.ndarray  # which sequence made it


def next_pushes(lab: Lab, c: Campaign, active: np.ndarray, rng: np.random.Generator) -> list[int]:
    """The number of the next push of each active sequence."""
    targets = target_slopes(lab.settings)
    thinking = [s for s in active if c.chooses[s]]
    number = {int(s): int(rng.integers(len(c.grid[s]))) for s in active}
    if thinking:
        size = len(c.grid[0])
        z = np.repeat(c.z[thinking], size, 0)
        fisher = lab.information(z, joined([c.grid[s] for s in thinking]))
        for s, part in zip(thinking, fisher.reshape(-1, size, *fisher.shape[1:]), strict=True):
            number[int(s)] = choose(c.known[s], part, targets, "A")[0]
    return [number[int(s)] for s in active]


def estimated(lab: Lab, c: Campaign, active: np.ndarray, number: int) -> np.ndarray:
    """Updates estimate and information of the active sequences; returns which of them fit."""
    rows = np.flatnonzero(np.isin(c.group, active))
    observation, pushes = rows_of(joined(c.observation), rows), rows_of(joined(c.pushes), rows)
    found = fit(
        lab.scene, c.z[active], observation, pushes.setup, np.zeros(2), lab.settings,
        key=jax.random.key(number), body=np.searchsorted(active, c.group[rows]),
    )  # fmt: skip
    c.z[active], c.known[active] = found.search.z, found.search.hessian
    return np.asarray(found.fits)


def errors(c: Campaign, edge: np.ndarray, settings: SysidSettings) -> np.ndarray:
    """Error of mass (%), I_zz (%), CoM (mm) of every sequence, then deviations stated, (s, 6)."""
    change = (c.z - c.truth) @ target_slopes(settings).T
    com = np.hypot(change[:, 2], change[:, 3]) * 1e3 * edge / 2
    made = 100 * np.abs(np.expm1(change[:, :2]))
    expected = deviations(c.known - np.eye(c.z.shape[1]), settings, edge)
    return np.column_stack([made, com, expected])


def campaign(
    lab: Lab, objects: int, rounds: int, random_rounds: int, folder: Path
) -> dict[str, Any]:
    """Chosen against random pushes; two random sequences for each object."""
    settings, rng = lab.settings, np.random.default_rng(4)
    truth, edge = drawn_objects(objects, settings, seed=3)
    of = np.tile(np.arange(objects), 3)
    grids = [candidates(LIMITS, *half_and_radius(float(e))) for e in edge]
    n, p = len(of), truth.shape[1]
    c = Campaign(
        truth[of], [grids[i] for i in of], np.arange(n) < objects, np.zeros((n, p)),
        np.tile(np.eye(p), (n, 1, 1)), [], [], np.zeros(0, int),
    )  # fmt: skip
    history, misfits, lost = [], [], 0
    for k in range(random_rounds):
        active = np.flatnonzero(~c.chooses) if k >= rounds else np.arange(n)
        number = next_pushes(lab, c, active, rng)
        pairs = zip(active, number, strict=True)
        new = joined([rows_of(c.grid[s], np.array([i])) for s, i in pairs])
        record = lab.measured(c.truth[active], new, n * k, seed=5)
        lost += int((np.asarray(record.status) != 0).sum())
        c.pushes.append(new)
        c.observation.append(observed(record, settings))
        c.group = np.concatenate([c.group, active])
        stuck = ~estimated(lab, c, active, k)
        misfits.append(int(stuck.sum()))
        history.append(errors(c, edge[of], settings))
        middle = [np.median(history[-1][s], 0).round(3).tolist() for s in (c.chooses, ~c.chooses)]
        print(f"after {k + 1} pushes, medians (m %, I %, CoM mm, stated): chosen {middle[0]}, "
              f"random {middle[1]}; stuck {misfits[-1]}", flush=True)  # fmt: skip
        if k < rounds:
            last = new.setup.motion.speed[:objects], new.offset[:objects], new.angle[:objects]
            print("   chosen speed, offset, angle:", [np.round(x, 2).tolist() for x in last])
    table = np.stack(history)
    return {**summary(table, c.chooses, rounds, folder), "lost_pushes": lost, "stuck_fits": misfits}


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
    sequence = options.objects, options.rounds, options.random_rounds
    what: dict[Part, Callable[[], dict[str, Any]]] = {
        "check": lambda: check(lab, options.draws),
        "maps": lambda: contact_and_acceleration(lab, folder),
        "sequence": lambda: campaign(lab, *sequence, folder),
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
