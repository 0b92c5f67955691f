"""A held object is a body welded to the hand: against Pinocchio, C MuJoCo and Khatib's laws."""

import jax
import jax.numpy as jnp
import jaxlie
import mujoco
import numpy as np
import pinocchio
import pytest

from mjx_inertia.grasping.augmented import effective_mass, operational_dynamics, operational_inertia
from mjx_inertia.robots import (
    baxter,
    gravity_torque,
    hand_jacobian,
    hand_pose,
    inverse_dynamics,
    mass_matrix,
    robot_spec,
    with_payload,
)
from mjx_inertia.robots.dynamics import bias_force, jacobian_rate_product
from mjx_inertia.spatial import InertialParameters, Pose, change_frame, combine
from mjx_inertia.spatial.representations import to_spatial_inertia

pytestmark = pytest.mark.long
COUNT = 300
ARM = baxter()


@pytest.fixture(scope="module")
def held():
    """States, payloads and grasps, and what the library says of them."""
    rng = np.random.default_rng(0)
    q = rng.uniform(ARM.lower, ARM.upper, (COUNT, 7))
    qd, qdd = rng.normal(size=(2, COUNT, 7)) * np.array([2.0, 5.0])[:, None, None]
    # tensors of clouds of points are those of bodies
    points = rng.normal(size=(COUNT, 8, 3)) * rng.uniform(0.02, 0.15, (COUNT, 1, 3))
    points -= points.mean(1, keepdims=True)
    mass = rng.uniform(0.1, 3.0, COUNT)
    square = (points**2).sum(-1)[..., None, None] * np.eye(3)
    outer = points[..., :, None] * points[..., None, :]
    tensor = mass[:, None, None] * (square - outer).mean(1)
    com = rng.normal(size=(COUNT, 3)) * 0.1
    with jax.enable_x64(True):
        payload = InertialParameters(*map(jnp.asarray, (mass, com, tensor)))
        tangent = jnp.asarray(rng.normal(size=(COUNT, 6)) * [0.1, 0.1, 0.1, 1.5, 1.5, 1.5])
        T_hand_obj = jax.vmap(jaxlie.SE3.exp)(tangent)
        states = tuple(map(jnp.asarray, (q, qd, qdd)))
        return states, payload, T_hand_obj, evaluated(states, payload, T_hand_obj)


@jax.jit
def evaluated(states, payload, T_hand_obj):
    def one(state, payload, T_hand_obj):
        q, qd, qdd = state
        arm = with_payload(ARM, payload, Pose.from_se3(T_hand_obj))
        turn = jaxlie.SE3.from_rotation(hand_pose(arm, q).to_se3().rotation())
        return {
            "mass_matrix": mass_matrix(arm, q),
            "bias": bias_force(arm, q, qd),
            "torque": inverse_dynamics(arm, q, qd, qdd),
            "jacobian": hand_jacobian(arm, q),
            "drift": jacobian_rate_product(arm, q, qd),
            "operational": operational_dynamics(arm, q, qd),
            "translation": operational_dynamics(arm, q, qd, translation=True),
            "lambda": operational_inertia(arm, q),
            "lambda_v": operational_inertia(arm, q, translation=True),
            "lambda_bare": operational_inertia(ARM, q),
            # of the object about the hand, in world axes
            "lambda_object": to_spatial_inertia(change_frame(payload, turn @ T_hand_obj)),
            "effective_mass": effective_mass(arm, q, jnp.array([0.6, 0.0, 0.8])),
        }

    return jax.vmap(one)(states, payload, T_hand_obj)


def close(actual, expected, tolerance=1e-9):
    """To `tolerance` of the largest entry of each state."""
    actual, expected = np.asarray(actual), np.asarray(expected)
    axes = tuple(range(1, expected.ndim))
    error = abs(actual - expected).max(axes) / abs(expected).max(axes)
    assert error.max() < tolerance, f"relative error {error.max():.1e}"


def in_hand(k, payload, T_hand_obj):
    """The k-th payload: mass, CoM and tensor, and the pose of its frame in the last link."""
    T_link_hand = np.eye(4)
    T_link_hand[:3, :3] = ARM.T_link_hand.rotation[0]
    T_link_hand[:3, 3] = ARM.T_link_hand.translation[0]
    T = T_link_hand @ np.asarray(T_hand_obj.as_matrix()[k])
    return float(payload.mass[k]), *map(np.asarray, (payload.com[k], payload.inertia[k])), T


