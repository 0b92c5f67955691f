"""The metrics of many grasps of one object for one task, in one compiled program.

In: a `Robot`, a payload, hands in the object's frame (leading axis n), an `ObjectPath`. Out:
`GraspCosts`, a table with a status on each row.
"""

import functools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.grasping.inverse_kinematics import ReachSettings
from mjx_inertia.grasping.metrics import METRICS, AlongPath, signals_along_path
from mjx_inertia.grasping.motion import GraspMotion, GraspStatus, motion_status, plan_motion
from mjx_inertia.grasping.task_path import ObjectPath
from mjx_inertia.robots import Robot, over_states, with_payload
from mjx_inertia.spatial import (
    Consistency,
    InertialParameters,
    Pose,
    check_consistency,
)

_BLOCK = 128  # grasps: their waypoints are a second batch


@struct.dataclass
class GraspCosts:
    """What n grasps cost."""

    # a column for each metric; finite where the status is one of motion, not of reach
    costs: Float[Array, "n m"]
    status: Int[Array, " n"]  # `GraspStatus`
    motion: GraspMotion  # of each grasp
    signals: AlongPath  # of each grasp
    names: tuple[str, ...] = struct.field(pytree_node=False, default=())  # of the columns

    def usable(self) -> Float[np.ndarray, "n m"]:
        """The costs, infinite in rows whose status is not OK."""
        fine = np.asarray(self.status) == GraspStatus.OK
        return np.where(fine[:, None], np.asarray(self.costs), np.inf)


def grasp_costs(
    arm: Robot,
    payload: InertialParameters,
    T_obj_hand: Pose,
    motion: GraspMotion,
    metrics: Sequence[str] = tuple(METRICS),
    settings: ReachSettings | None = None,
) -> tuple[Float[Array, " m"], Int[Array, ""], AlongPath]:
    """Metrics and status of one grasp whose motion is known; differentiable in the payload.

    Args:
      arm: without the object.
      payload: of the object, in its own frame.
      T_obj_hand: the hand in the object's frame.
      motion: of the joints.
      metrics: names in `METRICS`.
      settings: what counts as reached.
    """
    holding = with_payload(arm, payload, T_obj_hand.inverse())
    signals = signals_along_path(holding, motion)
    costs = jnp.stack([METRICS[name](holding, motion, signals) for name in metrics])
    status = motion_status(arm, motion, signals.torque, settings or ReachSettings())
    bad = check_consistency(payload) > Consistency.ON_BOUNDARY
    return costs, jnp.where(bad, jnp.int32(GraspStatus.BAD_PAYLOAD), status), signals


def evaluate_grasps(
    arm: Robot,
    payload: InertialParameters,
    T_obj_hand: Pose,
    path: ObjectPath,
    metrics: Sequence[str] = tuple(METRICS),
    settings: ReachSettings | None = None,
) -> GraspCosts:
    """Plans the motion of each grasp and takes the metrics.

    Args:
      arm: without the object.
      payload: of the object, in its own frame.
      T_obj_hand: hands in the object's frame, leading axis n.
      path: of the object.
      metrics: names in `METRICS`.
      settings: how poses are reached.

    Raises:
      ValueError: an unknown metric, or no grasps.
    """
    for name in metrics:
        if name not in METRICS:
            raise ValueError(f"metrics: unknown metric {name!r}; choose from {sorted(METRICS)}")
    if len(T_obj_hand.translation) == 0:
        raise ValueError("T_obj_hand: there are no grasps to evaluate")
    chosen = settings or ReachSettings()
    found = _program(_Key(arm), tuple(metrics), chosen)(payload, T_obj_hand, path)
    return GraspCosts(*found, names=tuple(metrics))


class _Key:
    """An arm by its values, so that one compiled program serves equal arms."""

    def __init__(self, arm: Robot) -> None:
        self.arm = arm
        leaves, structure = jax.tree.flatten(arm)
        self._value = (str(structure), tuple(np.asarray(leaf).tobytes() for leaf in leaves))

    def __hash__(self) -> int:
        return hash(self._value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._value == other._value


@functools.lru_cache(maxsize=32)
def _program(key: _Key, metrics: tuple[str, ...], settings: ReachSettings):  # noqa: ANN202
    arm = key.arm

    @jax.jit
    def run(payload: InertialParameters, hands: Pose, path: ObjectPath) -> tuple:
        def one(hand: Pose) -> tuple:
            motion = plan_motion(arm, hand, path, settings)
            costs, status, signals = grasp_costs(arm, payload, hand, motion, metrics, settings)
            return costs, status, motion, signals

        return over_states(one, _BLOCK)(hands)

    return run
