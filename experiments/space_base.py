"""What moves the base of the space robot, and what does not (errata 30).

    python experiments/space_base.py [generations=250] [spatial_generations=50] [seed=0]
                                     [robots=[planar,servicer]]

Without momentum the centre of mass stays, so where the base ends follows from the joints' end and
from its own attitude, whatever the way there. For each robot: the base's translation over random
decisions with one end; then the same joints' end freed while the object's target stays (`arrive`,
and elbows that swing where arms have them), searched by MOEA/D for translation against turn. For
the planar robot also a bound: the least translation over all attitudes and both elbows of each arm.
"""

import dataclasses
import itertools
from pathlib import Path
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.search import MoeadSettings, moead
from mjx_inertia.space import (
    BOUND,
    Manoeuvre,
    ManoeuvreSettings,
    PlanarSettings,
    base_at,
    end_configuration,
    planar_manoeuvre,
    problem,
    servicer_manoeuvre,
)

DECISIONS = 512
NEAR = 2e-3  # m: so near to its target the object counts as arrived
TURNS = np.linspace(-0.8, 0.8, 161)  # rad
Robot = Literal["planar", "servicer"]
# of the servicer: share of the coefficients' box, and rad of its elbows
SHARE, SWING = 0.2, 3.0


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    generations: int = 250  # of MOEA/D for the planar robot
    spatial_generations: int = 50  # the same for the servicer
    seed: int = 0  # of the searches
    robots: tuple[Robot, ...] = ("planar", "servicer")


def one_end(m: Manoeuvre, share: float) -> dict[str, Any]:
    """The base over random decisions within a share of the box; the joints' end is one."""
    decisions = share * np.random.default_rng(0).uniform(-BOUND, BOUND, (DECISIONS, m.size))
    decisions[0] = 0.0
    posed = problem(m, ("base_distance", "base_turn"))
    costs, off = map(np.asarray, jax.jit(jax.vmap(posed.evaluate))(jnp.asarray(decisions)))
    good = costs[off == 0.0]
    still = base_at(m, np.eye(3), jnp.asarray(m.q_end)).translation
    arrived = problem(m, ("base_distance", "base_turn", "hand_distance"), arrive=True)
    return {
        "straight_m": float(costs[0, 0]),
        "straight_arriving_m_rad_m": jax.jit(arrived.evaluate)(jnp.zeros(m.size)).costs.tolist(),
        "at_no_turn_m": float(np.linalg.norm(still)),
        "fixed_end_m": [float(good[:, 0].min()), float(good[:, 0].max())],
        "fixed_end_turn_rad": [float(good[:, 1].min()), float(good[:, 1].max())],
    }


def freed_end(
    m: Manoeuvre, generations: int, seed: int, share: float, swing: float
) -> Float[ndarray, "n 2"]:
    """Translation (m) and turn (rad) of the base when the joints' end is free, not its target."""
    limits = {"hand_distance": NEAR}
    posed = problem(m, ("base_distance", "base_turn"), bounds=limits, arrive=True, swing=swing)
    scale = np.concatenate([np.full(m.size, share), np.ones(len(posed.upper) - m.size)])
    posed = dataclasses.replace(posed, lower=scale * posed.lower, upper=scale * posed.upper)
    result = moead(posed, MoeadSettings(), generations, key=jax.random.key(seed))
    return result.front()[1]


def bounds(m: Manoeuvre) -> dict[str, list[float]]:
    """Least translation (m) of the planar base over its attitudes, and where (rad), by elbows.

    Whatever the joints do on the way: arms of three joints have two ends for one hand's pose.
    """

    @jax.jit
    def at(turn: Float[Array, ""], near: Float[Array, "6"]) -> Float[Array, ""]:
        c, s = jnp.cos(turn), jnp.sin(turn)
        rotation = jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        q, off = end_configuration(m.replace(q_end=near), rotation, 60)
        within = (off < 1e-9) & jnp.all((q >= m.robot.lower) & (q <= m.robot.upper))
        distance = jnp.linalg.norm(base_at(m, rotation, q).translation)
        return jnp.where(within, distance, jnp.inf)

    found = {}
    for inward in itertools.product((False, True), repeat=2):
        near = np.array(m.q_end)
        for arm in np.flatnonzero(inward):
            near[3 * arm : 3 * arm + 3] = [-0.3, -near[3 * arm + 1], 2.2]
        name = ", ".join(
            f"{side} {'inward' if flip else 'outward'}"
            for side, flip in zip(("right", "left"), inward, strict=True)
        )
        distances = [float(at(turn, near)) for turn in TURNS]
        best = int(np.argmin(distances))
        found[name] = [distances[best], float(TURNS[best])]
    return found


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Runs the robots."""
    runtime.configure(float64=True)
    figures: dict[str, Any] = {"experiment": "space_base"}
    for name in options.robots:
        if name == "planar":
            m = planar_manoeuvre(ManoeuvreSettings(), PlanarSettings(link_inertia="physical"))
            how = (options.generations, options.seed, 1.0, 0.0)
        else:
            m = servicer_manoeuvre()
            how = (options.spatial_generations, options.seed, SHARE, SWING)
        found = one_end(m, how[2])
        if m.robot.planar:
            found["least_of_any_end_m_at_rad"] = bounds(m)
        front = freed_end(m, *how)
        some = np.unique(np.linspace(0, len(front) - 1, 8).astype(int))
        found["freed_end_m_rad"] = front[some].tolist()
        figures[name] = found | {"freed_end_least_m": float(front[:, 0].min())}
        print(f"\n{m.robot.name}")
        for key, value in figures[name].items():
            print(f"  {key}: {value}")
    return figures


if __name__ == "__main__":
    main()
