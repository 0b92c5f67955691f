"""Effort of holding an object one way or another (thesis ch. 4, Figs 4.5, 4.6, 4.8 and 4.9).

    python experiments/grasp_effort.py

Baxter's left arm moves the book of 0.34 kg, held at six places of its edges, through six
primitives; then the disk with four weights by its handle, at nine angles, through a piece-wise
translation and three turns. The angle is read in two ways: the hand turns about a disk that stands
still (`disk_hand`, the text of §4.5.2), and the disk is turned in a hand that stands still
(`disk_object`, which is what its explanation is about). Torques are those of the augmented
dynamics; the joints move with the least speed from the start that stays farthest from their limits
(the thesis does not say how its redundant joint moved). Beside the whole effort (Eq. 4.20), what
the payload adds to it and what remains without gravity. Figures: book, disk_hand, disk_object.
"""

import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array
from scipy.spatial.transform import Rotation

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.grasping import (
    TASKS,
    GraspMotion,
    GraspStatus,
    evaluate_grasps,
    grasp_costs,
    object_path,
)
from mjx_inertia.objects import load_catalogue
from mjx_inertia.robots import Robot, baxter
from mjx_inertia.spatial import InertialParameters, Pose

PRIMITIVES = tuple(f"{kind}_{axis}" for kind in ("translate", "rotate") for axis in "xyz")
DISK_TASKS = ("piecewise", "rotate_x", "rotate_y", "rotate_z")
ANGLES = np.arange(10, 171, 20)  # degrees, of the hand about the disk's handle
# what is lifted 10 cm stands before the robot, as far as nine grasps can carry it
BOOK_PLACE, DISK_PLACE = (0.62, 0.2, 0.02), (0.6, 0.25, -0.1)
NOTHING = 1e-9  # kg in the hand, for what the arm alone costs


def book() -> tuple[InertialParameters, Pose, Pose]:
    """The book, hands at two of its edges, and its pose at the start, on its long edge.

    Its length is then along y, its width along z. Two hands come from the side to the robot's left
    and four from above; the fingers close across the covers. The other side is out of the left
    arm's reach.
    """
    model = load_catalogue("book")["book"]
    middle, half = np.asarray(model.center), np.asarray(model.half_extents)
    upright = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    start = Pose(upright, np.array(BOOK_PLACE) - upright @ middle)
    deep = 0.02  # of the fingers over the edge
    x, y = half[:2] - deep
    side, above, closing = (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)
    grips = [((x, -0.03, 0.0), side), ((x, 0.03, 0.0), side)]
    grips += [((along, y, 0.0), above) for along in (0.08, 0.03, -0.03, -0.08)]
    rotations = [
        np.stack([np.cross(closing, approach), closing, approach], axis=1) for _, approach in grips
    ]
    places = middle + np.array([place for place, _ in grips])
    hands = Pose(jnp.asarray(np.array(rotations)), jnp.asarray(places))
    return jax.tree.map(np.asarray, model.inertial), hands, start


