"""Where an object goes after it is grasped: poses along quintic moves, at rest between them.

In: a `Task` of moves and the pose from which it starts. Out: `ObjectPath`, sampled waypoints with
what the motion is per unit of the path parameter s and of time. A move displaces the object's CoM
along a straight line and turns it about the CoM. World axes; twists are (linear, angular), linear
of the origin of the object's frame.
"""

import dataclasses
from collections.abc import Callable
from typing import Literal

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.spatial import AnyArray, Pose
from mjx_inertia.spatial.unrolled import axis_rotation, components, stacked

Orientation = Literal["shortest", "euler"]
Vector = tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class Move:
    """A straight path of the CoM and a turn about it, from rest to rest."""

    translation: Vector = (0.0, 0.0, 0.0)  # of the CoM, m, world axes
    rotation_deg: Vector = (0.0, 0.0, 0.0)  # rotation vector, degrees, world axes, about the CoM
    duration: float = 2.0  # s

    def __post_init__(self) -> None:
        """Raises ValueError for a move without time, without motion, or not finite."""
        if not self.duration > 0.0:
            raise ValueError(f"duration={self.duration} s: must be positive")
        if not np.all(np.isfinite([*self.translation, *self.rotation_deg])):
            raise ValueError(f"a move with values that are not finite: {self}")
        if not np.any([*self.translation, *self.rotation_deg]):
            raise ValueError("a move that neither translates nor rotates; leave it out")


@dataclasses.dataclass(frozen=True)
class Task:
    """Moves one after the other."""

    name: str  # of the task
    moves: tuple[Move, ...]  # in order
    # "shortest" turns at a constant axis; "euler" takes the quintic of roll, pitch and yaw, as
    # thesis Eq. 5.1 prints it.
    orientation: Orientation = "shortest"

    def __post_init__(self) -> None:
        """Raises ValueError for a task without moves."""
        if not self.moves:
            raise ValueError(f"task {self.name!r} has no moves")
        if self.orientation not in ("shortest", "euler"):
            raise ValueError(f"orientation={self.orientation!r}: choose 'shortest' or 'euler'")

    @property
    def duration(self) -> float:
        """Of all moves, s."""
        return sum(move.duration for move in self.moves)


@struct.dataclass
class ObjectPath:
    """An object's motion through a task, at k waypoints."""

    time: Float[Array, " k"]  # since the start, s
    # number of the move that a waypoint belongs to; the last of one move and the first of the next
    # are at the same place
    move: Int[Array, " k"]
    s: Float[Array, " k"]  # path parameter within the move, 0 to 1
    rate: Float[Array, " k"]  # ds/dt, 1/s
    acceleration: Float[Array, " k"]  # d²s/dt², 1/s²
    moves: "MoveTable"  # the moves, in a form that `object_pose_at` evaluates
    orientation: Orientation = struct.field(pytree_node=False, default="shortest")  # of the task


@struct.dataclass
class MoveTable:
    """n moves as arrays."""

    start: Float[Array, "n 3 3"]  # rotation of the object in the world at the start of each
    com: Float[Array, "n 3"]  # CoM in the world at the start of each, m
    translation: Float[Array, "n 3"]  # of the CoM, m, world axes
    axis: Float[Array, "n 3"]  # of the turn, of length 1, world axes
    angle: Float[Array, " n"]  # of the turn, rad
    com_obj: Float[Array, "3"]  # CoM in the object's frame, m


def quintic(u: Float[AnyArray, "*k"]) -> tuple[AnyArray, AnyArray, AnyArray]:
    """From 0 to 1 and at rest at both ends, with two derivatives in u (thesis Eq. 5.1)."""
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return s, 30.0 * u**2 * (1.0 - u) ** 2, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)


def object_path(
    task: Task, T_world_obj: Pose, com_obj: Float[AnyArray, "3"], waypoints: int = 50
) -> ObjectPath:
    """Samples a task evenly in time, each move with both its ends.

    The object starts at `T_world_obj`; `com_obj` is its CoM in its own frame, m, known or
    estimated. The moves share the waypoints by their durations.

    Raises:
      ValueError: fewer than two waypoints for a move.
    """
    ends = np.cumsum([0.0, *(move.duration for move in task.moves)])
    marks = np.round(waypoints * ends / ends[-1]).astype(int)
    counts = np.diff(marks)
    if counts.min() < 2:
        raise ValueError(
            f"waypoints={waypoints}: task {task.name!r} has {len(counts)} moves, each of which "
            "needs two or more"
        )
    u = np.concatenate([np.linspace(0.0, 1.0, n) for n in counts])
    move = np.repeat(np.arange(len(counts)), counts)
    duration = np.array([m.duration for m in task.moves])[move]
    s, slope, bend = quintic(u)
    return ObjectPath(
        time=jnp.asarray(ends[move] + u * duration),
        move=jnp.asarray(move),
        s=jnp.asarray(s),
        rate=jnp.asarray(slope / duration),
        acceleration=jnp.asarray(bend / duration**2),
        moves=_table(task, T_world_obj, jnp.asarray(com_obj)),
        orientation=task.orientation,
    )


