"""Ranked grasps as a picture: where to touch the object, the best hands, the arm that holds it.

In: a `GraspRanking`, the object, the arm and the path. Out: a figure, drawn without a window.
"""

import io
import itertools
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import trimesh
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy import ndarray
from scipy.spatial import cKDTree

from mjx_inertia.files import write_whole
from mjx_inertia.grasping.grasp import Grasp, Gripper
from mjx_inertia.grasping.ranking import EPSILON, UNITS, GraspRanking
from mjx_inertia.grasping.task_path import ObjectPath, object_pose_at
from mjx_inertia.objects import ObjectModel
from mjx_inertia.objects.picture import View, draw_meshes
from mjx_inertia.robots import Robot, hand_pose, link_poses
from mjx_inertia.spatial import Pose

_UNTOUCHED = (0.80, 0.80, 0.80)
_ARM = (0.55, 0.62, 0.72)
_NEAR = 0.08  # of the object's size: how far from a contact its cost is painted
_NEIGHBOURS = 16  # contacts of which the paint is a mean
_BLUR = 0.04  # of the object's size: standard deviation of their weights
_SIZE = 420  # pixels


def picture_of(
    ranking: GraspRanking,
    obj: ObjectModel,
    gripper: Gripper,
    arm: Robot,
    path: ObjectPath,
    *,
    metric: str = "effort",
    hands: int = 5,
) -> Figure:
    """The cost painted on the surface, the best hands, and the arm at the start with the best.

    The paint is the mean over grasps that touch nearby and can be carried out, however hard the jaw
    must squeeze; grey where there are none. Colours leave out the worst tenth of these costs.

    `metric` is one of `ranking.names`; `hands` are drawn, the best ones.

    Raises:
      ValueError: no grasp can be used.
    """
    if not len(ranking.order):
        raise ValueError(f"ranking: no grasp to draw; all failed: {ranking.failures}")
    # colours by the costs of what can be carried out
    cost = ranking.by(metric)
    carried = np.isfinite(cost)
    low, high = np.quantile(cost[carried], [0.1, 1.0] if metric == EPSILON else [0.0, 0.9])
    color = ScalarMappable(Normalize(low, high if high > low else low + 1.0), "viridis")
    touched = np.asarray(ranking.grasps.contacts.points)[carried]
    surface, paint = painted(obj.mesh, touched, cost[carried], color)
    best = ranking.order[:hands]
    boxes = [_joined(hand_boxes(ranking.grasps, gripper, int(row))) for row in best]
    tints = [color.to_rgba(cost[row])[:3] for row in best]
    # panels: surface, hands, arm
    figure = Figure(figsize=(13.5, 4.8), layout="constrained")
    axes = figure.subplots(1, 3)
    views = View(size=_SIZE)
    panels = (
        ("where the fingers touch", draw_meshes([surface], [paint], views)),
        (f"the best {len(best)}", draw_meshes([obj.mesh, *boxes], [_UNTOUCHED, *tints], views)),
    )
    for axis, (title, picture) in zip(axes, panels, strict=False):
        axis.imshow(picture.image)
        axis.set_title(title)
    _draw_arm(axes[2], ranking, obj, gripper, arm, path)
    for axis in axes:
        axis.set_axis_off()
    label = f"{metric.replace('_', ' ')}, {UNITS[metric]}"
    figure.colorbar(color, ax=list(axes[:2]), label=label, shrink=0.8)
    return figure


def save_picture(figure: Figure, path: Path) -> None:
    """Writes a PNG, whole or not at all."""
    buffer = io.BytesIO()
    FigureCanvasAgg(figure).print_png(buffer)
    write_whole(path, buffer.getvalue())


