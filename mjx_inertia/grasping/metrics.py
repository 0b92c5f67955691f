"""What a grasp costs along a task: effort, safety, dexterity, limits, work.

In: a `Robot` with its payload (`with_payload`) and a `GraspMotion`. Out: a number for one grasp;
lower is better. `METRICS` names them. All are smooth where the motion is, so they have gradients in
the grasp and in the payload.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.grasping.augmented import effective_mass
from mjx_inertia.grasping.motion import GraspMotion
from mjx_inertia.robots import Robot, hand_jacobian, inverse_dynamics
from mjx_inertia.spatial.small_cholesky import cholesky
from mjx_inertia.spatial.unrolled import Matrix, components


@struct.dataclass
class AlongPath:
    """Signals at k waypoints from which the metrics are taken.

    Where the hand turns on the spot, `effective_mass` and `manipulability` have no direction: they
    are zero.
    """

    torque: Float[Array, "k n"]  # of the joints, N m (N where prismatic)
    effective_mass: Float[Array, " k"]  # of the arm with its payload along the hand's path, kg
    # a² of thesis Eq. 6.3 for the translation: square of the hand's speed in the direction of its
    # path for joint speeds of norm one, m²
    manipulability: Float[Array, " k"]


_STILL = 1e-6  # m per unit of s: slower, the hand turns on the spot

Metric = Callable[[Robot, GraspMotion, AlongPath], Float[Array, ""]]


def state_signals(
    arm: Robot,
    q: Float[Array, " n"],
    qd: Float[Array, " n"],
    qdd: Float[Array, " n"],
    direction: Float[Array, "3"],
) -> AlongPath:
    """The signals in one state; `direction` of the hand's path is a unit vector in world axes."""
    return AlongPath(
        torque=inverse_dynamics(arm, q, qd, qdd),
        effective_mass=effective_mass(arm, q, direction),
        manipulability=velocity_manipulability(arm, q, direction),
    )


def signals_along_path(arm: Robot, motion: GraspMotion) -> AlongPath:
    """The signals at every waypoint of a motion."""
    linear = motion.tangent[:, :3]
    length = jnp.sqrt(jnp.maximum(jnp.sum(linear**2, -1, keepdims=True), 1e-30))
    moves = length > _STILL
    # a direction that stands in where there is none keeps gradients finite
    direction = jnp.where(moves, linear / jnp.where(moves, length, 1.0), jnp.array([1.0, 0.0, 0.0]))
    signals = jax.vmap(lambda *state: state_signals(arm, *state))(
        motion.q, motion.qd, motion.qdd, direction
    )
    moving = moves[:, 0]
    return signals.replace(
        effective_mass=jnp.where(moving, signals.effective_mass, 0.0),
        manipulability=jnp.where(moving, signals.manipulability, 0.0),
    )


def velocity_manipulability(
    arm: Robot, q: Float[Array, " n"], direction: Float[Array, "3"]
) -> Float[Array, ""]:
    """Square of the radius of the velocity ellipsoid, 1 / (uᵀ (J_v J_vᵀ)⁻¹ u); errata 18.

    `direction` is u, a unit vector in world axes.
    """
    jacobian = Matrix(components(hand_jacobian(arm, q)[:3]))
    half = cholesky(jacobian.gram()).solve_lower(components(direction))
    return jnp.asarray(1.0 / (half @ half), q.dtype)


def effort(arm: Robot, motion: GraspMotion, signals: AlongPath) -> Float[Array, ""]:
    """√Σ|τ(t_i)|², N m (thesis Eq. 4.20)."""
    return jnp.sqrt(jnp.sum(signals.torque**2))


def torque_energy(arm: Robot, motion: GraspMotion, signals: AlongPath) -> Float[Array, ""]:
    """H_TME = ∫|τ|² ds, (N m)² (thesis Eq. 6.6)."""
    return jnp.sum(motion.weight * jnp.sum(signals.torque**2, -1))


def mean_effective_mass(arm: Robot, motion: GraspMotion, signals: AlongPath) -> Float[Array, ""]:
    """H_TEM = ∫ m_e ds, kg (thesis Eq. 6.8)."""
    return jnp.sum(motion.weight * signals.effective_mass)


def inverse_manipulability(arm: Robot, motion: GraspMotion, signals: AlongPath) -> Float[Array, ""]:
    """1 / H_TOV with H_TOV = ∫ a² ds, 1/m² (thesis Eq. 6.4; errata 18)."""
    return 1.0 / jnp.sum(motion.weight * signals.manipulability)


def peak_torque(arm: Robot, motion: GraspMotion, signals: AlongPath) -> Float[Array, ""]:
    """Greatest torque of any joint as a share of its limit."""
    return jnp.max(jnp.abs(signals.torque) / jnp.asarray(arm.torque_limit))


def work(arm: Robot, motion: GraspMotion, signals: AlongPath) -> Float[Array, ""]:
    """Mechanical work of the joints, ∫Σ|τ q̇| dt, J: what drives that do not recover it spend."""
    power = jnp.sum(jnp.abs(signals.torque * motion.qd), -1)
    return jnp.sum(0.5 * (power[1:] + power[:-1]) * jnp.diff(motion.time))


METRICS: dict[str, Metric] = {
    "effort": effort,
    "energy": torque_energy,
    "effective_mass": mean_effective_mass,
    "inverse_manipulability": inverse_manipulability,
    "peak_torque": peak_torque,
    "work": work,
}
