"""The least squeeze against a conic program, closed forms, and mechanics along a motion."""

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from contact_pairs import PAD, contact_pairs, facing, one, turned
from scipy.optimize import minimize

from mjx_inertia.grasping import SoftFinger
from mjx_inertia.grasping.contact_model import antipodal_margin, grasp_map, is_force_closure
from mjx_inertia.grasping.holding import ObjectMotion, gripping_force, holding_wrench
from mjx_inertia.grasping.two_soft_fingers import least_normal_force, least_squeeze
from mjx_inertia.spatial import InertialParameters

COUNT = 40


def gravity():
    return jnp.array([0.0, 0.0, -9.81])


def problem():
    rng = np.random.default_rng(1)
    wrench = rng.normal(size=(COUNT, 6)) * np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05])
    reference = rng.normal(size=(COUNT, 3)) * 0.03
    return contact_pairs(COUNT), jnp.asarray(wrench), jnp.asarray(reference)


def squeeze(contacts, wrench, reference):
    return least_squeeze(contacts, PAD, wrench, reference)


@jax.jit
@jax.vmap
def least_forces(contacts, wrench, reference):
    """Squeeze, sum of the normal forces, greater of them; and what they say of each other."""
    return jnp.stack(
        [
            squeeze(contacts, wrench, reference),
            least_normal_force(contacts, PAD, wrench, reference),
            least_normal_force(contacts, PAD, wrench, reference, norm="linf"),
        ]
    )


def conic_program(contacts, wrench, reference, kind):
    """The same by SLSQP over all eight contact forces."""
    scale = np.array([1.0, 1.0, 1.0, 20.0, 20.0, 20.0])
    balance = np.asarray(grasp_map(contacts, reference)) * scale[:, None]
    load = np.asarray(wrench) * scale
    across = np.asarray(contacts.points[1] - contacts.points[0])
    across = across / np.linalg.norm(across)
    goal = np.zeros(8)
    goal[[0, 4]] = 1.0
    if kind == 0:  # half the difference along the line: columns of the map are the force axes
        map_ = np.asarray(grasp_map(contacts, reference))[:3]
        goal = 0.5 * np.where(np.arange(8) < 4, 1.0, -1.0) * (across @ map_)
    start = np.linalg.lstsq(balance, load, rcond=None)[0] + 50.0 * (np.arange(8) % 4 == 0)
    cones = [
        lambda x: x[0] - np.sqrt(4.0 * (x[1] ** 2 + x[2] ** 2) + (x[3] / 0.004) ** 2 + 1e-16),
        lambda x: x[4] - np.sqrt(4.0 * (x[5] ** 2 + x[6] ** 2) + (x[7] / 0.004) ** 2 + 1e-16),
    ]
    found = minimize(
        lambda x: goal @ x,
        start,
        jac=lambda x: goal,
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-12},
        constraints=[
            {"type": "eq", "fun": lambda x: balance @ x - load, "jac": lambda x: balance},
            *({"type": "ineq", "fun": cone} for cone in cones),
        ],
    )
    return found.fun


def test_is_the_solution_of_the_conic_program():
    contacts, wrench, reference = problem()
    forces = np.asarray(least_forces(contacts, wrench, reference))
    rows = np.flatnonzero(np.isfinite(forces[:, 0]))[:10]
    for row in rows:
        for kind in (0, 1):
            expected = conic_program(one(contacts, row), wrench[row], reference[row], kind)
            assert forces[row, kind] == pytest.approx(expected, rel=1e-5)
    total, greater = forces[rows, 1], forces[rows, 2]
    assert np.all(greater >= 0.5 * total * (1.0 - 1e-9))
    assert np.all(greater <= total * (1.0 + 1e-9))


def test_infinite_exactly_without_force_closure():
    contacts, wrench, reference = problem()
    forces = least_forces(contacts, wrench, reference)
    closed = jax.vmap(lambda pair: is_force_closure(pair, PAD))(contacts)
    assert 0 < np.sum(closed) < COUNT
    np.testing.assert_array_equal(np.isfinite(forces), np.repeat(np.asarray(closed)[:, None], 3, 1))