def _table(task: Task, T_world_obj: Pose, com_obj: Float[Array, "3"]) -> MoveTable:
    rotation = jnp.asarray(T_world_obj.rotation)
    com = jnp.asarray(T_world_obj.apply(com_obj))
    starts, coms, shifts, axes, angles = [], [], [], [], []
    for move in task.moves:
        vector = np.radians(move.rotation_deg)
        angle = float(np.linalg.norm(vector))
        starts.append(rotation)
        coms.append(com)
        shifts.append(jnp.array(move.translation))
        axes.append(jnp.asarray(vector / angle if angle > 0.0 else np.array([0.0, 0.0, 1.0])))
        angles.append(jnp.asarray(angle))
        rotation = _turned(axes[-1], angles[-1], rotation)
        com = com + shifts[-1]
    return MoveTable(
        start=jnp.stack(starts),
        com=jnp.stack(coms),
        translation=jnp.stack(shifts),
        axis=jnp.stack(axes),
        angle=jnp.stack(angles),
        com_obj=com_obj,
    )


def _turned(
    axis: Float[Array, "3"], angle: Float[Array, ""], rotation: Float[Array, "3 3"]
) -> Float[Array, "3 3"]:
    turn = stacked(axis_rotation(components(axis), angle), rotation.dtype)
    return (turn[:, :, None] * rotation[None]).sum(1)


def object_pose_at(path: ObjectPath, move: Int[Array, ""], s: Float[Array, ""]) -> Pose:
    """`T_world_obj` at parameter s of a move."""
    table = path.moves
    start, axis, angle = table.start[move], table.axis[move], table.angle[move]
    if path.orientation == "shortest":
        rotation = _turned(axis, s * angle, start)
    else:
        end = _turned(axis, angle, start)
        first, last = (_roll_pitch_yaw(matrix) for matrix in (start, end))
        rotation = jaxlie.SO3.from_rpy_radians(*(first + s * (last - first))).as_matrix()
    com = table.com[move] + s * table.translation[move]
    return Pose(rotation, com - (rotation * table.com_obj).sum(-1))


def moving_frame_twist(
    pose: Callable[[Float[Array, ""]], Pose], s: Float[Array, ""]
) -> tuple[Pose, Float[Array, "6"], Float[Array, "6"]]:
    """A moving frame's pose, twist per unit of s, and that twist's derivative in s; world axes."""

    def tangent(s: Float[Array, ""]) -> tuple[Float[Array, "6"], Pose]:
        here, slope = jax.jvp(pose, (s,), (jnp.ones_like(s),))
        spin = (slope.rotation[:, None, :] * here.rotation[None, :, :]).sum(-1)  # Ṙ Rᵀ
        angular = jnp.stack([spin[2, 1], spin[0, 2], spin[1, 0]])
        return jnp.concatenate([slope.translation, angular]), here

    xi, bend, here = jax.jvp(tangent, (s,), (jnp.ones_like(s),), has_aux=True)
    return here, xi, bend


def _roll_pitch_yaw(rotation: Float[Array, "3 3"]) -> Float[Array, "3"]:
    so3 = jaxlie.SO3.from_matrix(rotation)
    angles = so3.as_rpy_radians()
    return jnp.stack([angles.roll, angles.pitch, angles.yaw])


_LIFT, _LOWER = Move(translation=(0.0, 0.0, 0.1)), Move(translation=(0.0, 0.0, -0.1))

# Thesis §4.5.1 (six primitives), §4.5.2 (piece-wise translation), ch. 6 (pick and place, errata 19)
_UNIT = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
TASKS: dict[str, Task] = {
    task.name: task
    for task in (
        *(
            Task(f"translate_{axis}", (Move(translation=(0.1 * x, 0.1 * y, 0.1 * z)),))
            for axis, (x, y, z) in _UNIT.items()
        ),
        *(
            Task(f"rotate_{axis}", (Move(rotation_deg=(20.0 * x, 20.0 * y, 20.0 * z)),))
            for axis, (x, y, z) in _UNIT.items()
        ),
        Task(
            "piecewise",
            (_LIFT, Move(translation=(0.0, 0.1, 0.0)), Move(translation=(0.1, 0.1, 0.0))),
        ),
        *(
            Task(f"pick_and_place_{number}", (_LIFT, Move(translation=over), _LOWER))
            for number, over in enumerate(
                ((0.1, -0.2, 0.0), (0.0, -0.35, 0.0), (-0.1, -0.35, 0.0)), start=1
            )
        ),
    )
}
