"""What a manoeuvre costs: thesis Eqs 7.17 to 7.21, and further costs behind the same names.

In: a `Manoeuvre` and the `Course` of a decision. Out: numbers, the less the better; `problem`
makes of them what `search` minimises. The thesis' norms are those of signals sampled at 100 Hz,
√Σ F²; here they are integrals of as many samples' worth, equal to 1e-6 (docs/space.md). Costs of
torques, energy and power are those of joints whose first hand carries the whole object.
"""

from collections.abc import Callable, Mapping, Sequence

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.robots import over_states
from mjx_inertia.search import Evaluation, Problem
from mjx_inertia.space.collision_distance import clearance
from mjx_inertia.space.manoeuvre import RESOLVED, Course, Manoeuvre, course
from mjx_inertia.space.manoeuvre_planning import end_configuration, self_motions
from mjx_inertia.space.quadrature import interpolation_matrix
from mjx_inertia.space.trajectory import BOUND
from mjx_inertia.spatial.components import root
from mjx_inertia.spatial.extremes import greatest, least

Objective = Callable[[Manoeuvre, Course], Float[Array, ""]]

SAMPLE_TIME = 0.01  # s: of the signals whose norm Eq. 7.17 takes
_BLOCK = 64  # decisions computed at once on a core
_INSTANTS = tuple(np.linspace(0.0, 1.0, 201).tolist())  # at which peaks are looked for


def _wrench(part: str, axis: int) -> Objective:
    """C_f1 to C_f3, Eq. 7.17: norm of a component over the samples, N or N m."""

    def cost(m: Manoeuvre, c: Course) -> Float[Array, ""]:
        return _sampled_norm(m, getattr(c.nodes, part)[:, m.robot.axes.index(axis)][:, None])

    return cost


def _wrench_norm(part: str, angular: bool) -> Objective:
    def cost(m: Manoeuvre, c: Course) -> Float[Array, ""]:
        return _sampled_norm(m, _part(m, getattr(c.nodes, part), angular))

    return cost


def _entry(name: str, i: int) -> Objective:
    """C_f4 to C_f9, Eqs 7.19 and 7.21: of the base, or of both hands together, m or rad."""
    return lambda m, c: _norm(getattr(c, name)[..., i])


def _whole(name: str) -> Objective:
    return lambda m, c: _norm(getattr(c, name))


def _peak(part: str, angular: bool) -> Objective:
    def cost(m: Manoeuvre, c: Course) -> Float[Array, ""]:
        signal = _at_instants(m, _part(m, getattr(c.nodes, part), angular))
        return jnp.asarray(root(greatest(jnp.sum(signal**2, 1))))

    return cost


def _power(m: Manoeuvre, c: Course) -> Float[Array, "t n"]:
    return _at_instants(m, c.nodes.torque * c.motion.qd)


def _effort(m: Manoeuvre, c: Course) -> Float[Array, ""]:
    return _sampled_norm(m, c.nodes.torque)


def _energy(m: Manoeuvre, c: Course) -> Float[Array, ""]:
    """What drives that do not feed back take, J."""
    # the trapezoidal rule: at both ends nothing moves
    return m.duration / (len(_INSTANTS) - 1) * jnp.sum(jnp.abs(_power(m, c)))


def _clearance(m: Manoeuvre, c: Course) -> Float[Array, ""]:
    q = _at_instants(m, c.motion.q)
    near = jax.vmap(lambda q: clearance(m.robot, m.capture, q))(q)
    return -least(near)


