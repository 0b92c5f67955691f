"""Whether effective mass predicts how hard a held object hits (thesis ch. 5, Figs 5.5 to 5.9).

    python experiments/grasp_safety.py [settings=20] [seed=0]

The tensor object in Baxter's right hand, with drawn settings of its five rings: one motion, and the
inertia alone differs. Then the book of 0.34 kg held at three places along its spine: the motion
differs too. Each is carried out in MuJoCo under computed-torque control into a rigid pillar with a
force sensor, and into a free-standing bottle of 0.5 kg; peak forces are set beside the effective
mass at the place of impact, and beside v √(k m). Figures: tensor, book.
"""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import spearmanr

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.grasping import (
    GraspMotion,
    Move,
    Task,
    object_path,
    plan_motion,
    signals_along_path,
)
from mjx_inertia.objects import load_catalogue
from mjx_inertia.robots import Robot, baxter, with_payload
from mjx_inertia.spatial import InertialParameters, Pose
from parts.collision import Bottle, Collision, Pillar, collide

IMPACT = 37  # of 50 waypoints: at 1.5 s of 2 s, as in the thesis
# §5.3.1: the hand goes from (1, 0, 0.03) to (1.1, -0.38, 0.16) without turning, in the base's frame
TASK = Task("carry", (Move(translation=(0.1, -0.38, 0.13), duration=2.0),))
HANDLE = 0.15  # m above the table on which the tensor object stands upright: where it is held
BOOK_PLACE = (0.62, -0.2, -0.15)
GRIPS = (-0.1, 0.0, 0.1)  # m along the spine
OBSTACLES = {"pillar": Pillar(), "bottle": Bottle()}


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    settings: int = 20  # of the rings
    seed: int = 0  # of the settings


def ring_settings(count: int, seed: int) -> list[InertialParameters]:
    """Tensor objects whose rings are drawn along their arms."""
    rng = np.random.default_rng(seed)
    names = ("handle_ring", "x_plus", "x_minus", "y_plus", "y_minus")
    bodies = []
    for _ in range(count):
        drawn = rng.uniform(0.02, 0.15, 5)
        rings = {name: float(place) for name, place in zip(names, drawn, strict=True)}
        made = load_catalogue("tensor_object", parameters={"tensor_object": rings}, cache=False)
        bodies.append(jax.tree.map(np.asarray, made["tensor_object"].inertial))
    return bodies


def tensor_motion(arm: Robot) -> tuple[GraspMotion, Pose]:
    """The handle points at the robot, and the hand along it."""
    upended = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    hand = Pose(jnp.diag(jnp.array([1.0, -1.0, -1.0])), jnp.array([0.0, 0.0, HANDLE]))
    start = Pose(upended, np.array([1.0, 0.0, 0.03]) - upended @ np.array([0.0, 0.0, HANDLE]))
    path = object_path(TASK, start, np.zeros(3))
    return jax.jit(lambda hand: plan_motion(arm, hand, path))(hand), hand


def book_motions(arm: Robot) -> tuple[InertialParameters, GraspMotion, Pose]:
    """The book on its long edge, spine up and along y, held from above."""
    book = load_catalogue("book")["book"]
    body = jax.tree.map(np.asarray, book.inertial)
    middle, half = np.asarray(book.center), np.asarray(book.half_extents)
    # its cover was up: now its length is along y, its width along z, its thickness along x
    upright = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    start = Pose(upright, np.array(BOOK_PLACE) - upright @ middle)
    down = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # closing along z
    places = middle + np.array([[x, half[1] - 0.02, 0.0] for x in GRIPS])
    hands = Pose(jnp.tile(down, (len(GRIPS), 1, 1)), jnp.asarray(places))
    path = object_path(TASK, start, body.com)
    return body, jax.jit(jax.vmap(lambda hand: plan_motion(arm, hand, path)))(hands), hands


def run(
    arm: Robot, body: InertialParameters, motion: GraspMotion, hand: Pose
) -> tuple[np.ndarray, dict[str, Collision]]:
    """Effective mass along the way, and what each obstacle felt."""
    held = with_payload(arm, body, hand.inverse())
    mass = np.asarray(signals_along_path(held, motion).effective_mass)
    found = {name: collide(held, motion, what, IMPACT) for name, what in OBSTACLES.items()}
    return mass, found


