"""Chapter 7: trajectories of the space robot that spare the object it has captured.

    python experiments/space_robot.py [generations=5000] [repeats=3] [gif=1] [seed=0]
                                      [parts=[thesis,consistent,replay,servicer]]

1. As the thesis sets it (six independent joints, momentum of the robot alone, Table 7.1): the three
   sub-problems of Fig. 7.2 and all nine objectives at once, `generations` of MOEA/D in all, beside
   the straight quintic (p = q = 0); from the nine the knee, the row nearest to a wish (half the
   straight quintic's wrench, a tenth of its turn and errors), and CMA-ES straight toward the wish.
2. Joints that obey the grasp, momentum of the whole system, the links' physical inertia: force and
   moment of the total wrench and the turn of the base; MOEA/D, CMA-ES, differential evolution and
   gradients by evaluations and by time.
3. The chosen trajectory in C MuJoCo: predicted and simulated drift and wrenches, and what the model
   of the thesis would have predicted.
4. Three dimensions: two arms of seven joints on a satellite, the same optimisers, MuJoCo.
"""

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.search import (
    ArchiveSettings,
    GradientSettings,
    MoeadSettings,
    Problem,
    SearchResult,
    StrategySettings,
    evolution_strategies,
    gradient_descent,
    moead,
    progress,
    toward,
)
from mjx_inertia.search.fronts import knee
from mjx_inertia.space import (
    AS_PRINTED,
    BASE_DRIFT,
    HANDS,
    THESIS,
    WRENCH,
    Manoeuvre,
    ManoeuvreSettings,
    PlanarSettings,
    disagreement,
    fronts_figure,
    parallel_figure,
    path,
    path_figure,
    planar_manoeuvre,
    problem,
    progress_figure,
    replay,
    save_animation,
    servicer_manoeuvre,
)

GRADIENT_STEPS, DIRECTIONS = 100, 21  # a lattice of three costs has 21 weights
GRADIENT = {
    "weights": DIRECTIONS,
    "starts": 2,
    "spread": 0.3,
    "learning_rate": 0.02,
    "smoothing": 0.02,
}
Part = Literal["thesis", "consistent", "replay", "servicer"]
COMPROMISE = ("force", "moment", "base_turn")
SPARING = ("object_force", "object_moment", "base_turn")
REACHING, REACHING_STEPS = StrategySettings(weights=1, population=24), 400
SUB_PROBLEMS = {"wrench": WRENCH, "base": BASE_DRIFT, "end effectors": HANDS}


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    generations: int = 5000  # of MOEA/D for the thesis' run, over all of its sub-problems
    repeats: int = 3  # seeds of each optimiser where they are compared
    gif: int = 1  # whether the animations are drawn, 1 or 0
    seed: int = 0  # of the first
    parts: tuple[Part, ...] = get_args(Part)


def nine(m: Manoeuvre, decisions: Float[ndarray, "n c"]) -> Float[ndarray, "n 9"]:
    """C_f1 to C_f9."""
    return np.asarray(jax.jit(jax.vmap(problem(m, THESIS).evaluate))(jnp.asarray(decisions)).costs)


def timed(run: Any) -> tuple[SearchResult, float]:
    """A search's result and its seconds, compilation included."""
    start = time.perf_counter()
    result = jax.block_until_ready(run())
    return result, time.perf_counter() - start


def summary(nine_costs: Float[ndarray, "9"]) -> dict[str, float]:
    """The figures of the headline."""
    wrench, base, hands = nine_costs[:3], nine_costs[3:6], nine_costs[6:]
    return {
        "wrench_norm": float(np.linalg.norm(wrench)),
        "base_drift_m": float(np.hypot(*base[:2])),
        "base_drift_rad": float(base[2]),
        "end_effector_error_m": float(np.hypot(*hands[:2])),
    }


