"""Joint positions in which both hands hold the object where it should be, and manoeuvres from them.

In: a robot, an object, where it is and where it shall go. Out: configurations, `Manoeuvre`. The
target is a pose in the world; where the base is by then follows from its attitude, since the centre
of mass stays (errata 30).
"""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.robots import Robot
from mjx_inertia.robots.dynamics import pose_of
from mjx_inertia.robots.recursions import frames_at
from mjx_inertia.robots.robot import check_joints, joint_names
from mjx_inertia.space.capture import Capture, check_momentum, held_frames
from mjx_inertia.space.closure import following_joints
from mjx_inertia.space.manoeuvre import Manoeuvre, base_at, rotation_vector
from mjx_inertia.spatial import AnyArray, Consistency, Pose, check_consistency, explain_consistency

MOTIONS = ("consistent", "independent")
_FROM_AFAR = 60  # iterations
_STEP = 0.3  # rad or m: greatest change of a joint in one iteration
_REACHED = 1e-9  # m and rad


@dataclasses.dataclass(frozen=True)
class ManoeuvreSettings:
    """How a manoeuvre is modelled."""

    duration: float = 50.0  # s
    # "consistent" (joints obey the grasp) or "independent" (as the thesis prints it)
    motion: str = "consistent"
    momentum: str = "system"  # "system" (the object's counts) or "robot" (as the thesis prints it)
    # joints with coefficients of a consistent motion; the first ones if None
    leading: tuple[int, ...] | None = None
    nodes: int = 32  # of the quadrature

    def __post_init__(self) -> None:
        """Raises ValueError for what no manoeuvre has."""
        if self.motion not in MOTIONS:
            raise ValueError(f"`motion` is {self.motion!r}: expected one of {', '.join(MOTIONS)}")
        if self.leading and self.motion != "consistent":
            raise ValueError(
                f"`leading` is {self.leading}, but in {self.motion!r} motion every joint leads: "
                "leave it out"
            )
        check_momentum(self.momentum)
        if not 0.0 < self.duration < np.inf:
            raise ValueError(f"`duration` is {self.duration} s: expected more than zero")
        if self.nodes < 8:
            raise ValueError(f"`nodes` is {self.nodes}: expected 8 or more")


def plan_manoeuvre(
    robot: Robot,
    capture: Capture,
    T_world_start: Pose,
    T_world_obj: Pose,
    settings: ManoeuvreSettings | None = None,
    guess: Float[AnyArray, " n"] | None = None,
) -> Manoeuvre:
    """The manoeuvre that brings the object from one pose to another, the base at its old attitude.

    Args:
      robot: the tree; its base starts as the world's frame.
      capture: the object and how the hands hold it.
      T_world_start: where it is.
      T_world_obj: where it shall be.
      settings: of the model.
      guess: joint positions near the start; the middle of the limits if None.

    Raises:
      ValueError: a pose out of reach of the hands within the joints' limits, or not found from the
        guess; no pose, or one that a planar robot cannot reach; a robot without mass or with joints
        without limits, an object whose parameters are not physically consistent, leading joints
        whose followers cannot close the chain, or float32; each with its figures.
    """
    s = settings or ManoeuvreSettings()
    check_capture(capture)
    _check_robot(robot)
    for name, T in (("T_world_start", T_world_start), ("T_world_obj", T_world_obj)):
        _check_pose(name, T, robot.planar)
    every = tuple(range(robot.dof))
    leading = every if s.motion == "independent" else s.leading or every[: -len(robot.axes)]
    if s.motion == "consistent":
        following_joints(robot, leading)
    middle = (np.asarray(robot.lower) + np.asarray(robot.upper)) / 2.0
    near = jnp.asarray(middle if guess is None else guess, jnp.result_type(float))
    check_joints(robot, guess=near)
    if near.dtype != jnp.float64:
        raise ValueError(
            f"manoeuvres are planned in float64, not {near.dtype}: `jax.enable_x64(True)`, or "
            "`runtime.configure(float64=True)` in a program"
        )
    blank = Manoeuvre(
        robot, capture, near, near, T_world_start, s.duration, leading, s.momentum, s.nodes,
        1e-6 if s.motion == "consistent" else None,
    )  # fmt: skip
    # the robot is closed over rather than passed: its known zeros cost nothing to compile
    q_start, off = jax.jit(lambda T, q: _start(blank, T, q))(T_world_start, near)
    _check_reached("T_world_start", T_world_start, robot, q_start, off)

    def end(T: Pose, q: Float[Array, " n"]) -> tuple[Array, Array]:
        begun = blank.replace(q_start=q, q_end=q, T_world_obj=T)
        return end_configuration(begun, jnp.eye(3), _FROM_AFAR)

    q_end, off = jax.jit(end)(T_world_obj, q_start)
    _check_reached("T_world_obj", T_world_obj, robot, q_end, off)
    return blank.replace(q_start=q_start, q_end=q_end, T_world_obj=T_world_obj)


