"""Metrics that disagree on the best grasp (thesis ch. 6, Figs 6.3 and 6.4), and what to do then.

    python experiments/grasp_conflict.py [grasps=5000] [seed=0]

Baxter's left arm carries the cuboid of 0.4 kg through the three pick-and-place tasks, held at ten
places along its top edge: manipulability, effective mass and torque energy of each, and where they
disagree. Then grasps sampled all over the cuboid for a jaw that opens 0.21 m: the Pareto front of
the three metrics with its hypervolume, a map of the energy over the surface, and the choice when
the payload is known only as a distribution. Figures: ten_grasps, front, map.
"""

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.grasping import (
    PARALLEL_JAW_80MM,
    TASKS,
    Contacts,
    GraspCosts,
    GraspMotion,
    GraspStatus,
    PayloadBelief,
    SoftFinger,
    belief_of_ten_numbers,
    draw_payloads,
    evaluate_grasps,
    grasp_costs,
    greatest_gripping_force,
    hands_of,
    linear_cost,
    object_path,
    regret,
    sample_grasps,
    sampled_cost,
)
from mjx_inertia.objects import ObjectModel, load_catalogue
from mjx_inertia.robots import Robot, baxter
from mjx_inertia.search.fronts import hypervolume, knee, pareto_set
from mjx_inertia.spatial import InertialParameters, Pose

METRICS = ("inverse_manipulability", "effective_mass", "energy")
PLACE = (0.6, 0.25, -0.2)  # of the cuboid's base, in the robot's frame
ALONG = np.linspace(-0.22, 0.22, 10)  # m from the middle of the top edge (errata 19)
WIDE = dataclasses.replace(PARALLEL_JAW_80MM, name="wide jaw", open_width=0.21)
CARRY = "pick_and_place_2"
PAD = SoftFinger(friction=0.5)
UNCERTAIN = 400  # grasps of the robust choice
# standard deviations: of the mass, relative; of the CoM, m; of the tensor, relative to its trace
DOUBT = {"mass": 0.05, "com": 0.02, "inertia": 0.05}


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    grasps: int = 5000  # sampled
    seed: int = 0  # of grasps and payloads


def cuboid() -> tuple[ObjectModel, Pose]:
    """The object, and its pose at the start: the long side along y."""
    model = load_catalogue("cuboid")["cuboid"]
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    long_in_x = model.half_extents[0] > model.half_extents[1]
    return model, Pose(turned if long_in_x else np.eye(3), np.array(PLACE))


def top_grasps(model: ObjectModel, start: Pose) -> Pose:
    """Ten hands above the top edge, 2 cm deep, that close across the short side."""
    down = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    world = [Pose(down, np.array([PLACE[0], PLACE[1] + y, PLACE[2] + model.height - 0.02]))
             for y in ALONG]  # fmt: skip
    hands = [start.inverse() @ pose for pose in world]
    return jax.tree.map(lambda *x: jnp.stack([jnp.asarray(v) for v in x]), *hands)


def ten_grasps(arm: Robot, model: ObjectModel, start: Pose, folder: Path) -> dict[str, Any]:
    """Figs 6.3 and 6.4: the metrics over their maxima, and the best grasp by each."""
    body = jax.tree.map(np.asarray, model.inertial)
    hands = top_grasps(model, start)
    figure, axes = plt.subplots(1, 4, figsize=(17, 4), layout="constrained")
    result: dict[str, Any] = {}
    for number, axis in enumerate(axes[:3], start=1):
        task = f"pick_and_place_{number}"
        path = object_path(TASKS[task], start, body.com)
        found = evaluate_grasps(arm, body, hands, path, metrics=METRICS)
        costs = np.asarray(found.costs)
        share = costs / np.nanmax(costs, axis=0)
        print(f"{task}: grasp, {', '.join(METRICS)} (over the greatest), status")
        for i, (row, status) in enumerate(zip(share, found.status, strict=True), start=1):
            print(f"  {i:2} {row[0]:.3f} {row[1]:.3f} {row[2]:.3f} {GraspStatus(int(status)).name}")
        best = {m: int(np.nanargmin(share[:, i])) + 1 for i, m in enumerate(METRICS)}
        spread = 100 * (np.nanmax(costs, axis=0) / np.nanmin(costs, axis=0) - 1)
        result[task] = {
            "best": best,
            "conflict": len(set(best.values())) > 1,
            "spread_percent": dict(zip(METRICS, spread.round(1).tolist(), strict=True)),
            "failed": int(np.sum(np.asarray(found.status) != GraspStatus.OK)),
        }
        for i, metric in enumerate(METRICS):
            axis.plot(np.arange(1, 11), share[:, i], "o-", label=metric)
        axis.set(xlabel="grasp", title=task)
    axes[0].legend(fontsize=8)
    image = axes[3].imshow(np.asarray(found.signals.effective_mass), aspect="auto")
    axes[3].set(xlabel="waypoint", ylabel="grasp", title="effective mass, task 3")
    figure.colorbar(image, ax=axes[3], label="kg")
    save(figure, folder / "ten_grasps.png")
    return result


