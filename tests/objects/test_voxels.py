"""Bodies as grids of voxels, each with its own mass."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from solids_of_known_mass import box, ellipsoid, torus, worst_difference

from mjx_inertia.objects import mass_properties, voxel_properties, voxelize
from mjx_inertia.objects.voxels import VoxelGrid
from mjx_inertia.spatial import (
    Consistency,
    InertialParameters,
    check_consistency,
    combine,
)

pytestmark = pytest.mark.float64

properties_of_grid = jax.jit(voxel_properties)


def turned(mesh):
    mesh.apply_transform(trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.8, 0.4])))
    return mesh.apply_translation((0.3, -0.2, 0.5))


def differences(actual, expected, size):
    return worst_difference(
        actual, float(expected.mass), np.asarray(expected.com), np.asarray(expected.inertia), size
    )


class TestVoxels:
    @pytest.mark.parametrize("solid", [box, ellipsoid, torus])
    def test_converge_to_the_exact_values(self, solid):
        mesh = turned(solid().mesh)
        size = float(np.ptp(mesh.vertices, axis=0).max())
        exact = mass_properties(mesh.vertices, mesh.faces, 700.0)
        errors = [
            differences(
                properties_of_grid(voxelize(mesh.vertices, mesh.faces, 700.0, edge=size / n)),
                exact,
                size,
            )
            for n in (8, 16, 32, 64)
        ]
        assert errors[-1] < 2e-3
        assert np.log2(errors[0] / errors[-1]) > 3 * 1.8  # second order over three halvings

    def test_a_box_of_whole_voxels_is_exact(self):
        mesh = trimesh.creation.box((0.3, 0.2, 0.1)).apply_translation((5.0, 4.0, 3.0))
        grid = voxelize(mesh.vertices, mesh.faces, 1000.0, edge=0.05)
        assert grid.masses.shape == (6, 4, 2)
        np.testing.assert_allclose(grid.masses, 1000.0 * 0.05**3, rtol=1e-9)
        exact = mass_properties(mesh.vertices, mesh.faces, 1000.0)
        assert differences(properties_of_grid(grid), exact, 0.3) < 1e-9

    def test_a_grid_is_its_cubes_joined(self):
        rng = np.random.default_rng(0)
        masses = jnp.asarray(rng.uniform(0.0, 1.0, (3, 4, 5)))
        grid = VoxelGrid(masses, jnp.array([0.1, -0.2, 0.3]), jnp.array(0.02))
        flat = masses.reshape(-1)
        own = flat[:, None, None] * 0.02**2 / 6 * jnp.eye(3)
        cubes = InertialParameters(flat, grid.centers().reshape(-1, 3), own)
        assert differences(properties_of_grid(grid), jax.jit(combine)(cubes), 0.1) < 1e-12

    def test_a_cavity_is_empty_and_another_body_is_not(self):
        inner = trimesh.creation.box((0.2, 0.2, 0.2))
        inner.invert()
        mesh = trimesh.util.concatenate(
            [
                trimesh.creation.box((0.4, 0.4, 0.4)),
                inner,
                trimesh.creation.box((0.2, 0.4, 0.4)).apply_translation((0.5, 0.0, 0.0)),
            ]
        )
        filled = np.asarray(voxelize(mesh.vertices, mesh.faces, edge=0.1).masses) / 0.1**3
        expected = np.ones((8, 4, 4))
        expected[1:3, 1:3, 1:3] = 0.0
        expected[4:6] = 0.0  # from 0.2 m to 0.4 m
        assert filled.shape == (8, 4, 4)
        np.testing.assert_allclose(filled, expected, atol=1e-9)

    def test_density_by_voxel_follows_a_function_of_position(self):
        mesh = box().mesh
        grid = voxelize(mesh.vertices, mesh.faces, 1.0, edge=0.005)
        density = 1000.0 * (1.0 + 2.0 * grid.centers()[..., 0])
        body = properties_of_grid(grid.replace(masses=grid.masses * density))
        # of the box of 6 litres about the origin: ∫ x² dV = V 0.3² / 12, ∫ x³ dV = 0
        square = np.array([0.3, 0.2, 0.1]) ** 2 / 12
        com = np.array([2.0 * square[0], 0.0, 0.0])
        second = 6.0 * (square - com**2)
        exact = InertialParameters(6.0, com, np.diag(second.sum() - second))
        assert differences(body, exact, 0.3) < 1e-3

    def test_derivatives_in_the_masses(self):
        rng = np.random.default_rng(0)
        masses = jnp.asarray(rng.uniform(0.5, 1.0, (2, 3, 4)))

        def numbers(masses):
            body = voxel_properties(VoxelGrid(masses, jnp.zeros(3), jnp.array(0.1)))
            return jnp.concatenate([x.reshape(-1) for x in jax.tree.leaves(body)])

        slope = jax.jit(jax.jacrev(numbers))(masses)
        numbers = jax.jit(numbers)
        for index in [(0, 0, 0), (1, 2, 3), (1, 0, 2)]:
            step = jnp.zeros_like(masses).at[index].set(1e-5)
            expected = (numbers(masses + step) - numbers(masses - step)) / 2e-5
            np.testing.assert_allclose(slope[:, *index], expected, atol=1e-9)

    def test_a_negative_cube_says_so(self):
        masses = jnp.ones((2, 2, 2)).at[0, 0, 0].set(-0.1)
        body = properties_of_grid(VoxelGrid(masses, jnp.zeros(3), jnp.asarray(0.1)))
        assert all(np.all(np.isnan(leaf)) for leaf in jax.tree.leaves(body))
        rounded = masses.at[0, 0, 0].set(-1e-9)
        body = properties_of_grid(VoxelGrid(rounded, jnp.zeros(3), jnp.asarray(0.1)))
        assert check_consistency(body) == Consistency.CONSISTENT

    def test_a_grid_without_mass_says_so(self):
        grid = VoxelGrid(jnp.zeros((2, 2, 2)), jnp.zeros(3), jnp.array(0.1))
        assert check_consistency(properties_of_grid(grid)) == Consistency.NOT_FINITE

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"edge": 0.0}, "`edge` must be positive"),
            ({"edge": 1e-5}, "more than 50000000"),
            ({"columns": 0}, "`columns` must be 1"),
            ({"density": -1.0}, "`density` must be positive"),
        ],
    )
    def test_bad_settings(self, changes, message):
        mesh = box().mesh
        arguments = {"density": 1.0, "edge": 0.05, **changes}
        with pytest.raises(ValueError, match=message):
            voxelize(mesh.vertices, mesh.faces, **arguments)
