"""Grasps of an object for a task, best first: `python -m mjx_inertia.grasping`."""

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mjx_inertia.command import Parser, run_command
from mjx_inertia.files import check_writable
from mjx_inertia.grasping.grasp import BAXTER_GRIPPER, PARALLEL_JAW_80MM, Gripper
from mjx_inertia.grasping.picture import picture_of, save_picture
from mjx_inertia.grasping.ranking import CRITERIA, EPSILON, rank_grasps, ranking_table
from mjx_inertia.grasping.sampler import SamplerSettings, sample_grasps
from mjx_inertia.grasping.task_path import TASKS, object_path
from mjx_inertia.objects import ObjectModel, import_object, load_catalogue
from mjx_inertia.objects.catalogue.load import nearest
from mjx_inertia.robots import Robot, baxter, load_robot, lwa4d
from mjx_inertia.spatial import Pose

# Default position of the object, m, in the arm's world frame.
_PLACES = {
    "baxter": (0.6, 0.3, -0.1),
    "baxter_right": (0.6, -0.3, -0.1),
    "lwa4d": (0.4, 0.0, 0.2),
}
_GRIPPERS = {"baxter": BAXTER_GRIPPER, "jaw80": PARALLEL_JAW_80MM}
_IN_FRONT = 0.45  # of the stretched length of an arm from a file


def main(arguments: Sequence[str] | None = None) -> int:
    """Ranks grasps, prints the table and writes the picture; returns the exit status."""
    return run_command(_parser(), _run, arguments, devices=1)


def _run(given: argparse.Namespace) -> None:
    file = Path(given.out)
    _check_choice("task", given.task, list(TASKS))
    _check_choice("metric", given.metric, [*CRITERIA, EPSILON])
    if file.suffix != ".png":
        raise ValueError(f"{file}: expected a name that ends in .png")
    check_writable(file)
    # sample and rank
    arm, place, gripper = _arm(given)
    obj = _object(given)
    with warnings.catch_warnings():  # a short sample is said in the summary below
        warnings.simplefilter("ignore", UserWarning)
        sample = sample_grasps(
            obj,
            gripper,
            given.count,
            seed=given.seed,
            friction=given.friction,
            settings=SamplerSettings(above_table=True),
        )
    start = Pose(np.eye(3), np.array(place))
    path = object_path(TASKS[given.task], start, obj.inertial.com)
    ranking = rank_grasps(
        arm,
        obj.inertial,
        sample.grasps,
        gripper,
        path,
        metric=given.metric,
        friction=given.friction,
    )
    # table, summary, picture
    count = len(ranking.force)
    failures = ", ".join(f"{n} {name}" for name, n in ranking.failures.items())
    if not len(ranking.order):
        raise ValueError(
            f"none of {count} grasps of {obj.name} can be used: {failures}; give another --place "
            f"(now {' '.join(map(str, place))} m), --task or --count"
        )
    print(
        f"{arm.name} holds {obj.name} ({float(obj.inertial.mass):.3g} kg) with {gripper.name}; "
        f"{given.task} from {' '.join(f'{x:g}' for x in place)} m; by {given.metric}"
    )
    print(ranking_table(ranking))
    print(
        f"{len(ranking.order)} of {count} grasps can be used, {len(ranking.front)} of them on the "
        f"Pareto front (*) of effort, effective mass, manipulability and gripping force; "
        f"others: {failures or 'none'}"
    )
    if not sample.complete:
        print(f"{count} grasps were found, {sample.requested} asked for; lost: {sample.rejected}")
    figure = picture_of(ranking, obj, gripper, arm, path, metric=given.metric)
    save_picture(figure, file)
    print(f"picture: {file}")


def _arm(given: argparse.Namespace) -> tuple[Robot, tuple[float, ...], Gripper]:
    """The arm, where the object stands, and the gripper."""
    jaw = given.gripper or ("baxter" if given.arm.startswith("baxter") else "jaw80")
    _check_choice("gripper", jaw, list(_GRIPPERS))
    if Path(given.arm).suffix in (".urdf", ".xml", ".mjcf"):
        if not given.end_effector:
            raise ValueError(f"--arm {given.arm}: a file needs --end-effector NAME beside it")
        tips = Pose(np.eye(3), np.array([0.0, 0.0, given.tips]))
        arm = load_robot(given.arm, given.end_effector, T_hand=tips)
        place = _in_front(arm)
    else:
        _check_choice("arm", given.arm, list(_PLACES))
        arm = {
            "baxter": lambda: baxter("left"),
            "baxter_right": lambda: baxter("right"),
            "lwa4d": lambda: lwa4d(hand="parallel_jaw"),
        }[given.arm]()
        place = _PLACES[given.arm]
    return arm, tuple(given.place or place), _GRIPPERS[jaw]


def _in_front(arm: Robot) -> tuple[float, ...]:
    """On the level of the base, along its x, at a share of the arm's length."""
    steps = np.linalg.norm(np.asarray(arm.T_parent_joint.translation), axis=1)
    length = steps[1:].sum() + np.linalg.norm(np.asarray(arm.T_link_hand.translation[0]))
    place = arm.T_world_base.apply(np.array([_IN_FRONT * length, 0.0, 0.0]))
    return tuple(float(round(x, 3)) for x in np.asarray(place))


def _object(given: argparse.Namespace) -> ObjectModel:
    """Of the catalogue, or of a file."""
    if not Path(given.object).suffix:
        return load_catalogue([given.object])[given.object]
    if not Path(given.object).is_file():
        raise OSError(f"{given.object}: no such file; expected a mesh, URDF or MJCF file")
    return import_object(given.object, mass=given.mass)


def _check_choice(kind: str, name: str, known: list[str]) -> None:
    if name not in known:
        raise ValueError(nearest(kind, name, known))


def _parser() -> Parser:
    parser = Parser(
        prog="python -m mjx_inertia.grasping",
        description="Samples grasps of an object, ranks them for a task, and draws them.",
    )
    add = parser.add_argument
    add("--arm", default="baxter", help=f"{', '.join(_PLACES)}, or a URDF or MJCF file")
    add("--end-effector", metavar="NAME", help="link, body or site of --arm's file")
    tips = "of the finger tips from --end-effector along its z, m; the fingers close along its y"
    add("--tips", type=float, default=0.0, metavar="Z", help=tips)
    add("--object", required=True, help="name in the catalogue, or a mesh, URDF or MJCF file")
    add("--mass", type=float, help="kg, of a mesh file")
    add("--task", default="translate_x", help=f"{', '.join(TASKS)}")
    add("--metric", default="effort", help=f"to order by: {', '.join((*CRITERIA, EPSILON))}")
    add("--gripper", help=f"{' or '.join(_GRIPPERS)}; without: Baxter's own, jaw80 on others")
    add("--count", type=int, default=200, help="grasps to sample")
    add("--friction", type=float, default=0.5, help="between fingers and object")
    add("--seed", type=int, default=0, help="of the sample")
    add("--place", type=float, nargs=3, metavar=("X", "Y", "Z"),
        help="of the object's frame, m, in the arm's world; its axes are the world's")  # fmt: skip
    add("--out", default="grasps.png", help="picture to write, .png")
    return parser


if __name__ == "__main__":
    sys.exit(main())