def many_grasps(
    arm: Robot, model: ObjectModel, start: Pose, options: Options, folder: Path
) -> tuple[dict[str, Any], GraspCosts, tuple[Pose, Contacts]]:
    """The Pareto front of sampled grasps and a map of the energy over the surface."""
    begin = time.perf_counter()
    sample = sample_grasps(model, WIDE, options.grasps, seed=options.seed)
    sampling_s = time.perf_counter() - begin
    hands = hands_of(sample.grasps, WIDE)
    body = jax.tree.map(np.asarray, model.inertial)
    path = object_path(TASKS[CARRY], start, body.com)
    begin = time.perf_counter()
    found = evaluate_grasps(arm, body, hands, path, metrics=METRICS)
    jax.block_until_ready(found.costs)
    first_s = time.perf_counter() - begin
    usable = found.usable()
    fine = np.isfinite(usable[:, 0])
    front = pareto_set(usable)
    worst = usable[fine].max(axis=0)
    share = usable / worst
    draw_front(share, front, fine, folder)
    points = np.asarray(sample.grasps.contacts.points).mean(axis=1)
    draw_map(model, points[fine], usable[fine, METRICS.index("energy")], folder)
    middle = knee(usable)
    statuses = np.bincount(np.asarray(found.status), minlength=len(GraspStatus))
    result = {
        "grasps": len(points),
        "statuses": {s.name: int(statuses[s]) for s in GraspStatus if statuses[s]},
        "front": len(front),
        "hypervolume": round(float(hypervolume(share[front], np.ones(len(METRICS)))), 4),
        "spread_percent": dict(
            zip(
                METRICS,
                (100 * (worst / usable[fine].min(axis=0) - 1)).round(1).tolist(),
                strict=True,
            )
        ),
        "knee_over_best": (usable[middle] / usable[fine].min(axis=0)).round(4).tolist(),
        "sampling_s": round(sampling_s, 2),
        "planning_and_metrics_first_s": round(first_s, 2),
    }
    return result, found, (hands, sample.grasps.contacts)


def robust_choice(
    arm: Robot,
    model: ObjectModel,
    start: Pose,
    found: GraspCosts,
    sampled: tuple[Pose, Contacts],
    seed: int,
) -> dict[str, Any]:
    """Choices of least energy and of least gripping force when the payload is a distribution."""
    hands, contacts = sampled
    rows = np.flatnonzero(np.asarray(found.status) == GraspStatus.OK)[:UNCERTAIN]
    motions, some = jax.tree.map(lambda x: x[rows], (found.motion, hands))
    body = jax.tree.map(lambda x: jnp.asarray(x, float), model.inertial)
    trace = float(jnp.trace(body.inertia))
    deviations = np.array(
        [DOUBT["mass"] * float(body.mass), *[DOUBT["com"]] * 3, *[DOUBT["inertia"] * trace] * 6]
    )
    belief = belief_of_ten_numbers(body, np.diag(deviations**2))

    holds = jax.tree.map(lambda x: x[rows], contacts)
    path = object_path(TASKS[CARRY], start, body.com)

    @jax.jit
    def energy(payload: InertialParameters) -> Array:
        def one(hand: Pose, motion: GraspMotion) -> Array:
            return grasp_costs(arm, payload, hand, motion, ("energy",))[0][0]

        return jax.vmap(one)(some, motions)

    def squeeze(payload: InertialParameters) -> Array:
        return greatest_gripping_force(holds, PAD, payload, path, arm.gravity)

    key = jax.random.key(seed)
    return {
        "grasps": len(rows),
        "energy": judged(energy, body, belief, key),
        "gripping_force": judged(squeeze, body, belief, key),
    }


