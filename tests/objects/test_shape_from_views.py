"""From depth images to a solid: cameras, fusion, and whether the stated uncertainty holds."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapely
import trimesh

from mjx_inertia.objects import (
    CameraSettings,
    FusionSettings,
    camera_ring,
    cast_views,
    combine_shape_and_push,
    estimate_shape,
    join_views,
    mass_properties,
    with_noise,
)
from mjx_inertia.objects.depth_views import fuse_views, point_cloud
from mjx_inertia.objects.mesh_defects import find_defects
from mjx_inertia.spatial import to_log_cholesky, to_planar

NOISE = 0.001
SETTINGS = FusionSettings(cells=36)


@pytest.fixture(autouse=True, scope="module")
def float64():
    with jax.enable_x64(True):
        yield


def standing(mesh):
    """On the table, off the origin."""
    low, high = mesh.bounds
    middle = 0.5 * (low + high)
    return mesh.apply_translation((0.1 - middle[0], -0.2 - middle[1], -low[2]))


def angle():
    outline = [(0, 0), (0.12, 0), (0.12, 0.04), (0.04, 0.04), (0.04, 0.1), (0, 0.1)]
    return standing(trimesh.creation.extrude_polygon(shapely.Polygon(outline), 0.05))


def can():
    return standing(trimesh.creation.cylinder(0.035, 0.1, sections=64))


def ring():
    return standing(trimesh.creation.torus(0.05, 0.02, 64, 32))


SHAPES = {"angle": angle, "can": can, "ring": ring}


@functools.cache
def views_of(name, elevations=(0.05, 0.7, 1.45), noise=NOISE):
    mesh = SHAPES[name]()
    target = tuple(mesh.bounds.mean(axis=0))
    poses = join_views(
        *(
            camera_ring(count, target=target, distance=0.5, elevation=e, start=e)
            for count, e in zip((6, 4, 1), elevations, strict=True)
        )
    )
    views = cast_views(mesh.vertices, mesh.faces, poses, CameraSettings(96, 96, 260.0))
    return with_noise(views, noise, key=jax.random.key(3)) if noise else views


@functools.cache
def estimate_of(name):
    return estimate_shape(
        views_of(name), noise=NOISE, key=jax.random.key(0), draws=5, settings=SETTINGS
    )


class TestCameras:
    def test_look_at_their_target(self):
        target = np.array([0.3, -0.1, 0.2])
        poses = camera_ring(5, target=(0.3, -0.1, 0.2), distance=0.8, elevation=0.4)
        for i in range(5):
            rotation = np.asarray(poses.rotation().as_matrix()[i])
            offset = target - np.asarray(poses.translation()[i])
            np.testing.assert_allclose(rotation[:, 2], offset / 0.8, atol=1e-12)
            assert np.linalg.det(rotation) == pytest.approx(1.0)
            assert rotation[2, 0] == pytest.approx(0.0) and rotation[2, 1] < 0.0  # level, y down

    def test_depth_is_along_the_axis(self):
        """A wall across the view has one depth, whatever the pixel."""
        wall = trimesh.creation.box((0.1, 4.0, 4.0)).apply_translation((-0.05, 0.0, 0.0))
        poses = camera_ring(1, target=(0.0, 0.0, 0.0), distance=0.7, elevation=0.0)
        views = cast_views(wall.vertices, wall.faces, poses, CameraSettings(24, 16, 20.0))
        assert views.depth.shape == (1, 16, 24)
        np.testing.assert_allclose(views.depth, 0.7, atol=1e-6)

    def test_points_lie_on_the_mesh_and_noise_is_along_the_ray(self):
        mesh = angle()
        points = point_cloud(views_of("angle", noise=0.0))
        distance = trimesh.proximity.closest_point_naive(mesh, points[::50])[1]
        assert distance.max() < 1e-6
        clean, noisy = views_of("angle", noise=0.0), views_of("angle")
        seen = np.isfinite(clean.depth)
        np.testing.assert_array_equal(np.isfinite(noisy.depth), seen)
        scatter = np.std(noisy.depth[seen] - clean.depth[seen])
        assert scatter == pytest.approx(NOISE, rel=0.02)

    def test_poses_need_one_leading_axis(self):
        mesh = angle()
        pose = jax.tree.map(lambda x: x[0], views_of("angle").T_world_camera)
        with pytest.raises(ValueError, match="expected \\(k, 7\\)"):
            cast_views(mesh.vertices, mesh.faces, pose)


class TestFusion:
    @pytest.mark.parametrize("name", ["angle", "can"])
    def test_a_solid_that_is_seen_all_around(self, name):
        mesh = SHAPES[name]()
        solid = fuse_views(views_of(name), noise=NOISE, settings=SETTINGS)
        assert solid.measured > 0.97
        for surface in (solid.mesh, solid.largest):
            assert not any(f.fatal for f in find_defects(surface.vertices, surface.faces))
        body = mass_properties(solid.mesh.vertices, solid.mesh.faces)
        assert float(body.mass) == pytest.approx(mesh.volume, rel=0.02)
        np.testing.assert_allclose(body.com, mesh.center_mass, atol=3e-4)

    def test_what_nobody_saw_is_bounded_and_on_a_fine_grid_guessed_better(self):
        """No camera looks under a ring: carving fills the gap, diffusion rounds it."""
        settings = FusionSettings(cells=56)
        solid = fuse_views(views_of("ring"), noise=NOISE, settings=settings)
        assert solid.measured < 0.9
        truth = ring().volume
        guess, most = (
            float(mass_properties(surface.vertices, surface.faces).mass) - truth
            for surface in (solid.mesh, solid.largest)
        )
        assert most > 0.02 * truth
        assert abs(guess) < 0.5 * most

    def test_views_of_nothing(self):
        views = views_of("can")
        with pytest.raises(ValueError, match="see no surface"):
            fuse_views(views.replace(depth=np.full_like(views.depth, np.inf)), noise=NOISE)
        with pytest.raises(ValueError, match=r"`table` at 1\.0 m is above"):
            fuse_views(views, noise=NOISE, table=1.0)


class TestEstimate:
    @pytest.mark.parametrize("name", SHAPES)
    def test_errors_stay_within_the_stated_uncertainty(self, name):
        mesh, shape = SHAPES[name](), estimate_of(name)
        body = mass_properties(mesh.vertices - shape.reference, mesh.faces)
        error = shape.theta - np.asarray(to_log_cholesky(body))
        std = np.sqrt(np.diag(shape.covariance))
        assert np.all(np.abs(error) < 3.0 * std)
        assert std[0] < 0.03 and np.all(std[1:4] < 0.05) and np.all(std[7:] < 0.001)
        assert np.linalg.eigvalsh(shape.covariance).min() > 0.0

    def test_in_the_world_frame(self):
        body = estimate_of("angle").unit_density
        np.testing.assert_allclose(body.com, angle().center_mass, atol=1e-3)
        assert float(body.mass) == pytest.approx(angle().volume, rel=0.03)

    def test_the_correction_of_the_bias_helps(self):
        mesh, shape = angle(), estimate_of("angle")
        raw = float(mass_properties(shape.mesh.vertices, shape.mesh.faces).mass) / mesh.volume
        assert abs(float(shape.unit_density.mass) / mesh.volume - 1.0) < abs(raw - 1.0)

    def test_with_a_mass_from_a_push_all_ten_parameters(self):
        """The way of thesis §8.2: what is seen, and one number that is felt."""
        mesh = angle()
        body = mass_properties(mesh.vertices, mesh.faces, 1200.0)
        planar = dataclasses.replace(to_planar(body), mass=1.01 * body.mass)
        variances = np.array([(0.01 * body.mass) ** 2, np.inf, np.inf, np.inf])
        full = combine_shape_and_push(estimate_of("angle"), planar, np.diag(variances))
        actual, expected = (
            np.concatenate([[b.mass], b.com, np.asarray(b.inertia)[np.tril_indices(3)]])
            for b in (full.inertial, body)
        )
        std = np.sqrt(np.diag(full.covariance))
        assert np.all(np.abs(actual - expected) < 3.0 * std)
        moments = [4, 6, 9]  # I_xx, I_yy, I_zz
        np.testing.assert_allclose(actual[moments], expected[moments], rtol=0.03)
        assert full.density == pytest.approx(1200.0, rel=0.03)

    def test_needs_two_draws(self):
        with pytest.raises(ValueError, match="`draws` is 1"):
            estimate_shape(views_of("can"), noise=NOISE, key=jax.random.key(0), draws=1)

    def test_depends_on_its_key_alone(self):
        first, second, other = (
            estimate_shape(
                views_of("can"),
                noise=NOISE,
                key=jax.random.key(seed),
                draws=2,
                settings=FusionSettings(cells=20),
            )
            for seed in (0, 0, 1)
        )
        np.testing.assert_array_equal(first.theta, second.theta)
        assert np.any(first.theta != other.theta)
        assert jnp.all(jnp.isfinite(first.covariance))
