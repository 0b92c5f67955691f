"""A manoeuvre that spares the captured object: `python -m mjx_inertia.space`."""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy import ndarray

from mjx_inertia.command import Parser, aligned, run_command
from mjx_inertia.search import (
    MoeadSettings,
    Problem,
    SearchResult,
    StrategySettings,
    evolution_strategies,
    moead,
    toward,
)
from mjx_inertia.space.animation import save_animation
from mjx_inertia.space.capture import MOMENTA
from mjx_inertia.space.default_manoeuvres import START, TARGET, planar_manoeuvre
from mjx_inertia.space.figures import fronts_figure, parallel_figure, path_figure
from mjx_inertia.space.manoeuvre import Manoeuvre
from mjx_inertia.space.manoeuvre_path import path
from mjx_inertia.space.manoeuvre_planning import MOTIONS, ManoeuvreSettings
from mjx_inertia.space.objectives import OBJECTIVES, THESIS, problem, with_object_at_target
from mjx_inertia.space.planar_model import PlanarSettings

ALONE = StrategySettings(weights=1, population=20)  # CMA-ES on one cost


def main(arguments: Sequence[str] | None = None) -> int:
    """Searches, prints a table, writes the figures; returns the exit status."""
    return run_command(_parser(), _run, arguments)


def _run(given: argparse.Namespace) -> None:
    folder = Path(given.out)
    _check(given, folder)
    settings = ManoeuvreSettings(
        duration=given.duration, motion=given.motion, momentum=given.momentum
    )
    figures = PlanarSettings(object_mass=given.mass, link_inertia=given.link_inertia)
    m = planar_manoeuvre(settings, figures, tuple(given.start), tuple(given.target))
    arrive = given.motion == "consistent" and not given.no_arrive
    start = time.perf_counter()
    posed = problem(m, given.objectives, arrive=arrive)
    key, count = jax.random.key(given.seed), len(given.objectives)
    # what is searched and what is shown beside it, as one program
    shown = [*given.objectives, *(name for name in THESIS if name not in given.objectives)]
    measured = jax.jit(problem(m, shown, arrive=arrive).evaluate)
    before = np.asarray(measured(jnp.zeros(m.size)).costs)
    straight = before[:count]
    result = _searched(posed, given.generations, key)
    decisions, costs = result.front()
    wish = np.where(straight > 0.0, straight, 1.0)
    aimed = evolution_strategies(toward(posed, wish), ALONE, given.generations, key=key)
    candidates, shares = aimed.front()
    evaluations, seconds = int(result.evaluations + aimed.evaluations), time.perf_counter() - start
    if not len(costs) or not len(shares):
        raise ValueError(
            f"one of two searches ({evaluations} decisions) found none that holds the object all "
            "the way within the joints' limits; give more --generations, another --target or "
            "--motion independent"
        )
    decision, share = jnp.asarray(candidates[0]), shares[0]
    after = np.asarray(measured(decision).costs)
    nine = [shown.index(name) for name in THESIS]
    print(
        f"{m.robot.name}, {given.motion} joints, momentum of the {given.momentum}, link inertia "
        f"{given.link_inertia}, {'arriving at the target' if arrive else 'end for no turn'}: "
        f"{evaluations} evaluations in {seconds:.0f} s, {len(costs)} on the front of "
        f"{', '.join(given.objectives)}; chosen for the least of its worst share of the straight "
        f"quintic, {share[0]:.3f}:"
    )
    print(_table(before[nine], after[nine]))
    folder.mkdir(parents=True, exist_ok=True)
    _draw(folder, with_object_at_target(m, decision) if arrive else m, decision)
    rows = np.vstack([decisions, candidates[:1]]), np.vstack([costs, after[:count]])
    _write(folder, posed, rows, straight)
    print(f"figures: {folder}")