def test_scales_with_the_wrench_and_not_with_the_frame():
    contacts, wrench, reference = problem()
    forces = np.asarray(least_forces(contacts, wrench, reference))
    np.testing.assert_allclose(least_forces(contacts, 3.0 * wrench, reference), 3.0 * forces)
    pose = jaxlie.SE3.exp(jnp.array([0.3, -0.2, 0.5, 0.7, -1.1, 0.4]))
    turn = jax.vmap(pose.rotation().apply)
    moved_wrench = jnp.concatenate([turn(wrench[:, :3]), turn(wrench[:, 3:])], axis=1)
    moved = least_forces(turned(contacts, pose), moved_wrench, jax.vmap(pose.apply)(reference))
    np.testing.assert_allclose(moved, forces, rtol=1e-7)


def test_gradient_against_finite_differences():
    contacts, wrench, reference = problem()
    closed = np.asarray(jax.vmap(lambda pair: antipodal_margin(pair, PAD))(contacts)) > 0.1
    gradient = jax.jit(jax.vmap(jax.grad(lambda w, c, r: squeeze(c, w, r))))
    slope = np.asarray(gradient(wrench, contacts, reference))
    points = jax.jit(jax.vmap(jax.grad(squeeze)))(contacts, wrench, reference).points
    step, rng = 1e-6, np.random.default_rng(0)
    turn, shift = rng.normal(size=(6,)), rng.normal(size=(2, 3)) * 0.1
    up, down = (
        least_forces(contacts, wrench + s * step * turn, reference)[:, 0] for s in (1.0, -1.0)
    )
    numeric = (up - down) / (2.0 * step)
    np.testing.assert_allclose((slope @ turn)[closed], numeric[closed], rtol=2e-5)
    up, down = (
        least_forces(contacts.replace(points=contacts.points + s * step * shift), wrench, reference)
        for s in (1.0, -1.0)
    )
    numeric = (up - down)[:, 0] / (2.0 * step)
    by_points = np.sum(np.asarray(points) * shift, axis=(1, 2))
    np.testing.assert_allclose(by_points[closed], numeric[closed], rtol=2e-4)


def at_rest():
    return ObjectMotion(jnp.eye(3), jnp.zeros(3), jnp.zeros(3), jnp.zeros(3))


def held(com, mass=0.5):
    return InertialParameters(jnp.asarray(mass), jnp.asarray(com), 1e-3 * jnp.eye(3))


def test_where_the_com_is_decides_the_force():
    """Pads along y hold against gravity along -z; the CoM is aside along x, or along y."""
    force = jax.jit(lambda com: gripping_force(facing(0.05), PAD, held(com), at_rest(), gravity()))
    weight = 0.5 * 9.81
    centered = 0.5 * weight / 0.5
    assert float(force(jnp.zeros(3))) == pytest.approx(centered, rel=1e-9)
    for lever in (0.005, 0.02, 0.1):  # torsion: each pad bears half of weight and moment
        expected = 0.5 * weight * np.hypot(1.0 / 0.5, lever / 0.004)
        assert float(force(jnp.array([lever, 0.0, 0.0]))) == pytest.approx(expected, rel=1e-9)
    # at 1 cm it is already 1.6 times what a hand needs that takes the CoM for centred
    assert float(force(jnp.array([0.01, 0.0, 0.0]))) > 1.59 * centered
    # nearer to one pad: this one bears more, by the lever rule
    aside = float(force(jnp.array([0.0, 0.01, 0.0])))
    assert aside == pytest.approx(weight * (0.5 + 0.01 / 0.05) / 0.5, rel=1e-9)
    # below the pads it does not matter at all
    assert float(force(jnp.array([0.0, 0.0, -0.1]))) == pytest.approx(centered, rel=1e-9)


def test_load_along_the_closing_direction_is_borne_by_the_guide():
    motion = at_rest().replace(acceleration=jnp.array([0.0, 4.0, 0.0]))
    force = gripping_force(facing(0.05), PAD, held(jnp.zeros(3)), motion, jnp.zeros(3))
    # one pad pushes with m a, the other not at all: half their difference
    assert float(force) == pytest.approx(0.5 * 0.5 * 4.0, rel=1e-9)


