"""Evaluations a second of the thesis' nine objectives: this package against NumPy under pymoo.

    pip install -e ".[rival]"
    python experiments/space_speed.py [generations=20] [rival_generations=2] [repeats=5] [nodes=32]

Both compute C_f1 to C_f9 (thesis Eqs 7.17, 7.19, 7.21) of the same manoeuvre as it is printed: six
independent joints, momentum of the robot alone. The rival is the closed form in NumPy, vectorised
over the 5,001 samples of 0.01 s, one decision at a time on one core, driven by pymoo's MOEA/D with
the 210 weights that ours takes too; `rival_alone` is the same without pymoo. Ours takes `nodes`
samples of a Gauss quadrature, all cores, and MOEA/D in one compiled program. What the quadrature is
worth without the rest, `rival_same_nodes` tells: the same NumPy at our nodes. Evaluations are those
that each search says it has made. The largest relative
difference of the costs over random decisions is printed first, for each number of nodes. Both run
alternately in this process; compilation is timed apart.
"""

# pyright: reportMissingImports=false
# pymoo is of the extra `rival`

import dataclasses
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pymoo
from jaxtyping import Float
from numpy import ndarray
from pymoo.algorithms.moo.moead import MOEAD
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.search import ArchiveSettings, MoeadSettings, moead
from mjx_inertia.search.decomposition import spread_weights
from mjx_inertia.search.problem import evaluate_all
from mjx_inertia.space import (
    AS_PRINTED,
    BOUND,
    THESIS,
    Manoeuvre,
    PlanarSettings,
    planar_dynamics,
    planar_manoeuvre,
    problem,
)
from mjx_inertia.space.objectives import SAMPLE_TIME
from mjx_inertia.space.quadrature import Rule

SAMPLES = 5001
WEIGHTS = 210  # of nine costs: a lattice of two layers
CHECKED = 200  # random decisions


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    generations: int = 20  # of our MOEA/D in one run
    rival_generations: int = 2  # of pymoo's
    repeats: int = 5  # of both, in turn
    nodes: int = 32  # of our quadrature