def painted(
    mesh: trimesh.Trimesh,
    contacts: Float[ndarray, "n 2 3"],
    cost: Float[ndarray, " n"],
    color: ScalarMappable,
) -> tuple[trimesh.Trimesh, Float[ndarray, "f 3"]]:
    """A finer mesh of the surface, and the colour of each of its faces by the costs of contacts."""
    size = float(mesh.scale)
    parts = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, size / 50.0)
    fine = trimesh.Trimesh(parts[0], parts[1], process=False)
    touched, costs = contacts.reshape(-1, 3), np.repeat(cost, 2)
    k = min(_NEIGHBOURS, len(touched))
    distance, which = cKDTree(touched).query(fine.triangles_center, k=range(1, k + 1))
    weight = np.exp(-0.5 * (distance / (_BLUR * size)) ** 2) + 1e-300
    mean = np.sum(weight * costs[which], axis=1) / np.sum(weight, axis=1)
    paint = color.to_rgba(mean)[:, :3]
    paint[distance[:, 0] > _NEAR * size] = _UNTOUCHED
    return fine, paint


def hand_boxes(grasps: Grasp, gripper: Gripper, row: int) -> list[trimesh.Trimesh]:
    """Fingers and palm of one grasp in the object frame."""
    width = np.asarray(grasps.width)[row : row + 1]
    pose = np.asarray(grasps.T_obj_hand.as_matrix())[row]
    boxes = []
    for half, center in zip(gripper.half_extents, gripper.box_centers(width)[0], strict=True):
        box = trimesh.creation.box(2.0 * half)
        boxes.append(box.apply_translation(center).apply_transform(pose))
    return boxes


def _joined(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    joined = trimesh.util.concatenate(meshes)
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def arm_meshes(
    arm: Robot, q: Float[ndarray, " n"], hand_length: float, thickness: float = 0.05
) -> list[trimesh.Trimesh]:
    """Rods from joint to joint, thinner towards the hand, with balls at the joints; world frame.

    The last rod ends `hand_length` (m) before the hand's frame; `thickness` is the radius at the
    base, m.
    """
    at = jnp.asarray(q)
    links = np.asarray(link_poses(arm, at).translation)
    wrist = np.asarray(hand_pose(arm, at).apply(np.array([0.0, 0.0, -hand_length])))
    points = np.concatenate([np.asarray(arm.T_world_base.translation)[None], links, wrist[None]])
    meshes = []
    for i, (a, b) in enumerate(itertools.pairwise(points)):
        radius = thickness * (1.0 - 0.6 * i / len(links))
        ball = trimesh.creation.icosphere(2, 1.15 * radius).apply_translation(a)
        meshes.append(ball)
        if np.linalg.norm(b - a) > radius:
            meshes.append(trimesh.creation.cylinder(radius, segment=[a, b], sections=24))
    return meshes


def _draw_arm(
    axis: Axes,
    ranking: GraspRanking,
    obj: ObjectModel,
    gripper: Gripper,
    arm: Robot,
    path: ObjectPath,
) -> None:
    row = int(ranking.order[0])
    poses: Pose = jax.vmap(lambda move, s: object_pose_at(path, move, s))(path.move, path.s)
    start = np.eye(4)
    start[:3, :3], start[:3, 3] = poses.rotation[0], poses.translation[0]
    table = np.array([0.0, 0.0, -start[2, 3]])  # the picture's ground is at z = 0
    body = obj.mesh.copy().apply_transform(start)
    hand = [box.apply_transform(start) for box in hand_boxes(ranking.grasps, gripper, row)]
    links = arm_meshes(arm, np.asarray(ranking.found.motion.q[row, 0]), gripper.finger_length)
    meshes = [m.apply_translation(table) for m in (body, *hand, *links)]
    colors = [obj.color, *[(0.25, 0.25, 0.28)] * len(hand), *[_ARM] * len(links)]
    picture = draw_meshes(meshes, colors, View(azimuth_deg=-50.0, elevation_deg=22.0, size=_SIZE))
    com = np.asarray(jax.vmap(lambda pose: pose.apply(path.moves.com_obj))(poses)) + table
    axis.imshow(picture.image)
    axis.plot(*picture.place(com).T, color="tab:red", lw=1.5)
    axis.set_title("the best at the start; red: way of the CoM")