def test_hard_contacts_need_far_more():
    payload = held(jnp.array([0.01, 0.0, 0.0]))
    forces = [
        float(gripping_force(facing(0.05), SoftFinger(0.5, g), payload, at_rest(), gravity()))
        for g in (1e-2, 1e-3, 1e-4)
    ]
    assert forces[0] < forces[1] < forces[2]
    assert forces[2] > 40.0 * forces[0]


def test_holding_wrench_is_the_rate_of_momentum():
    payload = InertialParameters(
        jnp.asarray(0.7),
        jnp.array([0.03, -0.05, 0.1]),
        1e-3 * jnp.array([[2.0, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1.2]]),
    )

    def pose(t):
        bend = jnp.array([0.5, -0.3, 0.8]) * t + jnp.array([-1.0, 0.4, 0.2]) * t**2
        place = jnp.array([0.2, 0.1, -0.4]) * t**2 + jnp.array([1.0, -2.0, 0.5]) * t**3
        return jaxlie.SO3.exp(bend).as_matrix(), place

    def spin(t):
        rotation, rate = jax.jvp(lambda s: pose(s)[0], (t,), (1.0,))
        matrix = rate @ rotation.T
        return jnp.stack([matrix[2, 1], matrix[0, 2], matrix[1, 0]])

    def momentum(t):
        rotation, _ = pose(t)
        velocity = jax.jvp(lambda s: pose(s)[1] + pose(s)[0] @ payload.com, (t,), (1.0,))[1]
        angular = rotation @ payload.inertia @ rotation.T @ spin(t)
        return jnp.concatenate([payload.mass * velocity, angular])

    @jax.jit
    def both(t):
        rate = jax.jvp(momentum, (t,), (1.0,))[1]
        velocity = jax.jacfwd(lambda s: pose(s)[1])
        motion = ObjectMotion(pose(t)[0], jax.jacfwd(velocity)(t), spin(t), jax.jacfwd(spin)(t))
        wrench = holding_wrench(payload, motion, gravity())
        rotation = motion.R_world_obj
        in_world = jnp.concatenate([rotation @ wrench[:3], rotation @ wrench[3:]])
        return rate, in_world

    rate, wrench = both(0.7)
    rate = rate.at[:3].add(-payload.mass * gravity())
    np.testing.assert_allclose(wrench, rate, rtol=1e-9, atol=1e-12)


def test_no_load_and_float32():
    assert float(squeeze(facing(0.04), jnp.zeros(6), jnp.zeros(3))) == pytest.approx(0.0, abs=1e-12)
    contacts, wrench, reference = problem()
    exact = np.asarray(least_forces(contacts, wrench, reference))
    with jax.enable_x64(False):
        single = jax.tree.map(
            lambda x: jnp.asarray(np.asarray(x), jnp.float32), (contacts, wrench, reference)
        )
        rounded = np.asarray(jax.vmap(squeeze)(*single))
        assert rounded.dtype == np.float32
    margin = np.asarray(jax.vmap(lambda pair: antipodal_margin(pair, PAD))(contacts))
    sure = margin > 0.02
    np.testing.assert_allclose(rounded[sure], exact[sure, 0], rtol=1e-3)


def test_another_norm_is_an_error():
    with pytest.raises(ValueError, match="`norm`"):
        least_normal_force(facing(0.04), PAD, jnp.zeros(6), jnp.zeros(3), norm="l2")


@pytest.mark.parametrize("length", [0.0, 2.0, np.nan])
def test_contacts_without_unit_normals_hold_nothing(length):
    contacts = facing(0.05)
    spoilt = contacts.replace(normals=length * contacts.normals)
    force = gripping_force(spoilt, PAD, held(jnp.zeros(3)), at_rest(), gravity())
    assert force == np.inf


@pytest.mark.parametrize("mass", [-1.0, np.nan])
def test_a_mass_that_cannot_be_is_not_held(mass):
    payload = held(jnp.zeros(3)).replace(mass=jnp.asarray(mass))
    assert gripping_force(facing(0.05), PAD, payload, at_rest(), gravity()) == np.inf