def disk() -> tuple[InertialParameters, Pose]:
    """The disk with weights and nine hands on its handle from above, its weights along x and y."""
    model = load_catalogue("disk_with_weights")["disk_with_weights"]
    down = np.diag([1.0, -1.0, -1.0])
    turns = Rotation.from_rotvec(np.radians(ANGLES)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    top = np.array([*np.asarray(model.center[:2]), model.height - 0.02])
    hands = Pose(jnp.asarray(turns @ down), jnp.tile(top, (len(ANGLES), 1)))
    return jax.tree.map(np.asarray, model.inertial), hands


def efforts(
    arm: Robot, body: InertialParameters, hands: Pose, tasks: tuple[str, ...], starts: list[Pose]
) -> dict[str, dict[str, np.ndarray]]:
    """Efforts by task: whole, without the payload, without gravity; torque norms over time.

    Each hand has its own pose of the object at the start.
    """
    floating = arm.replace(gravity=np.zeros(3))

    @jax.jit
    def others(hand: Pose, motion: GraspMotion) -> Array:
        rest = jax.tree.map(lambda x: NOTHING * x, body)
        loads = ((arm, rest), (floating, body))
        return jnp.stack(
            [grasp_costs(robot, load, hand, motion, ("effort",))[0][0] for robot, load in loads]
        )

    found = {}
    for name in tasks:
        rows = []
        for i, start in enumerate(starts):
            hand = jax.tree.map(lambda x, i=i: x[i : i + 1], hands)
            path = object_path(TASKS[name], start, body.com)
            cost = evaluate_grasps(arm, body, hand, path, metrics=("effort",))
            first = jax.tree.map(lambda x: x[0], (hand, cost.motion))
            bare, floats = others(*first)
            torque = np.linalg.norm(np.asarray(cost.signals.torque)[0], axis=-1)
            time = np.asarray(cost.motion.time)[0]
            rows.append((cost.costs[0, 0], bare, floats, cost.status[0], torque, time))
        names = ("whole", "arm", "floating", "status", "torque", "time")
        found[name] = {
            key: np.stack([np.asarray(x) for x in column])
            for key, column in zip(names, zip(*rows, strict=True), strict=True)
        }
    return found


def report(
    title: str, labels: list[str], found: dict[str, dict[str, np.ndarray]]
) -> dict[str, Any]:
    """Prints the efforts and returns the best and worst grasp of each task."""
    result = {}
    for task, parts in found.items():
        reached = ~np.isin(parts["status"], (GraspStatus.UNREACHED, GraspStatus.SINGULAR))
        status = [GraspStatus(s).name for s in parts["status"]]
        print(f"{title}, {task}: grasp, effort, without the object, without gravity (N m), status")
        for row in zip(
            labels, parts["whole"], parts["arm"], parts["floating"], status, strict=True
        ):
            print("  {:>6} {:10.4f} {:10.4f} {:10.5f}  {}".format(*row))

        def named(values: np.ndarray, keep: np.ndarray = reached) -> dict[str, Any]:
            values = np.where(keep, values, np.nan)
            return {
                "best": labels[int(np.nanargmin(values))],
                "worst": labels[int(np.nanargmax(values))],
                "spread_percent": round(100 * float(np.nanmax(values) / np.nanmin(values) - 1), 5),
            }

        result[task] = {
            **named(parts["whole"]),
            "payload_share": named(parts["whole"] - parts["arm"]),
            "without_gravity": named(parts["floating"]),
            "failed": int((~reached).sum()),
        }
    return result


def draw(path: Path, labels: list[str], found: dict[str, dict[str, np.ndarray]]) -> None:
    """Effort over grasps (Figs 4.6, 4.8, 4.9) and one task's torques over time (Fig. 4.5)."""
    figure, axes = plt.subplots(1, 3, figsize=(14, 4), layout="constrained")
    for axis, part, label in zip(
        axes, ("whole", "floating"), ("effort, N m", "effort without gravity, N m"), strict=False
    ):
        for task, parts in found.items():
            values = parts[part] if part == "floating" else parts[part] / parts[part].mean()
            axis.plot(labels, values, "o-", label=task)
        axis.set(xlabel="grasp", ylabel=label if part == "floating" else "effort over its mean")
    axes[0].legend(fontsize=8)
    task = "rotate_y"
    for label, torque in zip(labels, found[task]["torque"], strict=True):
        axes[2].plot(found[task]["time"][0], torque, label=label)
    axes[2].set(xlabel="time, s", ylabel=f"|torque| in {task}, N m")
    axes[2].legend(fontsize=8)
    figure.savefig(path)
    plt.close(figure)


@experiment()
def main(folder: Path) -> dict[str, Any]:
    """Tables and figures."""
    begin = time.perf_counter()
    runtime.configure(devices=1, float64=True)
    arm = baxter("left")
    result: dict[str, Any] = {"experiment": "grasp_effort"}
    cases = []
    body, hands, start = book()
    starts = [start] * len(hands.translation)
    cases.append(("book", body, hands, PRIMITIVES, starts, [str(i + 1) for i in range(6)]))
    body, hands = disk()
    still = [Pose(np.eye(3), np.array(DISK_PLACE))] * len(ANGLES)
    turned = [
        Pose(Rotation.from_euler("z", -angle, degrees=True).as_matrix(), np.array(DISK_PLACE))
        for angle in ANGLES
    ]
    labels = [str(angle) for angle in ANGLES]
    cases.append(("disk_hand", body, hands, DISK_TASKS, still, labels))
    cases.append(("disk_object", body, hands, DISK_TASKS, turned, labels))
    for name, body, hands, tasks, starts, labels in cases:
        found = efforts(arm, body, hands, tasks, starts)
        result[name] = report(name, labels, found)
        draw(folder / f"{name}.svg", labels, found)
    return {**result, "seconds": round(time.perf_counter() - begin, 1)}


if __name__ == "__main__":
    main()
