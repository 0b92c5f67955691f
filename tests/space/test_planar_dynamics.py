"""The planar robot in closed form against the recursions along its tree: two derivations of Ch. 7.

The closed form works in inertial axes and sums m Jᵀ J; the recursions work in the base's axes.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.space import PlanarSettings, planar_dynamics as closed, planar_robot
from mjx_inertia.space.capture import with_capture
from mjx_inertia.space.dual_arm import dual_arm_grasp_map
from mjx_inertia.space.dynamics import (
    generalized_jacobian,
    hand_jacobians,
    inertias,
    reduced_forces,
    reduced_inertia,
    velocity_forces,
)
from mjx_inertia.space.instant import node
from mjx_inertia.space.planar_model import link_moments, planar_capture

SETTINGS = PlanarSettings(link_inertia="physical", shoulder=(0.6, 0.9))
ROBOT, CAPTURE = planar_robot(SETTINGS), planar_capture(SETTINGS)
MODELS = ("robot", "system")
COUNT = 1000


@pytest.fixture(scope="module")
def states():
    """Attitudes, joint positions (away from singular ones), rates of all, joint accelerations."""
    rng = np.random.default_rng(3)
    q = rng.uniform(0.3, 1.2, (COUNT, 6))
    return rng.uniform(-3, 3, COUNT), q, rng.normal(size=(COUNT, 9)), rng.normal(size=(COUNT, 6))


@pytest.fixture(scope="module")
def recursions(states):
    """Matrices and nodes of both models of momentum, in the base's axes."""

    def one(q, twist, qd, qdd):
        found = {"hands": hand_jacobians(ROBOT, q), "grasp": dual_arm_grasp_map(ROBOT, CAPTURE, q)}
        for name in MODELS:
            robot = with_capture(ROBOT, CAPTURE, name)
            matrix = inertias(robot, q)
            forces = velocity_forces(robot, q, twist, qd)
            found[name] = {
                "H": jnp.block(
                    [[matrix.base, matrix.coupling], [matrix.coupling.T, matrix.joints]]
                ),
                "c": jnp.concatenate([forces.base, forces.joints]),
                "J_g": generalized_jacobian(robot, q),
                "H_el": reduced_inertia(matrix),
                "c_el": reduced_forces(matrix, forces),
                "node": node(ROBOT, CAPTURE, q, qd, qdd, name),
            }
        return found

    theta, q, rates, qdd = states
    twist = times(transposed(turned(theta, 3)), rates[:, :3])
    with jax.enable_x64(True):
        found = jax.jit(jax.vmap(one))(q, twist, rates[:, 3:], qdd)
    return jax.tree.map(np.asarray, found)


def turned(theta, size):
    """The base's axes in inertial ones, for vectors that begin with (x, y)."""
    c, s = np.cos(theta), np.sin(theta)
    R = np.tile(np.eye(size), (len(theta), 1, 1))
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1] = c, -s, s, c
    return R


def closed_form(name, theta, q, rates, xp=np):
    """Terms of a model of momentum; the object's are added to the robot's."""
    terms = closed.planar_terms(SETTINGS, theta, q, xp)
    velocity = closed.velocity_terms(SETTINGS, terms, rates, xp)
    if name == "system":
        H, c = closed.object_terms(SETTINGS, terms, rates, xp)
        terms = terms._replace(H=terms.H + H)
        velocity = velocity._replace(c=velocity.c + c)
    return terms, velocity


def at_rest(name, q, qd):
    """The closed form at attitude zero and without momentum, and the base's twist there."""
    zero = np.zeros(COUNT)
    still = np.concatenate([np.zeros((COUNT, 3)), qd], 1)
    terms, _ = closed_form(name, zero, q, still)
    J_a = closed.planar_momentum_map(terms, np)
    twist = times(J_a, qd)
    terms, velocity = closed_form(name, zero, q, np.concatenate([twist, qd], 1))
    return terms, velocity, J_a, twist