def end_configuration(
    manoeuvre: Manoeuvre, rotation: Float[Array, "3 3"], iterations: int = 12
) -> tuple[Float[Array, " n"], Float[Array, ""]]:
    """Joints that hold the object at the target when the base ends with attitude `rotation`.

    Of several the one near `q_end`, by steps of least norm; differentiable in `rotation`.

    Args:
      manoeuvre: with an end for some attitude.
      rotation: R_world_base at the end.
      iterations: of Newton's method; from far away take more.

    Returns:
      The positions, and what is left of the way to the target (m and rad).
    """
    m = manoeuvre

    def apart(q: Float[Array, " n"]) -> Float[Array, " h"]:
        return _apart(m, base_at(m, rotation, q), m.T_world_obj, q)

    return _reached(apart, jnp.asarray(m.q_end, rotation.dtype), iterations)


def self_motions(manoeuvre: Manoeuvre) -> Float[np.ndarray, "n r"]:
    """Ways in which the joints can move at the end while both hands stay: orthonormal columns.

    None for arms that have just the joints that their hands need.
    """
    m = manoeuvre

    def apart(q: Float[Array, " n"]) -> Float[Array, " h"]:
        return _apart(m, base_at(m, jnp.eye(3), q), m.T_world_obj, q)

    matrix = np.asarray(jax.jit(jax.jacfwd(apart))(jnp.asarray(m.q_end)))
    return np.linalg.svd(matrix)[2][len(matrix) :].T


def check_capture(capture: Capture) -> None:
    """Raises ValueError unless the object's parameters are physically consistent."""
    mass = float(np.asarray(capture.inertial.mass))
    if not mass > 0.0:
        raise ValueError(f"`capture` has a mass of {mass} kg: expected more than zero")
    if int(check_consistency(capture.inertial)) > Consistency.ON_BOUNDARY:
        raise ValueError(
            f"`capture` is no body that can be: {explain_consistency(capture.inertial)}"
        )


def _check_robot(robot: Robot) -> None:
    if robot.base is None or len(robot.hands) != 2:
        raise ValueError(
            f"`robot` has {len(robot.hands)} hands, and its base is "
            f"{'fixed' if robot.base is None else 'free'}: expected two on a free base"
        )
    masses = np.concatenate([np.ravel(robot.base.mass), np.ravel(robot.links.mass)])
    if not (np.all(np.isfinite(masses)) and masses[0] > 0.0 and np.all(masses >= 0.0)):
        raise ValueError(f"`robot` has masses {masses.tolist()} kg: expected more than zero")
    open_ended = ~(np.isfinite(robot.lower) & np.isfinite(robot.upper))
    if np.any(open_ended):
        i = int(np.argmax(open_ended))
        joint = joint_names(robot)[i]
        raise ValueError(
            f"`robot` has no limits at {joint}; Eq. 7.12 moves within the range between them: give "
            "them in its file, or by robot.replace(lower=..., upper=...)"
        )