OBJECTIVES: dict[str, Objective] = {
    **{f"force_{a}": _wrench("total_wrench", i) for i, a in enumerate("xyz")},
    **{f"moment_{a}": _wrench("total_wrench", i + 3) for i, a in enumerate("xyz")},
    **{f"object_force_{a}": _wrench("object_wrench", i) for i, a in enumerate("xyz")},
    **{f"object_moment_{a}": _wrench("object_wrench", i + 3) for i, a in enumerate("xyz")},
    **{f"base_{a}": _entry("base_place", i) for i, a in enumerate("xyz")},
    **{f"base_turn_{a}": _entry("base_turn", i) for i, a in enumerate("xyz")},
    **{f"hand_{a}": _entry("hand_error", i) for i, a in enumerate("xyz")},
    **{f"hand_turn_{a}": _entry("hand_turn", i) for i, a in enumerate("xyz")},
    "force": _wrench_norm("total_wrench", False),
    "moment": _wrench_norm("total_wrench", True),
    "object_force": _wrench_norm("object_wrench", False),
    "object_moment": _wrench_norm("object_wrench", True),
    "base_distance": _whole("base_place"),
    "base_turn": _whole("base_turn"),
    "hand_distance": _whole("hand_error"),
    "hand_turn": _whole("hand_turn"),
    "peak_force": _peak("total_wrench", False),
    "peak_moment": _peak("total_wrench", True),
    "peak_object_force": _peak("object_wrench", False),
    "peak_object_moment": _peak("object_wrench", True),
    "effort": _effort,
    "joint_energy": _energy,
    "peak_power": lambda m, c: greatest(jnp.abs(jnp.sum(_power(m, c), 1))),
    "singularity": lambda m, c: 1.0 / least(c.nodes.manipulability),
    "overlap": _clearance,  # the negative of the least clearance, m
    "closure_distance": lambda m, c: c.closure[0],
    "closure_angle": lambda m, c: c.closure[1],
}

# costs of F_tot and J_g; a problem without one leaves both out of its courses
_OF_TOTAL = frozenset(
    name
    for name in OBJECTIVES
    if name.removeprefix("peak_").startswith(("force", "moment")) or name == "singularity"
)

WRENCH = ("force_x", "force_y", "moment_z")
BASE_DRIFT = ("base_x", "base_y", "base_turn_z")
HANDS = ("hand_x", "hand_y", "hand_turn_z")
THESIS = WRENCH + BASE_DRIFT + HANDS  # C_f1 to C_f9


def costs(m: Manoeuvre, c: Course, names: Sequence[str] = THESIS) -> Float[Array, " k"]:
    """Costs of a course by their names in `OBJECTIVES`."""
    return jnp.stack([OBJECTIVES[name](m, c) for name in names])


def violation(m: Manoeuvre, c: Course, bounds: Mapping[str, float]) -> Float[Array, ""]:
    """How far a course is from being allowed: 0 if it is, NaN or infinite if it failed.

    Args:
      m: the manoeuvre.
      c: the course.
      bounds: greatest values of costs by name; an excess counts in shares of a bound that is not
        zero.
    """
    total = c.limit_excess + jnp.maximum(c.unresolved - RESOLVED, 0.0)
    if m.closure_limit is not None:
        total += jnp.maximum(greatest(c.closure) - m.closure_limit, 0.0)
    for name, bound in bounds.items():
        total += jnp.maximum(OBJECTIVES[name](m, c) - bound, 0.0) / (abs(bound) or 1.0)
    return total


def problem(
    manoeuvre: Manoeuvre,
    names: Sequence[str] = THESIS,
    *,
    bounds: Mapping[str, float] | None = None,
    arrive: bool = False,
    swing: float = 0.0,
) -> Problem:
    """Coefficients of a manoeuvre, and optionally where the joints end, as a search problem.

    Without a cost of the total wrench or of J_g's singularity, a motion through a singular J_g is
    allowed (see `course`).

    Args:
      manoeuvre: what is to be done.
      names: of the costs.
      bounds: greatest values of costs by name, as constraints.
      arrive: whether the joints end where they hold the object at its target from the base as this
        decision leaves it (see `with_object_at_target`), rather than from a base that has not
        turned.
      swing: rad; if not zero, the joints' end is free within ± `swing` along each motion that
        leaves both hands where they are (elbows of arms with more joints than their hands need).

    Raises:
      ValueError: a name that is no cost, a cost that this robot does not have, or a bound that is
        not finite.
    """
    limits = dict(bounds or {})
    _check_names(manoeuvre, [*names, *limits])
    for name, bound in limits.items():
        if not np.isfinite(bound):
            raise ValueError(f"`bounds` has {name!r}: {bound}: expected a finite number")
    total = not _OF_TOTAL.isdisjoint([*names, *limits])
    ways = jnp.asarray(self_motions(manoeuvre) if swing else np.zeros((manoeuvre.robot.dof, 0)))
    size = manoeuvre.size

    @jax.jit  # traced once for all searches and calls
    def evaluate(decision: Float[Array, " d"]) -> Evaluation:
        m, coefficients = manoeuvre, decision[:size]
        if ways.size:
            m = with_base_rotation(m, jnp.zeros(3, decision.dtype), ways @ decision[size:])
        if arrive:
            m = with_object_at_target(m, coefficients)
        c = course(m, coefficients, total)
        return Evaluation(costs(m, c, names), violation(m, c, limits))

    upper = np.concatenate([np.full(size, BOUND), np.full(ways.shape[1], swing)])
    return Problem(
        evaluate, -upper, upper, tuple(names), evaluate_many=over_states(evaluate, _BLOCK)
    )


