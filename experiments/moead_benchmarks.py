"""MOEA/D of this package against pymoo's MOEA/D, NSGA-II and NSGA-III on seven known problems.

    pip install -e ".[rival]"
    python experiments/moead_benchmarks.py [seeds=11] [evaluations=0] [problems=[zdt1,dtlz2]]
        [rivals=[nsga2]]

ZDT1 to 4 and 6 with two costs (25,000 evaluations, 100 rows) and DTLZ1 and 2 with three (30,000
evaluations, 91 rows); `evaluations` replaces both numbers. All have as many weights, reference
directions and rows in the population, and our archive has no more. The rivals keep pymoo's
settings; ours were chosen with these problems in view, one setting for each number of costs,
printed first. NSGA-II takes the problems with two costs, NSGA-III those with three.

Each returned set is measured by inverted generational distance (to 1,000 points of the front, 5,050
with three costs) and by hypervolume (reference 1.1 in each cost, 0.55 for DTLZ1). With three costs
the exact front in the directions of the weights is measured too: a set can have a lower IGD than it
without being nearer to the front. A rival is better or worse where a two-sided Mann-Whitney test of
all seeds says so at 5%. Seconds of ours are of all seeds together, without compilation, and
evaluate the problem too; the rivals' are of one core in Python. At the end a generation
is timed, in milliseconds of CPU (median of 5 runs of 300), on DTLZ2, whose own costs are next to
nothing.
"""

# pyright: reportMissingImports=false
# pymoo is of the extra `rival`

import dataclasses
import statistics
import time
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

import jax
import numpy as np
import pymoo
from jaxtyping import Float
from numpy import ndarray
from pymoo.algorithms.moo.moead import MOEAD
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.util.ref_dirs import get_reference_directions
from scipy.stats import mannwhitneyu

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.search import (
    ArchiveSettings,
    MoeadSettings,
    Problem,
    Recording,
    VariationSettings,
    moead,
)
from mjx_inertia.search.fronts import hypervolume, inverted_generational_distance
from parts.benchmark_problems import dtlz, dtlz_front, zdt, zdt_front

SETTINGS = {
    2: MoeadSettings(population=100, archive=ArchiveSettings(capacity=100)),
    3: MoeadSettings(
        population=91,
        variation=VariationSettings(crossover_eta=30.0),
        archive=ArchiveSettings(capacity=91, directions=True),
    ),
}
EVALUATIONS = {2: 25_000, 3: 30_000}
RIVALS = {2: ("moead", "nsga2"), 3: ("moead", "nsga3")}
DIVISIONS = {2: 99, 3: 12}
Name = Literal["zdt1", "zdt2", "zdt3", "zdt4", "zdt6", "dtlz1", "dtlz2"]
Rival = Literal["moead", "nsga2", "nsga3"]


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    seeds: int = 11
    evaluations: int = 0  # of every search; 0: `EVALUATIONS`
    problems: tuple[Name, ...] = get_args(Name)
    rivals: tuple[Rival, ...] = get_args(Rival)


@dataclasses.dataclass(frozen=True, eq=False)
class Benchmark:
    """A problem and what its results are measured against."""

    name: str  # pymoo's
    problem: Problem  # ours
    front: Float[ndarray, "m k"]  # points of it
    reference: Float[ndarray, " k"]  # of the hypervolume
    # the front in the directions of the weights, which a decomposition tends to; of three costs
    lattice: Float[ndarray, "w k"] | None = None

    @property
    def costs(self) -> int:
        """How many."""
        return len(self.reference)


def benchmark(name: str) -> Benchmark:
    """One of the seven by pymoo's name."""
    number = int(name[-1])
    if name.startswith("zdt"):
        return Benchmark(name, zdt(number), zdt_front(number), np.full(2, 1.1))
    reference = np.full(3, 0.55 if number == 1 else 1.1)
    lattice = dtlz_front(number, divisions=DIVISIONS[3])
    return Benchmark(name, dtlz(number), dtlz_front(number), reference, lattice)


