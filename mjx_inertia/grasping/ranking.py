"""What many grasps of one object cost for one task, and which to take.

In: a `Robot`, a payload, grasps or hands in the object's frame (leading axis n), an `ObjectPath`.
Out: `GraspCosts`, a table of metrics with a status on each row, computed in one compiled program;
`GraspRanking` with the force that holds the object, the Pareto set, and why the others are out; the
same as text.
"""

import dataclasses
import functools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int
from numpy import ndarray

from mjx_inertia.command import aligned
from mjx_inertia.grasping.contact_model import SoftFinger
from mjx_inertia.grasping.grasp import Grasp, Gripper
from mjx_inertia.grasping.holding import greatest_gripping_force
from mjx_inertia.grasping.inverse_kinematics import ReachSettings
from mjx_inertia.grasping.metrics import METRICS, AlongPath, signals_along_path
from mjx_inertia.grasping.motion import GraspMotion, GraspStatus, motion_status, plan_motion
from mjx_inertia.grasping.task_path import ObjectPath
from mjx_inertia.grasping.wrench_space import payload_epsilon
from mjx_inertia.robots import Robot, over_states, with_payload
from mjx_inertia.search.fronts import pareto_set
from mjx_inertia.spatial import Consistency, InertialParameters, Pose, check_consistency