def times(matrix, vector):
    return np.einsum("nij,nj->ni", matrix, vector)


def transposed(matrix):
    return np.swapaxes(matrix, 1, 2)


def assert_near(actual, expected, tolerance=1e-11):
    """Error of each state against the state's largest entry."""
    axes = tuple(range(1, expected.ndim))
    error = np.max(np.abs(actual - expected), axes) / np.maximum(np.max(np.abs(expected), axes), 1)
    assert np.max(error) < tolerance, np.max(error)


@pytest.mark.long
@pytest.mark.parametrize("name", MODELS)
def test_mass_matrix_and_velocity_forces_of_equation_7_1(name, states, recursions):
    theta, q, rates, _ = states
    terms, velocity = closed_form(name, theta, q, rates)
    T = turned(theta, 9)
    assert_near(T @ recursions[name]["H"] @ transposed(T), terms.H)
    assert_near(times(T, recursions[name]["c"]), velocity.c)


@pytest.mark.parametrize("name", MODELS)
def test_generalized_jacobian_and_reduced_dynamics(name, states, recursions):
    """Eqs 7.5, 7.7 and 7.8 with errata 22 and 23."""
    theta, q, rates, _ = states
    terms, velocity = closed_form(name, theta, q, rates)
    reduced = closed.reduced_terms(terms, velocity, closed.planar_momentum_map(terms, np), np)
    T = np.kron(np.eye(2), np.ones((3, 3))) * np.tile(turned(theta, 3), (1, 2, 2))
    assert_near(T @ recursions[name]["J_g"], reduced.J_g)
    assert_near(recursions[name]["H_el"], reduced.H_el)
    assert_near(recursions[name]["c_el"], reduced.c_el)


def test_hands(states, recursions):
    """J_b and J_e of Eq. 7.4, the grasp map, and where the right hand has the object."""
    q = states[1]
    terms = closed.planar_terms(SETTINGS, np.zeros(COUNT), q, np)
    of_base, of_joints = recursions["hands"]
    both = np.concatenate([of_base, of_joints], -1).reshape(COUNT, 6, 9)
    assert_near(both, terms.J)
    place = object_place(terms)
    assert_near(recursions["system"]["node"].object_place[:, :2], place)
    assert_near(recursions["grasp"], closed.planar_grasp_map(place, terms.hands, np))


def test_hands_move_as_their_jacobian_says(states):
    """Against differences of positions; and J̇ ẋ against those of the Jacobian."""
    theta, q, rates, _ = states
    step = 1e-6

    def moved(sign):
        angle, joints = theta + sign * step * rates[:, 2], q + sign * step * rates[:, 3:]
        return closed.planar_terms(SETTINGS, angle, joints, np)

    ahead, behind, terms = moved(1.0), moved(-1.0), moved(0.0)
    slope = (ahead.hands - behind.hands) / (2.0 * step)
    slope[..., :2] += rates[:, None, :2]
    assert_near(times(terms.J, rates).reshape(slope.shape), slope, 1e-8)
    bias = times(ahead.J - behind.J, rates) / (2.0 * step)
    velocity = closed.velocity_terms(SETTINGS, terms, rates, np)
    assert_near(velocity.Jdot_xdot, bias, 1e-8)


