"""How far a replay in MuJoCo is from what was predicted.

In: a `Replay`. Out: `Disagreement`, errors of the base at the end and of wrenches over the time.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from mjx_inertia.space.mujoco_replay import Replay
from mjx_inertia.space.robot import pose_at_index
from mjx_inertia.spatial import Pose

_NO_WAY = 1e-9  # m, rad: less than that is no displacement to compare with


@dataclasses.dataclass(frozen=True)
class Disagreement:
    """Prediction against simulation; shares are of the simulated figure, NaN where that is zero."""

    base_place: float  # of the base at the end, m
    base_place_share: float  # the same against how far the base went
    base_turn: float  # angle between the base's attitudes at the end, rad
    base_turn_share: float  # the same against how far the base turned
    force: float  # of the object over the whole time: relative L2 error
    moment: float  # of the object about its CoM, likewise
    hand_forces: tuple[float, float]  # of the right and the left hand, likewise
    hand_moments: tuple[float, float]  # about the hands' origins, likewise


def disagreement(replay: Replay) -> Disagreement:
    """How far the simulation is from the prediction."""
    a, b = replay.predicted, replay.simulated
    wanted, reached = pose_at_index(a.T_world_base, -1), pose_at_index(b.T_world_base, -1)
    apart, between = _between(wanted, reached)
    went, turned = _between(pose_at_index(b.T_world_base, 0), reached)

    def hands(part: slice) -> tuple[float, float]:
        shares = [_share(a.hand_wrenches[:, k, part], b.hand_wrenches[:, k, part]) for k in (0, 1)]
        return shares[0], shares[1]

    return Disagreement(
        base_place=apart,
        base_place_share=apart / went if went > _NO_WAY else np.nan,
        base_turn=between,
        base_turn_share=between / turned if turned > _NO_WAY else np.nan,
        force=_share(a.object_wrench[:, :3], b.object_wrench[:, :3]),
        moment=_share(a.object_wrench[:, 3:], b.object_wrench[:, 3:]),
        hand_forces=hands(slice(0, 3)),
        hand_moments=hands(slice(3, 6)),
    )


def _between(a: Pose, b: Pose) -> tuple[float, float]:
    """Distance (m) and angle (rad) between two poses."""
    rotation = np.asarray(a.rotation).T @ np.asarray(b.rotation)
    apart = np.asarray(a.translation) - np.asarray(b.translation)
    return float(np.linalg.norm(apart)), float(Rotation.from_matrix(rotation).magnitude())


def _share(predicted: Float[ndarray, "..."], simulated: Float[ndarray, "..."]) -> float:
    size = float(np.linalg.norm(simulated))
    return float(np.linalg.norm(predicted - simulated)) / size if size > 0.0 else np.nan