def table(name: str, masses: np.ndarray, hits: list[dict[str, Collision]]) -> dict[str, Any]:
    """Prints a line for each case; correlations, spreads and errors of the prediction."""
    at_impact = masses[:, IMPACT]
    result: dict[str, Any] = {}
    for obstacle, what in OBSTACLES.items():
        peak = np.array([hit[obstacle].peak_force for hit in hits])
        speed = np.array([hit[obstacle].speed for hit in hits])
        felt = at_impact
        if isinstance(what, Bottle):  # both bodies move: the reduced mass
            felt = at_impact * what.mass / (at_impact + what.mass)
        predicted = speed * np.sqrt(what.stiffness * felt)
        print(f"{name}, {obstacle}: effective mass (kg), speed (m/s), peak, predicted force (N)")
        for row in zip(at_impact, speed, peak, predicted, strict=True):
            print("  {:.4f} {:.3f} {:.2f} {:.2f}".format(*row))
        rank = float(spearmanr(predicted, peak).statistic)
        result |= {
            f"{name}_{obstacle}_spearman": round(float(spearmanr(at_impact, peak).statistic), 4),
            f"{name}_{obstacle}_spearman_predicted_force": round(rank, 4),
            f"{name}_{obstacle}_spread_percent": round(100 * (peak.max() / peak.min() - 1), 2),
            f"{name}_{obstacle}_prediction_error_percent": round(
                100 * float(np.abs(predicted / peak - 1).max()), 2
            ),
        }
    spread = 100 * (at_impact.max() / at_impact.min() - 1)
    return {**result, f"{name}_effective_mass_spread_percent": round(float(spread), 2)}


def draw(
    path: Path, time: np.ndarray, masses: np.ndarray, hits: list[dict[str, Collision]]
) -> None:
    """Heat map of the effective mass and the forces of the lightest, middle and heaviest."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    extent = (float(time[0]), float(time[-1]), len(masses) - 0.5, -0.5)
    image = axes[0].imshow(masses, aspect="auto", extent=extent, cmap="viridis")
    figure.colorbar(image, ax=axes[0], label="effective mass, kg")
    axes[0].set(xlabel="time, s", ylabel="grasp")
    order = np.argsort(masses[:, IMPACT])
    for axis, obstacle in zip(axes[1:], OBSTACLES, strict=True):
        for i in (order[0], order[len(order) // 2], order[-1]):
            hit = hits[i][obstacle]
            axis.plot(hit.time, hit.force, label=f"{masses[i, IMPACT]:.3f} kg")
        start = min(hit[obstacle].contact_time for hit in hits)
        axis.set(xlim=(start - 0.01, start + 0.09), xlabel="time, s", ylabel=f"{obstacle}, N")
        axis.legend()
    figure.savefig(path)
    plt.close(figure)


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Tables and figures."""
    start = time.perf_counter()
    runtime.configure(devices=1, float64=True)
    arm = baxter("right")
    motion, hand = tensor_motion(arm)
    bodies = ring_settings(options.settings, options.seed)
    cases = [run(arm, body, motion, hand) for body in bodies]
    masses, hits = np.stack([case[0] for case in cases]), [case[1] for case in cases]
    result = table("tensor", masses, hits)
    draw(folder / "tensor.svg", np.asarray(motion.time), masses, hits)
    body, motions, hands = book_motions(arm)
    books = [
        run(arm, body, *(jax.tree.map(lambda x, i=i: x[i], tree) for tree in (motions, hands)))
        for i in range(len(GRIPS))
    ]
    masses, hits = np.stack([case[0] for case in books]), [case[1] for case in books]
    result |= table("book", masses, hits)
    draw(folder / "book.svg", np.asarray(motions.time)[0], masses, hits)
    errors = [float(jnp.max(m.error)) for m in (motion, motions)]
    return {
        "experiment": "grasp_safety",
        "spearman_effective_mass_vs_peak_force": result["tensor_pillar_spearman"],
        "force_spread_percent": result["tensor_pillar_spread_percent"],
        **result,
        "worst_pose_error": max(errors),
        "seconds": round(time.perf_counter() - start, 1),
    }


if __name__ == "__main__":
    main()
