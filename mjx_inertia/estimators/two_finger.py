"""The analytical method of Yu et al. 2005 as thesis §3.7.3 describes it: two fingers, 12 pushes.

In: `TwoFingerPush`es with both fingers on one face. Out: `TwoFingerEstimate`. Newton's laws are
fitted by least squares in three steps. Straight pushes with different accelerations tell mass from
friction, f = m a + f_f. Their resultant force passes through the CoM, which pushes on two faces
tell. Turning pushes tell I_zz from the friction moment, m = I_zz α + m_f, as long as the object
turns about one point, so that the table's load keeps its direction. Accelerations are differences
of measured velocities, as in the thesis.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from mjx_inertia.pushing.settings import GRAVITY
from mjx_inertia.pushing.two_finger_scene import TwoFingerPush
from mjx_inertia.spatial import AnyArray


@dataclass(frozen=True)
class TwoFingerLeastSquares:
    """How the laws are fitted."""

    finger_radius: float = 0.005  # m
    settling: float = 0.1  # left out at the start of each push, s
    # "samples" takes each sample as a row. Noise of the accelerations then shrinks mass and I_zz.
    # "pushes" takes the means of each push, in which it cancels.
    rows: Literal["samples", "pushes"] = "samples"

    def __post_init__(self) -> None:
        """Refuses what cannot be meant."""
        if self.rows not in ("samples", "pushes"):
            raise ValueError(f"rows={self.rows!r}: choose 'samples' or 'pushes'")


@dataclass(frozen=True)
class TwoFingerEstimate:
    """What the pushes tell, with standard deviations from the residuals of each step."""

    mass: float  # kg
    mass_std: float  # kg
    friction: float  # μ between object and table
    com: Float[np.ndarray, "2"]  # in the object frame, m
    com_std: Float[np.ndarray, "2"]  # m
    inertia: float  # I_zz about the CoM, kg m²
    inertia_std: float  # kg m²
    friction_moment: float  # N m


def estimate_two_finger(
    straight: Sequence[TwoFingerPush],
    across: Sequence[TwoFingerPush],
    turning: Sequence[TwoFingerPush],
    settings: TwoFingerLeastSquares = TwoFingerLeastSquares(),
) -> TwoFingerEstimate:
    """Mass, friction, CoM and I_zz of one object.

    Args:
      straight: pushes of one face without rotation, with different accelerations.
      across: the same of a face that is not parallel to it.
      turning: pushes in which the object turns one way about a fixed point, with different angular
        accelerations.
      settings: how the laws are fitted.

    Raises:
      ValueError: a group has fewer than two pushes.
    """
    groups = {"straight": straight, "across": across, "turning": turning}
    for name, pushes in groups.items():
        if len(pushes) < 2:
            raise ValueError(f"{name}: {len(pushes)} pushes; at least two accelerations are needed")
    (mass, friction_force), (mass_std, _) = _fit([_force_rows(p, settings) for p in straight])
    com, com_std = _fit([_com_rows(p, settings) for p in (*straight, *across)])
    (inertia, moment), (inertia_std, _) = _fit([_moment_rows(p, com, settings) for p in turning])
    return TwoFingerEstimate(
        mass=float(mass),
        mass_std=float(mass_std),
        friction=float(friction_force / (mass * GRAVITY)),
        com=com,
        com_std=com_std,
        inertia=float(inertia),
        inertia_std=float(inertia_std),
        friction_moment=float(moment),
    )


_Table = tuple[np.ndarray, np.ndarray]  # (n, 2) coefficients of the two unknowns, (n,) right sides


def _fit(tables: Sequence[_Table]) -> tuple[np.ndarray, np.ndarray]:
    """Least squares over all rows: two unknowns and their standard deviations."""
    matrix, right = (np.concatenate(parts) for parts in zip(*tables, strict=True))
    answer, *_ = np.linalg.lstsq(matrix, right)
    residual = right - matrix @ answer
    variance = residual @ residual / max(len(right) - 2, 1)
    return answer, np.sqrt(variance * np.diag(np.linalg.inv(matrix.T @ matrix)))


def _reduced(push: TwoFingerPush, table: _Table, settings: TwoFingerLeastSquares) -> _Table:
    kept = np.asarray(push.time) > settings.settling + 1e-9
    matrix, right = table[0][kept], table[1][kept]
    if settings.rows == "samples":
        return matrix, right
    return matrix.mean(0, keepdims=True), right.mean(0, keepdims=True)


def _change(values: Float[np.ndarray, " t *k"], time: np.ndarray) -> Float[np.ndarray, " t *k"]:
    """Mean rate of change over each sampling interval; the push begins at rest."""
    return np.diff(values, axis=0, prepend=0.0 * values[:1]) / time[0]


def _midway(values: Float[AnyArray, " t *k"]) -> Float[np.ndarray, " t *k"]:
    return 0.5 * (np.asarray(values) + np.concatenate([values[:1], values[:-1]]))


def _force_rows(push: TwoFingerPush, settings: TwoFingerLeastSquares) -> _Table:
    """Newton along the path: f = m a + f_f."""
    velocity = np.asarray(push.twist)[:, :2]
    ahead = velocity[-1] / np.linalg.norm(velocity[-1])
    acceleration = _change(velocity @ ahead, np.asarray(push.time))
    force = np.asarray(push.force).sum(1) @ ahead
    return _reduced(push, (np.stack([acceleration, np.ones_like(force)], 1), force), settings)


def _wrench_obj(
    push: TwoFingerPush, finger_radius: float
) -> tuple[Float[np.ndarray, "t 2"], Float[np.ndarray, " t"]]:
    """Resultant force in object axes, N, and its moment about the object-frame origin, N m.

    The fingers touch a radius ahead of their centres, at right angles to the line between them.
    Forces are means over a sampling interval, so places are those of its middle: at 20 Hz an object
    turns by several degrees in an interval.
    """
    fingers, pose = _midway(push.finger_position), _midway(push.pose)
    left = fingers[:, 0] - fingers[:, 1]
    left = left / np.linalg.norm(left, axis=1, keepdims=True)
    inward = np.stack([left[:, 1], -left[:, 0]], 1)
    arm = fingers + finger_radius * inward[:, None] - pose[:, None, :2]
    force = np.asarray(push.force)
    moment = (arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0]).sum(1)
    (x, y), cos, sin = force.sum(1).T, np.cos(pose[:, 2]), np.sin(pose[:, 2])
    return np.stack([cos * x + sin * y, cos * y - sin * x], 1), moment


def _com_rows(push: TwoFingerPush, settings: TwoFingerLeastSquares) -> _Table:
    """Without rotation friction acts at the CoM too, so com × f = m."""
    force, moment = _wrench_obj(push, settings.finger_radius)
    return _reduced(push, (np.stack([force[:, 1], -force[:, 0]], 1), moment), settings)


def _moment_rows(
    push: TwoFingerPush, com: Float[np.ndarray, "2"], settings: TwoFingerLeastSquares
) -> _Table:
    """Euler about the CoM: m - com × f = I_zz α + m_f sgn ω (errata 4)."""
    force, moment = _wrench_obj(push, settings.finger_radius)
    about_com = moment - com[0] * force[:, 1] + com[1] * force[:, 0]
    spin = np.asarray(push.twist)[:, 2]
    turned = np.full_like(spin, np.sign(spin[-1]))
    return _reduced(
        push, (np.stack([_change(spin, np.asarray(push.time)), turned], 1), about_com), settings
    )
