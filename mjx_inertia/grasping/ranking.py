"""The grasps of one object for one task, best first.

In: an arm, an object, grasps of it, its path. Out: `GraspRanking` with every metric, the force that
holds the object, the Pareto set, and why the others are out; and the same as a table.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from mjx_inertia.command import aligned
from mjx_inertia.grasping.contact_model import SoftFinger
from mjx_inertia.grasping.evaluate import GraspCosts, evaluate_grasps
from mjx_inertia.grasping.grasp import Grasp
from mjx_inertia.grasping.gripper import Gripper
from mjx_inertia.grasping.holding import greatest_gripping_force
from mjx_inertia.grasping.inverse_kinematics import ReachSettings
from mjx_inertia.grasping.metrics import METRICS
from mjx_inertia.grasping.motion import GraspStatus
from mjx_inertia.grasping.task_path import ObjectPath
from mjx_inertia.pareto import pareto_set
from mjx_inertia.robots import Robot
from mjx_inertia.spatial import InertialParameters, Pose

FORCE = "gripping_force"
CRITERIA = (*METRICS, FORCE)
SLIPS = "SLIPS"  # could be carried out, but asks for more than the jaw can squeeze
_FRONT = ("effort", "effective_mass", "inverse_manipulability", FORCE)
UNITS = {
    "effort": "N m", "energy": "(N m)²", "effective_mass": "kg", "inverse_manipulability": "1/m²",
    "peak_torque": "of limit", "work": "J", FORCE: "N",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class GraspRanking:
    """What n grasps cost, and in which order to take them."""

    grasps: Grasp  # all of them
    found: GraspCosts  # status, motion and signals of each
    # a column for each of `CRITERIA`; infinite in rows that cannot be carried out
    costs: Float[ndarray, "n m"]
    force: Float[ndarray, " n"]  # that the jaw needs at the hardest moment of the path, N
    slips: Int[ndarray, " s"]  # rows that only the jaw's force rules out
    order: Int[ndarray, " k"]  # rows that can be used, the least cost by the chosen metric first
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
        """One column of the costs."""
        return self.costs[:, CRITERIA.index(criterion)]


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
    """Evaluates grasps by every metric and orders them by one.

    Args:
      arm: with its hand's frame at the finger tips, fingers closing along y; without the object.
      payload: in the object frame.
      grasps: of the object, with one leading axis.
      gripper: that grasps; its force limit counts.
      path: of the object.
      metric: one of `CRITERIA`.
      friction: between pads and object; the pads' torsion is that of patches of 9 mm.
      settings: how poses are reached.

    Raises:
      ValueError: another metric.
    """
    if metric not in CRITERIA:
        raise ValueError(f"`metric` {metric!r} is not known; give one of {', '.join(CRITERIA)}")
    hands = hands_of(grasps, gripper)
    found = evaluate_grasps(arm, payload, hands, path, settings=settings)
    pad = SoftFinger(friction, 0.006 * friction)
    contacts = jax.tree.map(lambda x: jnp.asarray(x, float), grasps.contacts)
    force = np.asarray(greatest_gripping_force(contacts, pad, payload, path, arm.gravity))
    costs = np.concatenate([found.usable(), force[:, None]], axis=1)
    carried = np.isfinite(costs[:, :-1]).all(axis=1)
    slips = carried & ~(force <= gripper.force_limit)
    costs[~carried] = np.inf
    used = np.where(slips[:, None], np.inf, costs)
    column = used[:, CRITERIA.index(metric)]
    order = np.argsort(column, kind="stable")[: int(np.isfinite(column).sum())]
    front = pareto_set(used, [CRITERIA.index(name) for name in _FRONT])
    return GraspRanking(grasps, found, costs, force, np.flatnonzero(slips), order, front)


def ranking_table(ranking: GraspRanking, rows: int = 10) -> str:
    """The best grasps as lines of text; a star is one of the Pareto set."""
    names = [name.replace("inverse_manipulability", "1/manipulability") for name in CRITERIA]
    heads = [f"{name} [{UNITS[key]}]" for name, key in zip(names, CRITERIA, strict=True)]
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