def test_welded_in_pinocchio(held):
    (q, qd, qdd), payload, T_hand_obj, ours = held
    bare = pinocchio_arm()
    expected = {"mass_matrix": [], "bias": [], "torque": []}
    zero = np.zeros(7)
    for k in range(COUNT):
        mass, com, tensor, T = in_hand(k, payload, T_hand_obj)
        model = bare.copy()
        inertia = pinocchio.Inertia(mass, com, tensor)
        model.appendBodyToJoint(model.njoints - 1, inertia, pinocchio.SE3(T))
        data = model.createData()
        half = np.triu(pinocchio.crba(model, data, np.asarray(q[k])))
        expected["mass_matrix"].append(half + np.triu(half, 1).T)
        state = (np.asarray(q[k]), np.asarray(qd[k]))
        expected["bias"].append(pinocchio.rnea(model, data, *state, zero).copy())
        torque = pinocchio.rnea(model, data, *state, np.asarray(qdd[k]))
        expected["torque"].append(torque.copy())
    for name, values in expected.items():
        close(ours[name], values)


def pinocchio_arm():
    """The arm link by link through Pinocchio's own building blocks."""
    model = pinocchio.Model()
    model.gravity = pinocchio.Motion(np.asarray(ARM.gravity), np.zeros(3))
    place = pinocchio.SE3(ARM.T_world_base.rotation, ARM.T_world_base.translation)
    for i, name in enumerate(ARM.joint_names):
        step = pinocchio.SE3(ARM.T_parent_joint.rotation[i], ARM.T_parent_joint.translation[i])
        joint = model.addJoint(i, pinocchio.JointModelRZ(), place * step, name)
        figures = (ARM.links.mass[i], ARM.links.com[i], ARM.links.inertia[i])
        model.appendBodyToJoint(joint, pinocchio.Inertia(*figures), pinocchio.SE3.Identity())
        place = pinocchio.SE3.Identity()
    return model


def test_welded_in_mujoco(held):
    (q, qd, qdd), payload, T_hand_obj, ours = held
    expected = {"mass_matrix": [], "bias": [], "torque": []}
    matrix, torque = np.zeros((7, 7)), np.zeros(7)
    for k in range(0, COUNT, 10):
        mass, com, tensor, T = in_hand(k, payload, T_hand_obj)
        spec = robot_spec(ARM)
        quaternion = jaxlie.SO3.from_matrix(jnp.asarray(T[:3, :3])).wxyz
        last = spec.body(f"{ARM.joint_names[-1]}_link")
        body = last.add_body(name="object", pos=T[:3, 3], quat=np.asarray(quaternion))
        body.explicitinertial, body.mass, body.ipos = True, mass, com
        body.fullinertia = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, matrix)
        mujoco.mj_rne(model, data, 1, torque)
        for name, value in (
            ("mass_matrix", matrix),
            ("bias", data.qfrc_bias),
            ("torque", torque),
        ):
            expected[name].append(value.copy())
    for name, values in expected.items():
        close(ours[name][::10], values)


def test_inertia_of_the_hand_is_that_of_the_arm_and_of_the_object(held):
    *_, ours = held
    # near singular configurations have no finite inertia to compare to nine digits
    regular = np.linalg.cond(ours["lambda_bare"]) < 1e6
    assert regular.mean() > 0.9
    total = ours["lambda_bare"] + ours["lambda_object"]
    close(ours["lambda"][regular], total[regular], 1e-8)


def test_operational_dynamics_are_the_definitions(held):
    *_, ours = held
    for name, rows in (("operational", 6), ("translation", 3)):
        found, jacobian = ours[name], ours["jacobian"][:, :rows]
        response = np.linalg.solve(ours["mass_matrix"], jacobian.swapaxes(1, 2))
        inverse = jacobian @ response
        keep = np.linalg.cond(inverse) < 1e6
        inertia = np.linalg.inv(inverse)
        consistent = response @ inertia
        drift = (inertia @ ours["drift"][:, :rows, None])[..., 0]
        bias = (consistent.swapaxes(1, 2) @ ours["bias"][..., None])[..., 0]
        close(found.inertia[keep], inertia[keep], 1e-8)
        close(found.consistent_inverse[keep], consistent[keep], 1e-8)
        unit = np.broadcast_to(np.eye(rows), (keep.sum(), rows, rows))
        close((jacobian @ found.consistent_inverse)[keep], unit, 1e-8)
        # F = Λ ẍ + μ + p with ẍ = 0 carries the arm's own bias
        close((found.coriolis + found.gravity)[keep], (bias - drift)[keep], 1e-7)
    close(ours["translation"].inertia, ours["lambda_v"])