@pytest.mark.parametrize("name", MODELS)
def test_motion_without_momentum(name, states, recursions):
    """Twist and acceleration of the base, torques: Eqs 7.3 and 7.6."""
    _, q, rates, qdd = states
    qd, found = rates[:, 3:], recursions[name]["node"]
    terms, velocity, J_a, twist = at_rest(name, q, qd)
    reduced = closed.reduced_terms(terms, velocity, J_a, np)
    assert_near(found.base_twist, twist)
    pushed = times(terms.H[:, :3, 3:], qdd) + velocity.c[:, :3]
    gain = -np.linalg.solve(terms.H[:, :3, :3], pushed[..., None])[..., 0]
    assert_near(found.base_acceleration, gain)
    assert_near(found.torque, times(reduced.H_el, qdd) + reduced.c_el)
    assert_near(found.manipulability, np.abs(np.linalg.det(reduced.J_g)), 1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_wrenches_on_the_object(name, states, recursions):
    """F_tot = G J_g⁻ᵀ τ; the model as printed adds the object's own dynamics (Eq. 7.10)."""
    _, q, rates, qdd = states
    qd, found = rates[:, 3:], recursions[name]["node"]
    terms, velocity, J_a, twist = at_rest(name, q, qd)
    reduced = closed.reduced_terms(terms, velocity, J_a, np)
    torque = times(reduced.H_el, qdd) + reduced.c_el
    hands = np.linalg.solve(transposed(reduced.J_g), torque[..., None])[..., 0]
    total = times(closed.planar_grasp_map(object_place(terms), terms.hands, np), hands)
    # what moves the object: its generalised forces at the base are its wrench about the base
    H, c = closed.object_terms(SETTINGS, terms, np.concatenate([twist, qd], 1), np)
    own = (times(H, np.concatenate([found.base_acceleration, qdd], 1)) + c)[:, :3]
    own[:, 2] -= cross(object_place(terms), own)
    if name == "robot":
        total = total + own
    back = transposed(found.object_rotation)
    assert_near(found.object_wrench, times(back, own))
    # J_g of random positions can be near singular: its condition is what rounding is held against
    error = np.abs(found.total_wrench - times(back, total)).max(1) / np.abs(hands).max(1)
    assert np.all(error < 1e-13 * np.linalg.cond(reduced.J_g) ** 2)


def test_backends_agree(states):
    theta, q, rates, _ = states

    def everything(theta, q, rates, xp):
        terms, velocity = closed_form("system", theta, q, rates, xp)
        reduced = closed.reduced_terms(terms, velocity, closed.planar_momentum_map(terms, xp), xp)
        G = closed.planar_grasp_map(object_place(terms, xp), terms.hands, xp)
        return terms, velocity, reduced, G

    ours = jax.jit(lambda *state: everything(*state, jnp))(theta, q, rates)
    wanted = everything(theta, q, rates, np)
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(wanted), strict=True):
        assert_near(np.asarray(a), b, 1e-12)


def test_figures_of_table_7_1():
    s = PlanarSettings()
    robot, capture = planar_robot(s), planar_capture(s)
    np.testing.assert_allclose(np.asarray(robot.links.mass), [5, 4, 3, 5, 4, 3])
    np.testing.assert_allclose(link_moments(s), [0.1, 0.08, 0.06])
    physical = link_moments(PlanarSettings(link_inertia="physical"))
    np.testing.assert_allclose(physical, [0.65, 0.4433333333, 0.28])  # errata 28
    assert (float(robot.base.mass), float(robot.base.inertia[2, 2])) == (300.0, 200.0)
    assert float(capture.inertial.mass) == 10.0
    np.testing.assert_allclose(capture.inertial.inertia[2, 2], 0.64)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"link_inertia": "thin"}, "`link_inertia` is 'thin'"),
        ({"base_mass": 0.0}, "`base_mass` is 0.0"),
        ({"link_length": (1.2, -1.0, 1.0)}, "`link_length` is"),
        ({"lower": (-3.0, 3.5, -3.0)}, "must lie below"),
    ],
)
def test_figures_that_no_robot_has(settings, words):
    with pytest.raises(ValueError, match=words):
        PlanarSettings(**settings)


def object_place(terms, xp=np):
    """Centre of the sphere by the right hand, against the base's origin."""
    angle = terms.hands[..., 0, 2]
    ahead = xp.stack([-xp.sin(angle), xp.cos(angle)], -1)
    return terms.hands[..., 0, :2] + SETTINGS.object_radius * ahead


def cross(place, force):
    return place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0]
