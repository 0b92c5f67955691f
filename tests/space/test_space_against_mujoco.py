"""Dynamics of a floating tree against C MuJoCo, and what must be conserved."""

import functools
import tempfile
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from foreign_robot import FOREIGN, foreign_capture, foreign_robot
from scipy.spatial.transform import Rotation

from mjx_inertia.robots import robot_spec
from mjx_inertia.space import planar_robot, servicer
from mjx_inertia.space.arms_on_base import servicer_capture
from mjx_inertia.space.capture import with_capture
from mjx_inertia.space.dynamics import (
    floating_base_forward_dynamics,
    floating_base_inverse_dynamics,
    generalized_jacobian,
    inertias,
    momentum_map,
    velocity_forces,
)
from mjx_inertia.space.mjcf import capture_spec
from mjx_inertia.space.planar_model import planar_capture

COUNT = 1000
CASES = ("planar", "planar with object", "foreign")
HELD = ("servicer with object", "foreign with object")  # accelerations only: half the compilation


@functools.cache
def case(name):
    """The robot with what it holds, and MuJoCo's model without limits, weld and gravity."""
    with tempfile.TemporaryDirectory() as folder:
        makers = {"planar": planar_robot, "servicer": servicer}
        makers["foreign"] = lambda: foreign_robot(Path(folder))
        robot = makers[name.split()[0]]()
    captures = {"planar": planar_capture, "servicer": servicer_capture, "foreign": foreign_capture}
    held = captures[name.split()[0]]() if "object" in name else None
    if name == "foreign":
        model = mujoco.MjModel.from_xml_string(FOREIGN)
        model.opt.gravity[:] = 0.0
    else:
        model = (capture_spec(robot, held) if held else robot_spec(robot)).compile()
    off = mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_EQUALITY
    model.opt.disableflags |= off
    return with_capture(robot, held) if held else robot, model


@functools.cache
def ours(name):
    """A function of `COUNT` states: matrices, forces, accelerations, what they take, J_g."""
    robot, _ = case(name)

    def one(q, twist, qd, torque):
        matrix = inertias(robot, q)
        gain = floating_base_forward_dynamics(robot, q, twist, qd, torque)
        back = floating_base_inverse_dynamics(robot, q, (twist, gain[0]), (qd, gain[1]))
        whole = jnp.block([[matrix.base, matrix.coupling], [matrix.coupling.T, matrix.joints]])
        force = velocity_forces(robot, q, twist, qd)
        jacobian = generalized_jacobian(robot, q), momentum_map(matrix)
        bias = jnp.concatenate([force.base, force.joints])
        return whole, bias, jnp.concatenate(gain), (back.base, back.joints), jacobian

    run = jax.jit(jax.vmap(one))
    return lambda *states: jax.tree.map(np.asarray, run(*states))


@functools.cache
def accelerations(name):
    """A function of `COUNT` states."""
    robot, _ = case(name)
    run = jax.jit(jax.vmap(lambda *state: floating_base_forward_dynamics(robot, *state)))
    return lambda *states: np.concatenate(run(*states), 1)


@functools.cache
def states(name):
    """Attitudes of the base, and q, twist, q̇ and torque."""
    robot = case(name)[0]
    rng = np.random.default_rng(0)
    turn = Rotation.random(COUNT, rng)
    if robot.planar:
        turn = Rotation.from_rotvec(rng.uniform(-3.0, 3.0, (COUNT, 1)) * np.array([0, 0, 1]))
    spread = np.where(robot.prismatic, 0.3, np.pi)
    q = rng.uniform(-spread, spread, (COUNT, robot.dof))
    twist = rng.normal(size=(COUNT, len(robot.axes)))
    return turn.as_matrix(), (q, twist, *rng.normal(size=(2, COUNT, robot.dof)) * 3.0)


def set_state(model, data, robot, rotation, q, twist, qd):
    """MuJoCo has the base's linear velocity in world axes and its angular one in the base's."""
    n = robot.dof
    data.qpos[:], data.qvel[:] = 0.0, 0.0
    data.qpos[-n:], data.qvel[-n:] = q, qd
    if robot.planar:
        data.qpos[2] = np.arctan2(rotation[1, 0], rotation[0, 0])
        data.qvel[:2], data.qvel[2] = rotation[:2, :2] @ twist[:2], twist[2]
    else:
        data.qpos[3:7] = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
        data.qvel[:3], data.qvel[3:6] = rotation @ twist[:3], twist[3:]


def to_base(robot, rotation, nv):
    """From MuJoCo's velocities to ours."""
    turn = np.eye(nv)
    k = 2 if robot.planar else 3
    turn[:k, :k] = rotation[:k, :k].T
    return turn