class Rival:
    """The nine objectives in NumPy, at samples of which every norm is a weighted sum."""

    def __init__(self, s: PlanarSettings, m: Manoeuvre, rule: Rule | None = None) -> None:
        """Computes once what does not depend on the decision; 5,001 samples without a `rule`."""
        self.s, self.m = s, m
        # shares of the duration that are sampled, and how many samples each stands for
        self.tau, self.counts = np.linspace(0.0, 1.0, SAMPLES), np.ones(SAMPLES)
        self.weights = np.ones(SAMPLES) / (SAMPLES - 1)  # in an integral over `tau`
        self.weights[[0, -1]] /= 2.0
        if rule is not None:
            self.tau, self.weights = rule.nodes, rule.weights
            self.counts = rule.weights * m.duration / SAMPLE_TIME
        self.powers = np.vander(self.tau, 8, increasing=True)
        start, end = (np.asarray(q, np.float64) for q in (m.q_start, m.q_end))
        lower, upper = np.asarray(m.robot.lower), np.asarray(m.robot.upper)
        self.half, self.middle = (upper - lower) / 2.0, (upper + lower) / 2.0
        self.ends = [np.arcsin((q - self.middle) / self.half) for q in (start, end)]
        terms = [planar_dynamics.planar_terms(s, np.zeros(1), q[None], np) for q in (start, end)]
        self.com = [np.array([t.H[0, 1, 2], -t.H[0, 0, 2]]) / t.H[0, 0, 0] for t in terms]
        self.hands = terms[1].hands[0]
        self.wanted = self._hands_at(0.0)

    def costs(self, decision: Float[ndarray, "12"]) -> Float[ndarray, "9"]:
        """C_f1 to C_f9 of one decision."""
        q, qd, qdd = self._joints(decision.reshape(6, 2))
        terms = planar_dynamics.planar_terms(self.s, np.zeros(len(q)), q, np)
        J_a = planar_dynamics.planar_momentum_map(terms, np)
        base = _product(J_a, qd)
        wrench = self._wrench(terms, J_a, np.concatenate([base, qd], -1), qdd)
        theta = float(self.weights @ base[:, 2]) * self.m.duration
        error = self._hands_at(theta) - self.wanted
        drift = [*np.abs(self._base_at(theta)), abs(theta)]
        return np.array([*np.sqrt(self.counts @ wrench**2), *drift, *np.sqrt((error**2).sum(0))])

    def _joints(self, free: Float[ndarray, "6 2"]) -> list[Float[ndarray, "5001 6"]]:
        """Eqs 7.12 to 7.15: positions, rates, accelerations."""
        p, q = free.T
        way = self.ends[1] - self.ends[0]
        zero = np.zeros(6)
        rows = [self.ends[0], zero, zero, 10 * way - p - 3 * q, -15 * way + 3 * p + 8 * q,
                6 * way - 3 * p - 6 * q, p, q]  # fmt: skip
        polynomial, power = np.stack(rows), np.arange(8)[:, None]
        slope = (power * polynomial)[1:] / self.m.duration
        curvature = (power[:-1] * slope)[1:] / self.m.duration
        s, rate, gain = (self.powers[:, : len(c)] @ c for c in (polynomial, slope, curvature))
        sine, cosine = self.half * np.sin(s), self.half * np.cos(s)
        return [self.middle + sine, cosine * rate, cosine * gain - sine * rate**2]

    def _wrench(
        self,
        terms: planar_dynamics.PlanarTerms,
        J_a: Float[ndarray, "t 3 6"],
        rates: Float[ndarray, "t 9"],
        qdd: Float[ndarray, "t 6"],
    ) -> Float[ndarray, "t 3"]:
        """F_tot of Eq. 7.9 in the object's axes."""
        velocity = planar_dynamics.velocity_terms(self.s, terms, rates, np)
        reduced = planar_dynamics.reduced_terms(terms, velocity, J_a, np)
        torque = _product(reduced.H_el, qdd) + reduced.c_el
        hands = np.linalg.solve(np.swapaxes(reduced.J_g, -1, -2), torque[..., None])[..., 0]
        angle = terms.hands[:, 0, 2]
        sine, cosine = np.sin(angle), np.cos(angle)
        place = terms.hands[:, 0, :2] + self.s.object_radius * np.stack([-sine, cosine], -1)
        total = _product(planar_dynamics.planar_grasp_map(place, terms.hands, np), hands)
        pulled = velocity.c[:, :3] + _product(terms.H[:, :3, 3:], qdd)
        gain = -np.linalg.solve(terms.H[:, :3, :3], pulled[..., None])[..., 0]
        H, c = planar_dynamics.object_terms(self.s, terms, rates, np)
        load = (_product(H, np.concatenate([gain, qdd], -1)) + c)[:, :3]
        load[:, 2] -= place[:, 0] * load[:, 1] - place[:, 1] * load[:, 0]  # about the CoM
        x, y, moment = (total + load).T
        # the object's x axis points against the right hand's y
        return np.stack([sine * x - cosine * y, cosine * x + sine * y, moment], -1)

    def _base_at(self, theta: float) -> Float[ndarray, "2"]:
        """The base when it has turned by `theta`: the centre of mass has not moved."""
        return self.com[0] - _turned(theta, self.com[1])

    def _hands_at(self, theta: float) -> Float[ndarray, "2 3"]:
        place = _turned(theta, self.hands[:, :2]) + self._base_at(theta)
        return np.concatenate([place, self.hands[:, 2:] + theta], -1)


def _product(matrix: Float[ndarray, "t a b"], vector: Float[ndarray, "t b"]) -> ndarray:
    return (matrix @ vector[..., None])[..., 0]


def _turned(angle: float, points: Float[ndarray, "*n 2"]) -> Float[ndarray, "*n 2"]:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


class Posed(ElementwiseProblem):
    """A rival's objectives as pymoo's problem."""

    def __init__(self, rival: Rival) -> None:
        """Bounds as in the thesis."""
        super().__init__(n_var=12, n_obj=9, xl=-BOUND, xu=BOUND)
        self.rival = rival

    def _evaluate(self, x: Float[ndarray, "12"], out: dict, *_: object, **__: object) -> None:
        costs = self.rival.costs(x)
        out["F"] = np.where(np.isfinite(costs), costs, 1e9)


def timed(run: Callable[[], object]) -> float:
    """Seconds of a run."""
    start = time.perf_counter()
    jax.block_until_ready(run())
    return time.perf_counter() - start