def ours(task: Benchmark, evaluations: int, seeds: int) -> tuple[list[ndarray], float]:
    """Costs of the set that each seed returns, and the seconds that all took together."""
    settings = SETTINGS[task.costs]
    first = -(-settings.population // settings.children)  # generations of the first population
    generations = evaluations // settings.children - first

    def run(key: jax.Array) -> Any:
        return moead(task.problem, settings, generations, key=key, recording=Recording(snapshots=1))

    keys = jax.random.split(jax.random.key(0), seeds)
    program = jax.jit(jax.vmap(run)).lower(keys).compile()
    start = time.perf_counter()
    results = jax.block_until_ready(program(keys))
    seconds = time.perf_counter() - start
    sets = [jax.tree.map(lambda x, i=i: x[i], results).front()[1] for i in range(seeds)]
    return sets, seconds


def rival(name: str, task: Benchmark, evaluations: int, seed: int) -> Float[ndarray, "n k"]:
    """Costs of the set that one of pymoo's algorithms returns."""
    directions = get_reference_directions(
        "das-dennis", task.costs, n_partitions=DIVISIONS[task.costs]
    )
    algorithm = {
        "moead": lambda: MOEAD(directions),
        "nsga2": lambda: NSGA2(pop_size=len(directions)),
        "nsga3": lambda: NSGA3(directions, pop_size=len(directions)),
    }[name]()
    more = {} if task.costs == 2 else {"n_var": task.problem.dimension, "n_obj": task.costs}
    problem = get_problem(task.name, **more)
    return minimize(problem, algorithm, ("n_evals", evaluations), seed=seed).F


def measures(task: Benchmark, sets: list[ndarray]) -> dict[str, list[float]]:
    """IGD and hypervolume of each set."""
    return {
        "igd": [inverted_generational_distance(costs, task.front) for costs in sets],
        "hypervolume": [hypervolume(costs, task.reference) for costs in sets],
    }


def verdict(mine: list[float], other: list[float], *, less_is_better: bool) -> tuple[str, float]:
    """Whether mine are "better", "worse" or "alike", and the probability by chance."""
    p = float(mannwhitneyu(mine, other, alternative="two-sided").pvalue)
    less = statistics.median(mine) < statistics.median(other)
    return ("alike" if p >= 0.05 else "better" if less == less_is_better else "worse"), p


def compared(
    task: Benchmark, evaluations: int, seeds: int, rivals: tuple[str, ...]
) -> dict[str, Any]:
    """All methods on one problem; prints a line for each."""
    sets, seconds = ours(task, evaluations, seeds)
    mine = measures(task, sets)
    row: dict[str, Any] = {"evaluations": evaluations, "ours": _medians(mine, seconds)}
    print(f"{task.name:6} ours  {_line(row['ours'])}", flush=True)
    if task.lattice is not None:
        row["lattice"] = _medians(measures(task, [task.lattice]), 0.0)
        print(f"{task.name:6} lattice {_line(row['lattice'])}", flush=True)
    for name in (r for r in RIVALS[task.costs] if r in rivals):
        start = time.perf_counter()
        theirs = measures(task, [rival(name, task, evaluations, seed) for seed in range(seeds)])
        row[name] = _medians(theirs, time.perf_counter() - start)
        for measure in mine:
            word, p = verdict(mine[measure], theirs[measure], less_is_better=measure == "igd")
            row[name] |= {f"{measure}_ours_is": word, f"{measure}_p": float(f"{p:.2g}")}
        words = f"ours: igd {row[name]['igd_ours_is']}, hv {row[name]['hypervolume_ours_is']}"
        print(f"{task.name:6} {name} {_line(row[name])}  {words}", flush=True)
    return row


def generation_ms() -> dict[str, float]:
    """CPU time of a generation of 20 and of 91 children, three costs, and nine of 210 weights."""
    found = {}
    for costs, population, children in ((3, 91, 20), (3, 91, 91), (9, 210, 20)):
        archive = ArchiveSettings(capacity=population)
        settings = MoeadSettings(population=population, children=children, archive=archive)
        run = partial(moead, dtlz(2, costs), settings, 300, recording=Recording(snapshots=1))
        jax.block_until_ready(run(key=jax.random.key(0)))
        times = []
        for seed in range(5):
            start = time.process_time()
            jax.block_until_ready(run(key=jax.random.key(seed)))
            times.append((time.process_time() - start) / 300 * 1e3)
        name = f"costs_{costs}_weights_{population}_children_{children}"
        found[name] = round(statistics.median(times), 3)
    return found


def _medians(found: dict[str, list[float]], seconds: float) -> dict[str, float]:
    middle = {name: float(f"{statistics.median(v):.5g}") for name, v in found.items()}
    return {**middle, "seconds": round(seconds, 1)}


def _line(row: dict[str, float]) -> str:
    return f"igd {row['igd']:.5f}  hv {row['hypervolume']:.5f}  {row['seconds']:.1f} s"


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Compares on every problem."""
    seeds = options.seeds
    runtime.configure(1, float64=True)
    for count, settings in SETTINGS.items():
        print(f"{count} costs: {settings}")
    rows = {}
    for name in options.problems:
        task = benchmark(name)
        evaluations = options.evaluations or EVALUATIONS[task.costs]
        rows[name] = compared(task, evaluations, seeds, options.rivals)
    print("pymoo", pymoo.__version__, "seeds", seeds)
    speed = generation_ms()
    print("ms of CPU a generation:", speed)
    words = [
        v
        for row in rows.values()
        for r in row.values()
        if isinstance(r, dict)
        for k, v in r.items()
        if k.endswith("_ours_is")
    ]
    counts = {word: words.count(word) for word in ("better", "alike", "worse")}
    return {"seeds": seeds, **counts, "generation_ms": speed, "problems": rows}


if __name__ == "__main__":
    main()
