"""Joint motions of a held object and what they cost: against MuJoCo, NumPy and differences."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_inertia.grasping import (
    METRICS,
    GraspStatus,
    Move,
    ReachSettings,
    Task,
    evaluate_grasps,
    grasp_costs,
    object_path,
    plan_motion,
)
from mjx_inertia.robots import baxter, hand_jacobian, robot_spec, with_payload
from mjx_inertia.spatial import InertialParameters, Pose

pytestmark = pytest.mark.float64

TASK = Task(
    "curve",
    (Move(translation=(0.08, -0.1, 0.06), rotation_deg=(20.0, 0.0, 35.0), duration=1.5),
     Move(translation=(0.0, 0.1, 0.0), duration=1.0)),
)  # fmt: skip
DOWN = np.diag([1.0, -1.0, -1.0])
QUICK = ReachSettings(starts=4)


@pytest.fixture(scope="module")
def arm():
    return baxter("left")


def payload():
    with jax.enable_x64(True):
        return InertialParameters(
            jnp.asarray(0.4),
            jnp.array([0.03, -0.02, 0.04]),
            jnp.array([[4e-3, 1e-4, 0.0], [1e-4, 3e-3, 2e-4], [0.0, 2e-4, 2e-3]]),
        )


def hands(n=6):
    """Hands that point down on an object, turned and beside each other."""
    angles = np.radians(np.linspace(-60.0, 60.0, n))
    turns = Rotation.from_rotvec(angles[:, None] * [0.0, 0.0, 1.0]).as_matrix() @ DOWN
    places = np.stack([np.linspace(-0.05, 0.05, n), np.zeros(n), np.full(n, 0.05)], axis=1)
    return Pose(jnp.asarray(turns), jnp.asarray(places))


def path_of(task=TASK, place=(0.6, 0.3, -0.05), waypoints=40):
    return object_path(task, Pose(np.eye(3), np.array(place)), payload().com, waypoints)


@pytest.fixture(scope="module")
def found(arm):
    with jax.enable_x64(True):
        return evaluate_grasps(arm, payload(), hands(), path_of(), settings=QUICK)


def one(tree, i):
    return jax.tree.map(lambda x: x[i], tree)


def test_the_object_goes_where_it_should(arm, found):
    assert np.all(np.asarray(found.status) == GraspStatus.OK), np.asarray(found.status)
    assert float(jnp.max(found.motion.error)) < 1e-9
    q, low, high = (np.asarray(x) for x in (found.motion.q, arm.lower, arm.upper))
    assert np.all((q >= low) & (q <= high))


def test_rates_are_the_derivatives_of_the_positions(found):
    """Hermite's rule between waypoints, which errs with the fourth power of their distance."""
    motion = found.motion
    time, q, qd, qdd = (np.asarray(getattr(motion, n)) for n in ("time", "q", "qd", "qdd"))
    for move in (slice(0, 24), slice(24, 40)):
        h = np.diff(time[:, move])[..., None]
        speeds, gains = qd[:, move], qdd[:, move]
        steps = h / 2 * (speeds[:, 1:] + speeds[:, :-1]) - h**2 / 12 * np.diff(gains, axis=1)
        np.testing.assert_allclose(np.diff(q[:, move], axis=1), steps, atol=2e-5)


def test_joint_speeds_are_the_least_that_give_the_twist(arm, found):
    motion = one(found.motion, 2)
    jacobians = jax.vmap(functools.partial(hand_jacobian, arm))(motion.q)
    scale = np.array([0.1] * 3 + [1.0] * 3)  # does not matter where the twist is met
    for jacobian, twist, speed in zip(jacobians, motion.twist, motion.qd, strict=True):
        least = np.linalg.pinv(jacobian / scale[:, None]) @ (twist / scale)
        np.testing.assert_allclose(speed, least, atol=1e-8)


def welded(arm):
    """MuJoCo's model of the arm with the payload of the first grasp."""
    held = with_payload(arm, payload(), one(hands(), 0).inverse())
    model = robot_spec(held).compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return held, model