@pytest.mark.parametrize("name", CASES)
def test_matrix_forces_and_accelerations_are_those_of_mujoco(name):
    robot, model = case(name)
    rotations, state = states(name)
    matrix, bias, gain, (nothing, torque), _ = ours(name)(*state)
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    worst = np.zeros(3)
    for k, rotation in enumerate(rotations):
        set_state(model, data, robot, rotation, *(part[k] for part in state[:3]))
        data.qfrc_applied[-robot.dof :] = state[3][k]
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        turn = to_base(robot, rotation, model.nv)
        pairs = [
            (matrix[k], turn @ full @ turn.T),
            (bias[k], turn @ data.qfrc_bias),
            (gain[k], turn @ data.qacc),
        ]
        worst = np.maximum(worst, [abs(a - b).max() / abs(b).max() for a, b in pairs])
    assert worst.max() < 1e-9, worst
    np.testing.assert_allclose(nothing, 0.0, atol=1e-8)
    np.testing.assert_allclose(torque, state[3], rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", HELD)
@pytest.mark.long
def test_accelerations_are_those_of_mujoco(name):
    robot, model = case(name)
    rotations, state = states(name)
    gain = accelerations(name)(*state)
    data, worst = mujoco.MjData(model), 0.0
    for k, rotation in enumerate(rotations):
        set_state(model, data, robot, rotation, *(part[k] for part in state[:3]))
        data.qfrc_applied[-robot.dof :] = state[3][k]
        mujoco.mj_forward(model, data)
        wanted = to_base(robot, rotation, model.nv) @ data.qacc
        worst = max(worst, abs(gain[k] - wanted).max() / abs(wanted).max())
    assert worst < 1e-9


@pytest.mark.parametrize("name", ["planar with object", "foreign"])
def test_momentum_stays_while_mujoco_moves_the_joints(name):
    """H_b and H_bm at states of one motion: momentum in the world, about its origin."""
    robot, model = case(name)
    rotations, state = states(name)
    model.opt.timestep, model.opt.integrator = 2e-4, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    set_state(model, data, robot, rotations[0], *(part[0] for part in state[:3]))
    rows = []
    for k in range(COUNT):
        data.qfrc_applied[-robot.dof :] = 0.03 * state[3][k // 100]
        mujoco.mj_kinematics(model, data)
        base = data.body(model.jnt_bodyid[0])
        rotation = base.xmat.reshape(3, 3).copy()
        velocity = to_base(robot, rotation, model.nv) @ data.qvel
        rows.append((rotation, base.xpos.copy(), data.qpos[-robot.dof :].copy(), velocity))
        mujoco.mj_step(model, data)
    rotation, place, q, velocity = (np.array(column) for column in zip(*rows, strict=True))
    count = len(robot.axes)
    matrix = ours(name)(q, velocity[:, :count], velocity[:, count:], 0.0 * q)[0]
    in_base = np.zeros((COUNT, 6))
    in_base[:, list(robot.axes)] = np.einsum("tij,tj->ti", matrix[:, :count], velocity)
    linear = np.einsum("tij,tj->ti", rotation, in_base[:, :3])
    angular = np.einsum("tij,tj->ti", rotation, in_base[:, 3:]) + np.cross(place, linear)
    momentum = np.concatenate([linear, angular], 1)
    assert abs(velocity - velocity[0]).max() > 0.1
    assert abs(momentum - momentum[0]).max() < 1e-8 * abs(momentum[0]).max()


@pytest.mark.parametrize("name", ["planar", "foreign"])
def test_generalized_jacobian_is_the_hands_motion_without_momentum(name):
    robot, model = case(name)
    rotations, state = states(name)
    *_, (jacobian, map_to_base) = ours(name)(*state)
    data, step, base = mujoco.MjData(model), 1e-6, model.jnt_bodyid[0]
    for k in range(50):
        rotation, qd = rotations[k], state[2][k]
        set_state(model, data, robot, rotation, state[0][k], map_to_base[k] @ qd, qd)
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        assert abs(data.subtree_linvel[base]).max() < 1e-10
        assert abs(data.subtree_angmom[base]).max() < 1e-9
        at, moved = data.qpos.copy(), []
        for time in (-step, step):
            data.qpos[:] = at
            mujoco.mj_integratePos(model, data.qpos, data.qvel, time)
            mujoco.mj_kinematics(model, data)
            moved.append(hands(data))
        twists = [
            np.concatenate(
                [
                    rotation.T @ (b[0] - a[0]),
                    rotation.T @ Rotation.from_matrix(b[1] @ a[1].T).as_rotvec(),
                ]
            )[list(robot.axes)]
            / (2.0 * step)
            for a, b in zip(*moved, strict=True)
        ]
        np.testing.assert_allclose(jacobian[k] @ qd, np.concatenate(twists), rtol=0, atol=1e-7)


def hands(data):
    """Places and rotations of both hands: sites of our models, a site and a body of the other's."""
    try:
        frames = [data.site("hand_right"), data.site("hand_left")]
    except KeyError:
        frames = [data.site("grip"), data.body("claw")]
    return [(frame.xpos.copy(), frame.xmat.reshape(3, 3).copy()) for frame in frames]