def _check_pose(name: str, T: Pose, planar: bool) -> None:
    R, place = np.asarray(T.rotation), np.asarray(T.translation)
    if not (np.allclose(R @ R.T, np.eye(3), atol=1e-6) and np.linalg.det(R) > 0.0):
        raise ValueError(f"the rotation of `{name}` is {R.tolist()}: no rotation")
    if not np.all(np.isfinite(place)):
        raise ValueError(f"`{name}` is at {place.tolist()} m: expected finite numbers")
    if planar and not (abs(place[2]) < 1e-9 and np.allclose(R[2], [0.0, 0.0, 1.0], atol=1e-9)):
        raise ValueError(
            f"`{name}` at {place.tolist()} m is not in the plane z = 0 of the robot, or turned out "
            "of it"
        )


def _start(
    m: Manoeuvre, T_world_start: Pose, guess: Float[Array, " n"]
) -> tuple[Float[Array, " n"], Float[Array, ""]]:
    at_rest = Pose(jnp.eye(3), jnp.zeros(3))
    return _reached(lambda q: _apart(m, at_rest, T_world_start, q), guess, _FROM_AFAR)


def _reached(
    apart: Callable[[Float[Array, " n"]], Float[Array, " h"]],
    start: Float[Array, " n"],
    iterations: int,
) -> tuple[Float[Array, " n"], Float[Array, ""]]:
    def step(q: Float[Array, " n"], matrix: Float[Array, "h n"]) -> Float[Array, " n"]:
        square = matrix @ matrix.T
        # so little damping that it only keeps a singular configuration finite
        square += 1e-13 * jnp.trace(square) * jnp.eye(len(square), dtype=q.dtype)
        move = -matrix.T @ jnp.linalg.solve(square, apart(q))
        longest = jnp.max(jnp.abs(move))
        return q + move * jnp.minimum(1.0, _STEP / jnp.maximum(longest, 1e-30))

    slope = jax.jacfwd(apart)
    held = jax.lax.stop_gradient
    q = jax.lax.fori_loop(0, iterations, lambda _, q: held(step(q, slope(q))), held(start))
    q = step(held(q), held(slope(q)))  # the derivative of a step at the solution is the solution's
    return q, jnp.linalg.norm(apart(q))


def _apart(
    m: Manoeuvre, T_world_base: Pose, T_world_obj: Pose, q: Float[Array, " n"]
) -> Float[Array, " h"]:
    """Distance (m) and rotation vector (rad) from the target to the object in either hand."""
    rows = []
    for held in held_frames(m.robot, m.capture, frames_at(m.robot, q)):
        T_world_held = T_world_base @ pose_of(held, q.dtype)
        between = T_world_held.rotation @ T_world_obj.rotation.T
        way = T_world_held.translation - T_world_obj.translation
        both = jnp.concatenate([way, rotation_vector(m.robot, between)])
        rows.append(both[np.array(m.robot.axes)])
    return jnp.concatenate(rows)


def _check_reached(
    name: str, T: Pose, robot: Robot, q: Float[Array, " n"], off: Float[Array, ""]
) -> None:
    place = np.round(np.asarray(T.translation), 3).tolist()
    if not float(off) < _REACHED:
        raise ValueError(
            f"`{name}` at {place} m is out of reach, or not found from this guess: the hands "
            f"stay {float(off):.3g} (m, rad) from where they should be; move it nearer, turn it, "
            "or give another `guess`"
        )
    beyond = np.maximum(np.asarray(q) - robot.upper, robot.lower - np.asarray(q))
    if np.any(beyond > 0.0):
        worst = int(np.argmax(beyond))
        joint = joint_names(robot)[worst]
        raise ValueError(
            f"`{name}` at {place} m needs {joint} at {float(q[worst]):.4g}, outside its limits "
            f"{float(robot.lower[worst]):.4g} to {float(robot.upper[worst]):.4g}"
        )