def _check(given: argparse.Namespace, folder: Path) -> None:
    """Before the work, which takes its time."""
    _check_writable(folder)
    if given.generations < 1:
        raise ValueError(f"--generations {given.generations}: expected 1 or more")
    if not 0 <= given.seed < 2**32:
        raise ValueError(f"--seed {given.seed}: expected a number from 0 to {2**32 - 1}")
    if len(set(given.objectives)) < len(given.objectives):
        raise ValueError(f"--objectives {' '.join(given.objectives)}: expected each once")
    if tuple(given.start) == tuple(given.target):
        raise ValueError("--start and --target are the same: there is nothing to do")


def _searched(posed: Problem, generations: int, key: Array) -> SearchResult:
    """MOEA/D, or of one cost alone CMA-ES."""
    if len(posed.cost_names) > 1:
        return moead(posed, MoeadSettings(), generations, key=key)
    return evolution_strategies(posed, ALONE, generations, key=key)


def _table(straight: Float[ndarray, "9"], best: Float[ndarray, "9"]) -> str:
    rows = [("", "straight quintic", "chosen")]
    for name, before, after in zip(THESIS, straight, best, strict=True):
        rows.append((name, f"{before:.4g}", f"{after:.4g}"))
    return "\n".join(aligned(rows))


def _draw(folder: Path, m: Manoeuvre, decision: Float[Array, " c"]) -> None:
    drawn = path(m, decision, np.linspace(0.0, 1.0, 241))
    path_figure(m.robot, drawn).savefig(folder / "path.svg")
    save_animation(folder / "manoeuvre.gif", m, drawn[::4])


def _write(
    folder: Path,
    posed: Problem,
    front: tuple[Float[ndarray, "n c"], Float[ndarray, "n k"]],
    straight: Float[ndarray, " k"],
) -> None:
    """The front, with what was chosen as its last row."""
    (decisions, costs), names = front, posed.cost_names
    if len(names) >= 3:
        baseline = dict(zip(names, straight, strict=True))
        pairs = {"front": (names[:3], costs[:, :3])}
        fronts_figure(pairs, baseline).savefig(folder / "front.svg")
    shown = parallel_figure(costs, names, {"chosen": len(costs) - 1}, straight)
    shown.savefig(folder / "parallel.svg")
    np.savez(folder / "front.npz", decisions=decisions, costs=costs, names=np.array(names))


def _check_writable(folder: Path) -> None:
    places = folder.absolute(), *folder.absolute().parents
    place = next(place for place in places if place.exists())
    if not place.is_dir() or not os.access(place, os.W_OK):
        raise OSError(f"{folder}: cannot be written; expected a folder, or a new one in a folder")


def _parser() -> Parser:
    parser = Parser(
        prog="python -m mjx_inertia.space",
        description="Searches joint motions of the planar space robot, and draws what it finds.",
    )
    add = parser.add_argument
    add("--motion", default="consistent", choices=MOTIONS, help="independent: as in the thesis")
    add("--momentum", default="system", choices=MOMENTA, help="robot: as in the thesis")
    add("--link-inertia", default="physical", help="table (as printed) or physical")
    add("--objectives", nargs="+", default=["force", "moment", "base_turn"], metavar="NAME",
        help=f"costs to weigh, of {', '.join(OBJECTIVES)}")  # fmt: skip
    for name, pose in (("start", START), ("target", TARGET)):
        add(f"--{name}", type=float, nargs=3, default=pose, metavar=("X", "Y", "ANGLE"),
            help="of the object, m and rad, in the base as it starts")  # fmt: skip
    add("--mass", type=float, default=10.0, help="of the object, kg")
    add("--duration", type=float, default=50.0, help="s")
    add(
        "--generations",
        type=int,
        default=300,
        help="of MOEA/D, 20 decisions each, after the first 100",
    )
    add("--no-arrive", action="store_true",
        help="consistent motion: end for a base that has not turned")  # fmt: skip
    add("--seed", type=int, default=0, help="of the search")
    add("--out", default="space_manoeuvre", help="folder for figures and the front")
    return parser


if __name__ == "__main__":
    sys.exit(main())