def with_base_rotation(
    manoeuvre: Manoeuvre, turn: Float[Array, "3"], moved: Float[Array, " n"] | float = 0.0
) -> Manoeuvre:
    """The manoeuvre with joints that end as for a base that has turned; the target stays.

    Args:
      manoeuvre: with an end for a base that has not turned.
      turn: rotation vector of the base at the end that the joints' end is made for, rad. How far
        the base really turns, and whether the target is out of reach then, the errors of the hands
        tell.
      moved: added to the joints' end before it is brought to hold the object, rad (m).
    """
    m = manoeuvre.replace(q_end=jnp.asarray(manoeuvre.q_end) + moved)
    q_end, _ = end_configuration(m, jaxlie.SO3.exp(turn).as_matrix())
    return m.replace(q_end=q_end)


def with_object_at_target(
    manoeuvre: Manoeuvre, coefficients: Float[Array, " c"], rounds: int = 6
) -> Manoeuvre:
    """The manoeuvre with joints that end where the object is at its target, the base as it ends.

    The end is made for an attitude, and the way to that end turns the base otherwise; each round
    makes the end for the last one's attitude and leaves about a tenth of the hands' error.

    Args:
      manoeuvre: with an end for some attitude.
      coefficients: of the leading joints.
      rounds: courses that are computed for it.
    """

    def onward(turn: Float[Array, "3"], _: None) -> tuple[Float[Array, "3"], None]:
        return course(
            with_base_rotation(manoeuvre, turn), coefficients, total=False
        ).base_turn, None

    start = jnp.zeros(3, coefficients.dtype)
    turn, _ = jax.lax.scan(onward, start, None, rounds)
    return with_base_rotation(manoeuvre, turn)


def _check_names(m: Manoeuvre, names: Sequence[str]) -> None:
    for name in names:
        if name not in OBJECTIVES:
            raise ValueError(f"{name!r} is no cost; there are {', '.join(OBJECTIVES)}")
        flat = ("force_z", "moment_x", "moment_y", "_turn_x", "_turn_y", "base_z", "hand_z")
        if m.robot.planar and name.endswith(flat):
            raise ValueError(f"{name!r} is always zero in the plane; choose others")


def _part(m: Manoeuvre, wrench: Float[Array, "t k"], angular: bool) -> Float[Array, "t _"]:
    """Forces or moments of wrenches."""
    chosen = [k for k, axis in enumerate(m.robot.axes) if (axis >= 3) == angular]
    return wrench[:, np.array(chosen)]


def _sampled_norm(m: Manoeuvre, signal: Float[Array, "t c"]) -> Float[Array, ""]:
    """√Σ over samples every `SAMPLE_TIME`: their number times the mean square."""
    mean = jnp.sum(jnp.asarray(m.rule.weights, signal.dtype) @ signal**2)
    return jnp.asarray(root(m.duration / SAMPLE_TIME * mean))


def _norm(vector: Float[Array, "..."]) -> Float[Array, ""]:
    return jnp.asarray(root(jnp.sum(vector**2)))


def _at_instants(m: Manoeuvre, signal: Float[Array, "t c"]) -> Float[Array, "i c"]:
    return jnp.asarray(interpolation_matrix(m.nodes, _INSTANTS), signal.dtype) @ signal