FORCE = "gripping_force"
CRITERIA = (*METRICS, FORCE)  # the columns of every ranking; less is better
EPSILON = "epsilon"  # of the grasp wrench space; more is better; only where it is asked for
SLIPS = "SLIPS"  # could be carried out, but asks for more than the jaw can squeeze
_FRONT = ("effort", "effective_mass", "inverse_manipulability", FORCE)
UNITS = {
    "effort": "N m", "energy": "(N m)²", "effective_mass": "kg", "inverse_manipulability": "1/m²",
    "peak_torque": "of limit", "work": "J", FORCE: "N", EPSILON: "N/N",
}  # fmt: skip
_BLOCK = 128  # grasps of a compiled block: their waypoints are a second batch


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

    The arm is without the object, `payload` in the object's own frame; other arguments as for
    `evaluate_grasps`.
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
    """Plans the motion of each grasp and takes the metrics, by their names in `METRICS`.

    The arm is without the object, `payload` in the object's frame, as are the n hands `T_obj_hand`.

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


@dataclasses.dataclass(frozen=True)
class GraspRanking:
    """What n grasps cost, and in which order to take them."""

    grasps: Grasp  # all of them
    found: GraspCosts  # status, motion and signals of each
    names: tuple[str, ...]  # of the columns of `costs`: `CRITERIA`, and `EPSILON` if ordered by it
    # infinite (ε: minus infinite) in rows that cannot be carried out
    costs: Float[ndarray, "n m"]
    force: Float[ndarray, " n"]  # that the jaw needs at the hardest moment of the path, N
    slips: Int[ndarray, " s"]  # rows that only the jaw's force rules out
    order: Int[ndarray, " k"]  # rows that can be used, the best by the chosen metric first
    # rows that no other beats in effort, effective mass, manipulability and gripping force
    front: Int[ndarray, " p"]

    @property
    def failures(self) -> dict[str, int]:
        """How many grasps cannot be used, by the name of the reason, the commonest first."""
        codes, counts = np.unique(np.asarray(self.found.status), return_counts=True)
        reasons = {GraspStatus(code).name: int(n) for code, n in zip(codes, counts, strict=True)}
        reasons.pop(GraspStatus.OK.name, None)
        if len(self.slips):
            reasons[SLIPS] = len(self.slips)
        return dict(sorted(reasons.items(), key=lambda item: -item[1]))

    def by(self, criterion: str) -> Float[ndarray, " n"]:
        """One column of the costs.

        Raises:
          ValueError: the ranking has no such column.
        """
        if criterion not in self.names:
            raise ValueError(f"{criterion!r} is not among {', '.join(self.names)}")
        return self.costs[:, self.names.index(criterion)]


def hands_of(grasps: Grasp, gripper: Gripper) -> Pose:
    """The arm's hand frame in the object's: at the finger tips, where a `Grasp` has the pads."""
    pads = jax.tree.map(lambda x: jnp.asarray(x, float), Pose.from_se3(grasps.T_obj_hand))
    return pads.replace(translation=pads.translation + gripper.pad_to_tip * pads.rotation[..., 2])


def rank_grasps(
    arm: Robot,
    payload: InertialParameters,
    grasps: Grasp,
    gripper: Gripper,
    path: ObjectPath,
    *,
    metric: str = "effort",
    friction: float = 0.5,
    settings: ReachSettings | None = None,
) -> GraspRanking:
    """Evaluates grasps by every metric and orders those that can be used by one.

    `EPSILON` asks for the grasps that resist a push from anywhere best, whatever the task: ε of
    Ferrari and Canny, with moments over the radius of gyration (`payload_epsilon`).

    Args:
      arm: with its hand's frame at the finger tips, fingers closing along y; without the object.
      payload: in the object frame.
      grasps: of the object, with one leading axis.
      gripper: that grasps; its force limit counts.
      path: of the object.
      metric: one of `CRITERIA`, or `EPSILON`.
      friction: between pads and object; the pads' torsion is that of patches of 9 mm.
      settings: of the inverse kinematics.

    Raises:
      ValueError: another metric.
    """
    known = (*CRITERIA, EPSILON)
    if metric not in known:
        raise ValueError(f"`metric` {metric!r} is not known; give one of {', '.join(known)}")
    hands = hands_of(grasps, gripper)
    found = evaluate_grasps(arm, payload, hands, path, settings=settings)
    # the greatest squeeze on the way, with pads whose torsion is that of round patches
    pad = SoftFinger(friction, 0.006 * friction)
    contacts = jax.tree.map(lambda x: jnp.asarray(x, float), grasps.contacts)
    force = np.asarray(greatest_gripping_force(contacts, pad, payload, path, arm.gravity))
    names, columns = CRITERIA, [found.usable(), force[:, None]]
    if metric == EPSILON:
        names = known
        columns.append(np.asarray(payload_epsilon(contacts, pad, payload))[:, None])
    costs = np.concatenate(columns, axis=1)
    # what cannot be carried out, what slips, and the order of the rest
    carried = np.isfinite(costs[:, : len(METRICS)]).all(axis=1)
    slips = carried & ~(force <= gripper.force_limit)
    costs[~carried] = [-np.inf if name == EPSILON else np.inf for name in names]
    rows = np.flatnonzero(carried & ~slips)
    column = costs[rows, names.index(metric)]
    order = rows[np.argsort(-column if metric == EPSILON else column, kind="stable")]
    used = np.where(slips[:, None], np.inf, costs)
    front = pareto_set(used, [CRITERIA.index(name) for name in _FRONT])
    return GraspRanking(grasps, found, names, costs, force, np.flatnonzero(slips), order, front)


def ranking_table(ranking: GraspRanking, rows: int = 10) -> str:
    """The best grasps as lines of text; a star is one of the Pareto set."""
    names = [name.replace("inverse_manipulability", "1/manipulability") for name in ranking.names]
    heads = [f"{name} [{UNITS[key]}]" for name, key in zip(names, ranking.names, strict=True)]
    lines = [["rank", *heads, "width [mm]", "held at, object frame [mm]"]]
    middle = np.asarray(ranking.grasps.contacts.points).mean(axis=1)
    front = set(ranking.front.tolist())
    for rank, row in enumerate(ranking.order[:rows], start=1):
        star = "*" if int(row) in front else " "
        figures = [f"{x:.4g}" for x in ranking.costs[row]]
        place = " ".join(f"{1e3 * x:6.1f}" for x in middle[row])
        width = f"{1e3 * float(ranking.grasps.width[row]):.1f}"
        lines.append([f"{rank}{star}", *figures, width, place])
    return "\n".join(aligned(lines, left=(len(lines[0]) - 1,)))


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
