"""The simulation against C MuJoCo with a recompiled model and a converged solver."""

import jax
import mujoco
import numpy as np
import pytest
from cube_pushes import cubes, push, straight

from mjx_inertia.pushing import recompile, resting_height
from mjx_inertia.pushing.parameters import with_parameters


def oracle(scene, parameters, motion, i, samples):
    """Mean force, position and yaw of each sample of push `i`, by C MuJoCo."""
    model = recompile(scene, jax.tree.map(lambda x: np.asarray(x)[i], parameters))
    data = mujoco.MjData(model)
    data.qpos[2] = resting_height(scene)
    data.qpos[-2:] = motion.start[i]
    if not scene.planar:
        data.qpos[3] = 1.0
    rows = []
    for _ in range(samples):
        force = np.zeros(2)
        for _ in range(scene.settings.substeps):
            data.qvel[-2:] = motion.direction[i] * motion.speed[i]
            mujoco.mj_step(model, data)
            force -= data.qfrc_constraint[-2:] / scene.settings.substeps
        q = data.qpos
        w, x, y, z = q[3:7] if not scene.planar else (0, 0, 0, 0)
        yaw = q[3] if scene.planar else np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        rows.append((*force, q[0], q[1], yaw))
    return np.array(rows)


@pytest.mark.parametrize(("table", "count"), [("limit_surface", 20), ("corners", 6), ("pads", 6)])
def test_same_trajectory_and_force_as_c_mujoco(scene_of, table, count):
    """Trajectory to 0.5 mm and 0.5 degrees, mean force to 1 %, for random parameters."""
    rng = np.random.default_rng(5)
    parameters = cubes(count, seed=5, com_offset=0.1)
    motion = straight(
        parameters,
        rng.uniform(-0.7, 0.7, count),
        rng.choice([0.01, 0.02, 0.04, 0.06], count),
        2.5,
        rng.uniform(-0.5, 0.5, count),
    )
    scene = scene_of(table)
    record = push(scene, parameters, motion)
    for i in range(count):
        n = int(record.length[i])
        truth = oracle(scene, parameters, motion, i, n)
        error = np.abs(record.pose[i, :n] - truth[:, 2:]).max(axis=0)
        assert error[:2].max() < 5e-4
        assert np.degrees(error[2]) < 0.5
        mean = truth[:, :2].mean(axis=0)
        assert np.linalg.norm(record.force[i, :n].mean(axis=0) - mean) < 0.01 * np.linalg.norm(mean)


def test_push_whose_newton_steps_are_nearly_all_too_long(scene_of):
    """From 10 ms on, the minimum along a Newton step is at 1 to 2 % of the step.

    A line search of five evaluations ends elsewhere, and its push 3 mm beside that of C MuJoCo.
    """
    edge = 2 / 15
    parameters = cubes(1, seed=0).replace(
        mass=np.array([2.6315790]),
        inertia=np.full((1, 3), 2.6315790 * edge**2 / 6),
        com=np.array([[0.0, 0.0, edge / 2]]),
        half_extents=np.full((1, 3), edge / 2),
        friction=np.array([0.2]),
        friction_radius=np.array([0.051013048]),
        tip_friction=np.array([0.43107148]),
        tip_time_constant=np.array([0.01871606]),
    )
    motion = straight(parameters, 0.0, 0.02, 2.5, np.arcsin(4 / 27))
    scene = scene_of("limit_surface")
    record = push(scene, parameters, motion)
    truth = oracle(scene, parameters, motion, 0, int(record.length[0]))
    error = np.abs(record.pose[0] - truth[:, 2:]).max(axis=0)
    assert error[:2].max() < 1e-5
    assert error[2] < 1e-4
    force = np.linalg.norm(record.force[0] - truth[:, :2], axis=1)
    assert force.max() < 0.01 * np.linalg.norm(truth[:, :2].mean(axis=0))


@pytest.mark.parametrize("table", ["limit_surface", "corners", "pads"])
def test_derived_fields_equal_those_of_a_recompiled_model(scene_of, table):
    """Mass, inertia, CoM and size leave no field of the model behind."""
    scene = scene_of(table)
    one = jax.tree.map(lambda x: np.asarray(x)[0], cubes(1, seed=7, com_offset=0.2))
    one = one.replace(inertia=one.inertia * np.array([1.3, 1.1, 0.9]))
    ours, theirs = with_parameters(scene, one), recompile(scene, one)
    fields = (
        "body_mass", "body_subtreemass", "body_inertia", "body_ipos", "body_invweight0",
        "dof_invweight0", "geom_size", "geom_pos", "pair_friction", "pair_solref", "pair_solimp",
    )  # fmt: skip
    for field in fields:
        expected = getattr(theirs, field)
        np.testing.assert_allclose(
            getattr(ours, field), expected, rtol=2e-5, atol=1e-7, err_msg=field
        )
