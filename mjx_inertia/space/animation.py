"""A manoeuvre as a film: base, links, object, where the object shall be, the way of the base.

In: a manoeuvre and its path. Out: a GIF. A planar robot is drawn from above, others in three
dimensions.
"""

import itertools
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Array, Float
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy import ndarray

from mjx_inertia.robots import BASE, Robot
from mjx_inertia.robots.recursions import frames_at, hand_frame
from mjx_inertia.space.manoeuvre import Manoeuvre
from mjx_inertia.space.manoeuvre_path import ManoeuvrePath
from mjx_inertia.spatial import Pose
from mjx_inertia.spatial.components import stacked

_BASE, _LINK, _OBJECT, _TARGET, _WAY = "0.35", "tab:red", "tab:blue", "0.6", "tab:orange"
_MARGIN = 0.1  # of the picture's width
Line = tuple[Float[ndarray, "_ 3"], dict[str, object]]


def save_animation(
    file: str | Path, manoeuvre: Manoeuvre, drawn: ManoeuvrePath, per_second: int = 15
) -> None:
    """Writes a GIF with one picture for each time of a path.

    Args:
      file: to write.
      manoeuvre: what is to be done.
      drawn: how a decision does it, at times evenly over the duration (`path`).
      per_second: how fast pictures follow one another.

    Raises:
      ValueError: a file of another kind, or fewer than two times.
    """
    file = Path(file)
    if file.suffix.lower() != ".gif":
        raise ValueError(f"`file` is {file}: expected a name that ends in .gif")
    if len(drawn.time) < 2:
        raise ValueError(f"`drawn` has {len(drawn.time)} times: expected 2 or more")
    pictures = _picture_lines(manoeuvre, drawn)
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    planar = manoeuvre.robot.planar
    ax = figure.add_subplot() if planar else figure.add_subplot(projection="3d")
    everything = np.concatenate([line for lines in pictures for line, _ in lines])
    middle = (everything.max(0) + everything.min(0)) / 2.0
    half = (0.5 + _MARGIN) * float(np.ptp(everything, 0).max())
    writer = PillowWriter(fps=per_second)
    with writer.saving(figure, str(file), dpi=80):
        for lines, time in zip(pictures, drawn.time, strict=True):
            _draw(ax, lines, f"{float(time):.1f} s", (middle, half))
            writer.grab_frame()


def _draw(
    ax: Axes, lines: list[Line], title: str, window: tuple[Float[ndarray, "3"], float]
) -> None:
    count = 3 if ax.name == "3d" else 2
    middle, half = window
    ax.clear()
    for line, style in lines:
        ax.plot(*line.T[:count], **style)  # pyright: ignore[reportArgumentType]
    limits = {f"{a}lim": (m - half, m + half) for a, m in zip("xyz"[:count], middle, strict=False)}
    labels = {f"{a}label": f"{a}, m" for a in "xyz"[:count]}
    ax.set(title=title, **limits, **labels)
    ax.set_aspect("equal")


def _picture_lines(m: Manoeuvre, drawn: ManoeuvrePath) -> list[list[Line]]:
    """The lines of each picture, in the world."""
    robot = m.robot
    links = _link_lines(robot, np.asarray(drawn.motion.q))
    width = {"color": _LINK, "lw": 4, "solid_capstyle": "round"}
    way = np.asarray(drawn.T_world_base.translation)
    pictures = []
    for k in range(len(way)):
        T_world_base, T_world_obj = drawn.T_world_base[k], drawn.T_world_obj[k]
        lines: list[Line] = [
            (_apply(T_world_base, edge), {"color": _BASE, "lw": 2}) for edge in _box(robot)
        ]
        lines += [(_apply(T_world_base, line[k]), width) for line in links]
        for T, color, style in ((m.T_world_obj, _TARGET, "--"), (T_world_obj, _OBJECT, "-")):
            shape = {"color": color, "ls": style, "lw": 2}
            lines += [(_apply(T, line), shape) for line in _ball(robot, m.capture.radius)]
        lines.append((way[: k + 1], {"color": _WAY, "lw": 1}))
        pictures.append(lines)
    return pictures


def _link_lines(robot: Robot, q: Float[ndarray, "t n"]) -> list[Float[ndarray, "t 2 3"]]:
    """From each joint to those behind it and to the hands, in the base."""

    def places(q: Float[Array, " n"]) -> Float[Array, "p 3"]:
        links = frames_at(robot, q)
        ends = [*links, *(hand_frame(robot, links, k) for k in range(len(robot.hands)))]
        return stacked([end.origin for end in ends], q.dtype)

    at = np.asarray(jax.jit(jax.vmap(places))(q))
    pairs = [(parent, i) for i, parent in enumerate(robot.parents) if parent != BASE]
    pairs += [(link, robot.dof + k) for k, link in enumerate(robot.hands)]
    return [at[:, list(pair)] for pair in pairs]


def _box(robot: Robot) -> list[Float[ndarray, "p 3"]]:
    """Outline of the base from above, or its edges, in the base."""
    half = np.array(robot.base_size) / 2.0
    if robot.planar:
        corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 0)])
        return [corners * half]
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    return [
        np.array([a, b]) * half
        for a, b in itertools.combinations(corners, 2)
        if np.count_nonzero(a != b) == 1
    ]


def _ball(robot: Robot, radius: float) -> list[Float[ndarray, "p 3"]]:
    """Circles around the object, and its x axis, in its frame."""
    angle = np.linspace(0.0, 2.0 * np.pi, 49)
    flat = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], 1)
    arrow = np.array([[0.0, 0.0, 0.0], [radius, 0.0, 0.0]])
    return (
        [flat, arrow] if robot.planar else [flat, np.roll(flat, 1, 1), np.roll(flat, 2, 1), arrow]
    )


def _apply(T: Pose, points: Float[ndarray, "p 3"]) -> Float[ndarray, "p 3"]:
    return points @ np.asarray(T.rotation).T + np.asarray(T.translation)