def test_metrics_are_those_of_mujocos_welded_body(arm, found):
    """Torques by `mj_inverse`, effective mass and manipulability from its M and J."""
    _, model = welded(arm)
    data, motion, signals = mujoco.MjData(model), one(found.motion, 0), one(found.signals, 0)
    tangent = np.asarray(motion.tangent)[:, :3]
    direction = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    torque, mass, radius = [], [], []
    dense, jacobian = np.zeros((7, 7)), np.zeros((3, 7))
    for q, qd, qdd, u in zip(motion.q, motion.qd, motion.qdd, direction, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        torque.append(data.qfrc_inverse.copy())
        mujoco.mj_fullM(model, data, dense)
        mujoco.mj_jacSite(model, data, jacobian, None, model.site("hand").id)
        mass.append(1.0 / (u @ jacobian @ np.linalg.solve(dense, jacobian.T @ u)))
        radius.append(1.0 / (u @ np.linalg.solve(jacobian @ jacobian.T, u)))
    np.testing.assert_allclose(signals.torque, torque, atol=1e-9)
    np.testing.assert_allclose(signals.effective_mass, mass, rtol=1e-9)
    np.testing.assert_allclose(signals.manipulability, radius, rtol=1e-9)
    costs = dict(zip(found.names, np.asarray(found.costs[0]), strict=True))
    torque, weight = np.array(torque), np.asarray(motion.weight)
    assert weight.sum() == pytest.approx(1.0)
    assert costs["effort"] == pytest.approx(np.linalg.norm(torque), rel=1e-9)
    assert costs["energy"] == pytest.approx(weight @ (torque**2).sum(1), rel=1e-9)
    assert costs["effective_mass"] == pytest.approx(weight @ mass, rel=1e-9)
    assert costs["inverse_manipulability"] == pytest.approx(1.0 / (weight @ radius), rel=1e-9)
    limits = np.asarray(arm.torque_limit)
    assert costs["peak_torque"] == pytest.approx(np.abs(torque / limits).max(), rel=1e-9)
    power = np.abs(torque * np.asarray(motion.qd)).sum(1)
    assert costs["work"] == pytest.approx(np.trapezoid(power, np.asarray(motion.time)), rel=1e-9)


def test_a_turn_on_the_spot_has_no_direction(arm):
    """The hand's origin at the CoM: effective mass and manipulability count nothing there."""
    hand = Pose(jnp.tile(DOWN, (6, 1, 1)), jnp.tile(payload().com, (6, 1)))
    task = Task("turn", tuple(Move(rotation_deg=(0.0, 0.0, x)) for x in (20.0, -20.0)))
    found = evaluate_grasps(arm, payload(), hand, path_of(task), settings=QUICK)
    assert float(jnp.max(found.signals.effective_mass)) == 0.0
    assert np.isfinite(float(found.costs[0, found.names.index("effort")]))


def test_what_cannot_be_done_says_why(arm):
    good = hands()
    moves = (dataclasses.replace(move, duration=0.02 * move.duration) for move in TASK.moves)
    hasty = dataclasses.replace(TASK, moves=tuple(moves))
    cases = {
        GraspStatus.UNREACHED: (payload(), path_of(place=(1.6, 0.3, 0.0))),
        GraspStatus.TORQUE_LIMIT: (payload().replace(mass=jnp.asarray(12.0)), path_of()),
        GraspStatus.VELOCITY_LIMIT: (payload(), path_of(hasty)),
        GraspStatus.BAD_PAYLOAD: (payload().replace(inertia=-payload().inertia), path_of()),
    }
    for status, (body, path) in cases.items():
        found = evaluate_grasps(arm, body, good, path, settings=QUICK)
        assert int(found.status[0]) == status, status
        assert np.all(np.isinf(found.usable()[0]))


def test_a_grasp_that_fails_leaves_the_others_as_they_are(arm, found):
    wild = hands()
    wild = wild.__class__(wild.rotation, wild.translation.at[3].set(jnp.array([0.0, 0.0, 3.0])))
    mixed = evaluate_grasps(arm, payload(), wild, path_of(), settings=QUICK)
    rest = np.arange(6) != 3
    np.testing.assert_allclose(
        np.asarray(mixed.costs)[rest], np.asarray(found.costs)[rest], rtol=1e-9
    )
    assert int(mixed.status[3]) == GraspStatus.UNREACHED


@pytest.mark.slow  # half a minute of compilation
def test_gradients_in_the_grasp_and_in_the_payload(arm):
    """Along the surface and in the payload: central differences."""
    path, hand, body = path_of(waypoints=16), one(hands(), 1), payload()
    tilt = jnp.array([0.3, -0.2, 0.4])

    def cost(x):
        held = body.replace(mass=body.mass * (1.0 + x[3]), com=body.com + 0.1 * x[4])
        moved = Pose(hand.rotation, hand.translation + tilt * x[0] + jnp.array([0.0, x[1], x[2]]))
        motion = plan_motion(arm, moved, path, QUICK)
        return grasp_costs(arm, held, moved, motion, tuple(METRICS))[0]

    sloped = jax.jit(lambda x, v: jax.jvp(cost, (x,), (v,)))
    h, zero = 1e-6, jnp.zeros(5)
    slopes = np.stack([np.asarray(sloped(zero, v)[1]) for v in jnp.eye(5)], axis=1)
    scale = np.abs(slopes).max(axis=1)
    for slope, v in zip(slopes.T, jnp.eye(5), strict=True):
        ahead, back = (np.asarray(sloped(sign * h * v, zero)[0]) for sign in (1.0, -1.0))
        np.testing.assert_allclose(slope / scale, (ahead - back) / (2 * h) / scale, atol=2e-5)


def test_misuse(arm):
    with pytest.raises(ValueError, match="unknown metric 'price'"):
        evaluate_grasps(arm, payload(), hands(), path_of(), metrics=("price",))
    with pytest.raises(ValueError, match="no grasps"):
        evaluate_grasps(arm, payload(), jax.tree.map(lambda x: x[:0], hands()), path_of())