def show(title: str, baseline: Float[ndarray, "9"], rows: dict[str, Float[ndarray, "9"]]) -> None:
    """A table of the nine objectives."""
    print(f"\n{title}\n{'':28}" + "".join(f"{name:>12}" for name in THESIS))
    for name, costs in {"straight quintic": baseline, **rows}.items():
        print(f"{name:28}" + "".join(f"{x:12.3g}" for x in costs))


def thesis_run(options: Options, folder: Path) -> dict[str, Any]:
    """Part 1."""
    m = planar_manoeuvre(AS_PRINTED)
    straight = nine(m, np.zeros((1, m.size)))[0]
    baseline: dict[str, float] = dict(zip(THESIS, straight, strict=True))
    # half of the straight quintic's wrench, a tenth of its turn and errors
    wish = straight * np.array([0.5, 0.5, 0.5, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1])
    wishes = dict(zip(THESIS, wish, strict=True))
    fronts, rows, seconds, evaluations = {}, {}, 0.0, 0
    for title, names in SUB_PROBLEMS.items():
        posed, key = problem(m, names), jax.random.key(options.seed)
        each = options.generations // 5
        result, took = timed(lambda p=posed, k=key, n=each: moead(p, MoeadSettings(), n, key=k))
        decisions, costs = result.front()
        fronts[title] = (names, costs)
        best = nearest(costs, np.array([wishes[name] for name in names]))
        rows[f"{title} alone"] = nine(m, decisions[[best]])[0]
        seconds, evaluations = seconds + took, evaluations + int(result.evaluations)
    # all nine at once: only where no part of the wrench is more than thrice the straight quintic's
    posed = problem(m, THESIS, bounds={name: 3.0 * baseline[name] for name in WRENCH})
    settings = MoeadSettings(population=250, children=50, archive=ArchiveSettings(250))
    left, key = options.generations - 3 * (options.generations // 5), jax.random.key(options.seed)
    result, took = timed(lambda: moead(posed, settings, left, key=key))
    seconds, evaluations = seconds + took, evaluations + int(result.evaluations)
    decisions, costs = result.front()
    chosen = {"knee": knee(costs), "nearest to a wish": nearest(costs, wish)}
    rows |= {f"all nine: {name}": costs[row] for name, row in chosen.items()}
    aimed, took = timed(
        lambda: evolution_strategies(toward(posed, wish), REACHING, REACHING_STEPS, key=key)
    )
    seconds, evaluations = seconds + took, evaluations + int(aimed.evaluations)
    decision = aimed.front()[0][0]
    rows["toward the wish"] = nine(m, decision[None])[0]
    show("As printed: independent joints, momentum of the robot", straight, rows)
    fronts_figure(fronts, baseline).savefig(folder / "fronts.svg")
    shown = np.concatenate([costs, rows["toward the wish"][None]])
    chosen |= {"toward the wish": len(costs)}
    parallel_figure(shown, THESIS, chosen, straight).savefig(folder / "parallel.svg")
    way = path(m, jnp.asarray(decision), np.linspace(0.0, 1.0, 201))
    path_figure(m.robot, way).savefig(folder / "path_as_printed.svg")
    apart = np.asarray(way.nodes.closure).max(0)
    made, volume = progress(result, 2.0 * straight)
    share = volume / np.prod(2.0 * straight)
    progress_figure({"all nine": (made, share)}).savefig(folder / "progress_of_nine.svg")
    print(f"{evaluations} evaluations in {seconds:.0f} s, {len(costs)} on the front of nine")
    print(f"its hypervolume, a share of twice the straight quintic: {np.round(share[::5], 4)}")
    print(f"the chosen joints pull the hands' objects {apart[0]:.2g} m, {apart[1]:.2g} rad apart")
    return {
        "straight": summary(straight),
        **{name: summary(row) for name, row in rows.items()},
        "least_wrench_norm": float(np.linalg.norm(fronts["wrench"][1], axis=1).min()),
        "closure_m": float(apart[0]),
        "hypervolume_of_nine": float(share[-1]),
        "seconds": round(seconds, 1),
        "evaluations": evaluations,
    }


def nearest(costs: Float[ndarray, "n k"], wish: Float[ndarray, " k"]) -> int:
    """The row whose worst cost, over what is wished for it, is least (a reference point)."""
    return int(np.argmin(np.max(costs / wish, axis=1)))


def searches(posed: Problem, generations: int) -> dict[str, Callable[[Array], SearchResult]]:
    """Optimisers by name, each a function of a key; all but the gradient evaluate equally often."""
    ours = MoeadSettings()
    strategies = {
        name: StrategySettings(name=kind, weights=DIRECTIONS)
        for name, kind in (
            ("cma_es", "CMA_ES"),
            ("differential_evolution", "DifferentialEvolution"),
        )
    }
    evaluations = ours.children * generations
    steps = {name: evaluations // (s.weights * s.population) for name, s in strategies.items()}
    return {
        "moead": lambda key: moead(posed, ours, generations, key=key),
        **{
            name: lambda key, s=s, n=steps[name]: evolution_strategies(posed, s, n, key=key)
            for name, s in strategies.items()
        },
        "gradient": lambda key: gradient_descent(
            posed, GradientSettings(**GRADIENT), GRADIENT_STEPS, key=key
        ),
    }


def compared(
    posed: Problem, options: Options, generations: int, straight: Float[ndarray, " k"]
) -> tuple[dict[str, Any], dict[str, Any], tuple[Float[ndarray, "n c"], Float[ndarray, "n k"]]]:
    """What each optimiser reaches (medians over seeds), how, and all fronts together.

    Hypervolumes are shares of the box to twice what the straight quintic costs.
    """
    reference = 2.0 * straight
    runs, figures, fronts = {}, {}, []
    for name, search in searches(posed, generations).items():
        volumes, seconds = [], []
        for seed in range(options.repeats):
            key = jax.random.key(options.seed + seed)
            result, took = timed(lambda s=search, k=key: s(k))
            seconds.append(took)
            evaluations, volume = progress(result, reference)
            volumes.append(volume / np.prod(reference))
            fronts.append(result.front())
        runs[name] = (evaluations, np.median(volumes, 0))
        figures[name] = {
            "hypervolume": float(np.median([v[-1] for v in volumes])),
            "evaluations": int(evaluations[-1]),
            "compile_s": round(float(seconds[0] - np.min(seconds[1:], initial=seconds[0])), 1),
            "seconds": round(float(np.min(seconds)), 1),
        }
    goal = figures["moead"]["hypervolume"]
    for name, (evaluations, volume) in runs.items():
        there = np.flatnonzero(volume >= 0.99 * goal)
        figures[name]["evaluations_to_99_percent_of_moead"] = (
            int(evaluations[there[0]]) if len(there) else None
        )
        print(f"{name}: {figures[name]}")
    decisions, costs = (np.concatenate(part) for part in zip(*fronts, strict=True))
    return figures, runs, (decisions, costs)


def consistent_run(
    options: Options, m: Manoeuvre, folder: Path
) -> tuple[dict[str, Any], Float[ndarray, " c"]]:
    """Part 2: what the optimisers reach, and the decision that is taken."""
    print("\nOptimisers, planar robot, joints that obey the grasp")
    posed = problem(m, COMPROMISE)
    straight = np.asarray(jax.jit(posed.evaluate)(jnp.zeros(m.size)).costs)
    figures, runs, (decisions, costs) = compared(
        posed, options, options.generations // 10, straight
    )
    progress_figure(runs).savefig(folder / "progress.svg")
    row = knee(costs)
    baseline: dict[str, float] = dict(zip(COMPROMISE, straight, strict=True))
    fronts_figure({"joints that obey the grasp": (COMPROMISE, costs)}, baseline).savefig(
        folder / "compromise.svg"
    )
    both = nine(m, np.stack([np.zeros(m.size), decisions[row]]))
    ends = {
        f"least {name}": nine(m, decisions[[np.argmin(costs[:, i])]])[0]
        for i, name in enumerate(COMPROMISE)
    }
    show("Joints obey the grasp, momentum of the whole system", both[0], {"knee": both[1], **ends})
    return {"optimisers": figures, "straight": summary(both[0]), **summary(both[1])}, decisions[row]


def shrunk(posed: Problem, share: float) -> Problem:
    """The same problem in the middle of its box."""
    return dataclasses.replace(posed, lower=share * posed.lower, upper=share * posed.upper)


def replays(m: Manoeuvre, decision: Float[ndarray, " c"]) -> dict[str, Any]:
    """Part 3: MuJoCo against the model that counts the object's momentum, and the printed one."""
    figures = {}
    for momentum in ("system", "robot"):
        found = disagreement(replay(m.replace(momentum=momentum), jnp.asarray(decision)))
        figures[momentum] = {
            "base_place_share": found.base_place_share,
            "base_turn_share": found.base_turn_share,
            "object_force_share": found.force,
            "object_moment_share": found.moment,
            "hand_force_share": max(found.hand_forces),
        }
        print(f"MuJoCo against the momentum of the {momentum}: {found}")
    return figures


def spatial_run(options: Options, folder: Path) -> dict[str, Any]:
    """Part 4: the servicer; taken is the row of the least worst share of the straight quintic."""
    print("\nOptimisers, servicer")
    m = servicer_manoeuvre()
    posed = shrunk(problem(m, SPARING), 0.1)
    straight = np.asarray(jax.jit(posed.evaluate)(jnp.zeros(m.size)).costs)
    found, runs, (_, costs) = compared(posed, options, options.generations // 25, straight)
    progress_figure(runs).savefig(folder / "servicer_progress.svg")
    baseline: dict[str, float] = dict(zip(SPARING, straight, strict=True))
    fronts_figure({"servicer": (SPARING, costs)}, baseline).savefig(folder / "servicer_front.svg")
    aimed, _ = timed(
        lambda: evolution_strategies(
            toward(posed, straight), REACHING, REACHING_STEPS // 2, key=jax.random.key(options.seed)
        )
    )
    best = aimed.front()[0][0]
    reached = np.asarray(jax.jit(posed.evaluate)(best).costs)
    way = path(m, best, np.linspace(0.0, 1.0, 241))
    path_figure(m.robot, way).savefig(folder / "servicer_path.svg")
    if options.gif:
        save_animation(folder / "servicer.gif", m, way[::4])
    apart = disagreement(replay(m, best))
    shares = {
        "chosen": (reached / straight).tolist(),
        "least": (costs.min(0) / straight).tolist(),
    }
    print(f"straight quintic, {', '.join(SPARING)}: {straight}; shares of it: {shares}")
    print(f"MuJoCo: {apart}")
    figures = {"optimisers": found, "straight": straight.tolist(), "shares": shares}
    return {**figures, "replay": dataclasses.asdict(apart)}


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Runs the parts."""
    runtime.configure(float64=True)
    m = planar_manoeuvre(ManoeuvreSettings(), PlanarSettings(link_inertia="physical"))
    best = np.zeros(m.size)
    figures: dict[str, Any] = {"experiment": "space_robot"}
    if "thesis" in options.parts:
        printed = thesis_run(options, folder)
        figures |= {name: printed[name] for name in ("evaluations", "seconds")}
        figures |= printed["toward the wish"] | {"as_printed": printed}
    if "consistent" in options.parts:
        found, best = consistent_run(options, m, folder)
        runs = found["optimisers"].items()
        figures["hypervolume"] = {name: run["hypervolume"] for name, run in runs}
        figures["consistent"] = found
        way = path(m, jnp.asarray(best), np.linspace(0.0, 1.0, 241))
        path_figure(m.robot, way).savefig(folder / "path.svg")
        if options.gif:
            save_animation(folder / "manoeuvre.gif", m, way[::4])
    if "replay" in options.parts:
        figures["replay"] = replays(m, best)
    if "servicer" in options.parts:
        figures["servicer"] = spatial_run(options, folder)
    return figures


if __name__ == "__main__":
    main()