def test_effective_mass_is_felt_along_a_line(held):
    *_, ours = held
    u = np.array([0.6, 0.0, 0.8])
    mobility = np.linalg.inv(ours["lambda_v"])
    np.testing.assert_allclose(ours["effective_mass"], 1.0 / (u @ mobility @ u), rtol=1e-9)


def test_a_payload_on_a_payload_adds(held):
    _, payload, T_hand_obj, _ = held
    first, second = (jax.tree.map(lambda x, k=k: x[k], (payload, T_hand_obj)) for k in (0, 1))
    first, second = ((body, Pose.from_se3(T)) for body, T in (first, second))
    both = with_payload(with_payload(ARM, *first), *second).payload
    apart = [with_payload(ARM, *each).payload for each in (first, second)]
    joint = combine(jax.tree.map(lambda *leaves: jnp.stack(leaves), *apart))
    for actual, expected in zip(jax.tree.leaves(both), jax.tree.leaves(joint), strict=True):
        np.testing.assert_allclose(actual, expected, atol=1e-12)


def test_zeros_of_a_second_payload_stay_known():
    """What is known of both is known of their sum: NumPy, with zeros exact."""
    bodies = [InertialParameters(np.asarray(m), np.zeros(3), m * np.eye(3)) for m in (1.0, 0.3)]
    arm = ARM.replace(T_link_hand=jax.tree.map(lambda x: x[None], Pose.identity()))
    places = (Pose(np.eye(3), np.array([0.0, 0.0, z])) for z in (0.1, 0.2))
    for body, place in zip(bodies, places, strict=True):
        arm = with_payload(arm, body, place)
    assert all(isinstance(leaf, np.ndarray) for leaf in jax.tree.leaves(arm.payload))
    np.testing.assert_array_equal(arm.payload.com[:2], 0.0)
    np.testing.assert_array_equal(arm.payload.inertia * (1.0 - np.eye(3)), 0.0)


def test_payload_in_the_generated_model(held):
    (q, *_), payload, T_hand_obj, ours = held
    first = jax.tree.map(lambda x: x[0], (payload, T_hand_obj))
    arm = with_payload(ARM, first[0], Pose.from_se3(first[1]))
    model = robot_spec(arm).compile()
    data, matrix = mujoco.MjData(model), np.zeros((7, 7))
    data.qpos[:] = q[0]
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fullM(model, data, matrix)
    close(ours["mass_matrix"][:1], matrix[None])


@pytest.mark.slow  # derivatives to compile
def test_derivatives_in_payload_grasp_and_state(held):
    states, payload, T_hand_obj, _ = held
    q, payload, T = jax.tree.map(lambda x: x[0], (states[0], payload, T_hand_obj))

    def cost(q, payload, tangent):
        arm = with_payload(ARM, payload, Pose.from_se3(T @ jaxlie.SE3.exp(tangent)))
        mass = effective_mass(arm, q, jnp.array([0.6, 0.0, 0.8]))
        return mass + jnp.sum(gravity_torque(arm, q) ** 2)

    at = (q, payload, jnp.zeros(6))
    rng = np.random.default_rng(1)
    along = jax.tree.map(lambda x: jnp.asarray(rng.normal(size=x.shape)), at)
    spin = along[1].inertia
    along = (along[0], along[1].replace(inertia=spin + spin.T), along[2])
    value, slope = jax.jit(cost), jax.jit(jax.grad(cost, argnums=(0, 1, 2)))(*at)
    pairs = zip(jax.tree.leaves(slope), jax.tree.leaves(along), strict=True)
    reverse = sum(jnp.vdot(a, b) for a, b in pairs)

    def moved(step):
        return value(*jax.tree.map(lambda x, d: x + step * d, at, along))

    step = 1e-6
    expected = (moved(step) - moved(-step)) / (2 * step)
    np.testing.assert_allclose(reverse, expected, rtol=1e-6)