def judged(
    cost: Callable[[InertialParameters], Array],
    body: InertialParameters,
    belief: PayloadBelief,
    key: Array,
) -> dict[str, Any]:
    """Choices by several rules, their regret, and how good an estimate must be."""
    linear = linear_cost(cost, belief, second_order=True)
    sampled = sampled_cost(cost, belief, key=key, count=300)
    choices = {
        "center": cost(body), "mean": sampled.mean, "quantile": sampled.quantile,
        "worst": sampled.worst,
    }  # fmt: skip
    first, second = jax.random.split(jax.random.fold_in(key, 1))
    truths = np.asarray(jax.lax.map(cost, draw_payloads(belief, 300, key=first)))
    chosen = {name: int(np.argmin(np.asarray(value))) for name, value in choices.items()}
    lost = {name: 100 * (truths[:, row] / truths.min(axis=1) - 1) for name, row in chosen.items()}
    by_error = {}
    for scale in (0.1, 0.2, 0.5, 1.0, 2.0):
        wide = belief.replace(covariance=belief.covariance * scale**2)
        wrong = jax.lax.map(cost, draw_payloads(wide, 200, key=second))
        relative = regret(wrong, cost(body)).relative
        by_error[str(scale)] = round(100 * float(jnp.quantile(relative, 0.95)), 3)
    return {
        "linear_over_sampled_std_median": round(float(jnp.median(linear.std / sampled.std)), 4),
        "linear_minus_sampled_mean_percent": round(
            100 * float(jnp.median(jnp.abs(linear.mean / sampled.mean - 1))), 4
        ),
        "chosen_row": chosen,
        "regret_mean_percent": {n: round(float(v.mean()), 3) for n, v in lost.items()},
        "regret_p95_percent": {n: round(float(np.quantile(v, 0.95)), 3) for n, v in lost.items()},
        "regret_p95_percent_by_error_scale": by_error,
    }


def draw_front(share: np.ndarray, front: np.ndarray, fine: np.ndarray, folder: Path) -> None:
    """All grasps and the front, by pairs of metrics."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    for axis, (i, j) in zip(axes, ((0, 1), (1, 2), (0, 2)), strict=True):
        axis.scatter(share[fine, i], share[fine, j], s=3, color="0.7")
        axis.scatter(share[front, i], share[front, j], s=10, color="tab:red")
        axis.set(xlabel=METRICS[i], ylabel=METRICS[j])
    save(figure, folder / "front.png")


def draw_map(model: ObjectModel, points: np.ndarray, energy: np.ndarray, folder: Path) -> None:
    """Where to hold the object, coloured by the energy."""
    figure = plt.figure(figsize=(7, 5))
    axis = figure.add_subplot(projection="3d")
    faces = Poly3DCollection(np.asarray(model.mesh.triangles), alpha=0.1, facecolor="0.5")
    axis.add_collection3d(faces)
    dots = axis.scatter(*points.T, c=energy, s=6, cmap="viridis")
    figure.colorbar(dots, ax=axis, label="torque energy, (N m)²")
    axis.set(aspect="equal", xlabel="x, m", ylabel="y, m", zlabel="z, m")
    save(figure, folder / "map.png")


def save(figure: Any, path: Path) -> None:
    """Writes and closes a figure."""
    figure.savefig(path, dpi=110)
    plt.close(figure)


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Tables and figures."""
    begin = time.perf_counter()
    runtime.configure(float64=True)
    arm = baxter("left")
    model, start = cuboid()
    result = {"experiment": "grasp_conflict", **ten_grasps(arm, model, start, folder)}
    many = many_grasps(arm, model, start, options, folder)
    result["sampled"], found, sampled = many
    result["robust"] = robust_choice(arm, model, start, found, sampled, options.seed)
    return {**result, "seconds": round(time.perf_counter() - begin, 1)}


if __name__ == "__main__":
    main()