def differences(
    rival: Rival, m: Manoeuvre, counts: Sequence[int]
) -> dict[int, tuple[float, float]]:
    """For numbers of nodes the largest relative difference of a cost, and the share compared.

    Compared are random decisions that the quadrature calls resolved at this number.
    """
    rng = np.random.default_rng(0)
    decisions = rng.uniform(-BOUND, BOUND, (CHECKED, 12))
    expected = np.stack([rival.costs(x) for x in decisions])
    # drifts and errors that nearly vanish are compared with a hundredth of their usual size
    scale = np.maximum(np.abs(expected), np.median(np.abs(expected), 0) * 1e-2)
    found = {}
    for count in counts:
        posed = problem(m.replace(nodes=count), THESIS)
        costs, off = map(np.asarray, jax.jit(jax.vmap(posed.evaluate))(jnp.asarray(decisions)))
        good = off == 0.0
        apart = np.abs(costs - expected)[good] / scale[good]
        found[count] = float(apart.max(initial=0.0)), float(good.mean())
    return found


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Prints the differences and the speeds."""
    runtime.configure(float64=True)
    settings = PlanarSettings()
    m = planar_manoeuvre(AS_PRINTED, settings).replace(nodes=options.nodes)
    rival = Rival(settings, m)
    print(f"pymoo {pymoo.__version__}, numpy {np.__version__}")
    found = differences(rival, m, sorted({20, 24, 32, 40, options.nodes}))
    for nodes, (off, share) in found.items():
        print(f"{nodes} nodes: largest relative difference {off:.1e} of the {share:.1%} resolved")

    posed = problem(m, THESIS)
    weights = spread_weights(9, WEIGHTS)
    size = len(weights)
    ours = MoeadSettings(population=size, children=size, archive=ArchiveSettings(size))
    made = {"ours": 0, "rival": 0, "rival_same_nodes": 0}

    def go() -> None:
        result = moead(posed, ours, options.generations, key=jax.random.key(0))
        made["ours"] = int(result.evaluations)

    def theirs(name: str, rival: Rival, seed: int) -> None:
        algorithm = MOEAD(weights, n_neighbors=20, prob_neighbor_mating=0.9)
        stop = ("n_gen", options.rival_generations)
        done = minimize(Posed(rival), algorithm, stop, seed=seed).algorithm
        assert done is not None
        made[name] = done.evaluator.n_eval

    first = timed(go)
    batch = jnp.asarray(np.random.default_rng(1).uniform(-BOUND, BOUND, (20_000, 12)))
    many = jax.jit(lambda decisions: evaluate_all(posed, decisions))
    alone_first = timed(lambda: many(batch))
    queue = iter(np.asarray(batch))
    few = Rival(settings, m, m.rule)
    names = ("ours", "ours_alone", "rival", "rival_alone", "rival_same_nodes",
             "rival_same_nodes_alone")  # fmt: skip
    run: dict[str, list[float]] = {name: [] for name in names}
    for seed in range(options.repeats):
        run["ours"].append(timed(go))
        run["ours_alone"].append(timed(lambda: many(batch)))
        for name, other, count in (("rival", rival, 50), ("rival_same_nodes", few, 500)):
            run[name].append(timed(lambda n=name, o=other, k=seed: theirs(n, o, k)))
            run[f"{name}_alone"].append(
                timed(lambda o=other, c=count: [o.costs(next(queue)) for _ in range(c)])
            )
    made |= {"ours_alone": len(batch), "rival_alone": 50, "rival_same_nodes_alone": 500}
    middle = {name: statistics.median(seconds) for name, seconds in run.items()}
    speed = {name: made[name] / seconds for name, seconds in middle.items()}
    for name, rate in speed.items():
        print(f"{name}: {rate:,.0f} evaluations/s")
    return {
        "experiment": "space_speed",
        **{f"{name}_evaluations_per_s": round(rate, 1) for name, rate in speed.items()},
        "ratio": round(speed["ours"] / speed["rival"], 1),
        "ratio_alone": round(speed["ours_alone"] / speed["rival_alone"], 1),
        "ratio_same_nodes": round(speed["ours"] / speed["rival_same_nodes"], 1),
        "ratio_same_nodes_alone": round(speed["ours_alone"] / speed["rival_same_nodes_alone"], 1),
        "compile_s": round(first - middle["ours"], 1),
        "compile_alone_s": round(alone_first - middle["ours_alone"], 1),
        "largest_relative_difference": found[options.nodes][0],
    }


if __name__ == "__main__":
    main()
