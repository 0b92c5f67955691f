"""Integrals over meshes: closed forms, invariance, precision, transformations by JAX, bad input."""

import jax
import jax.numpy as jnp
import jaxtyping
import numpy as np
import pytest
import trimesh
from solids_of_known_mass import (
    box,
    cylinder,
    ellipsoid,
    integrals_in_extended_precision,
    tetrahedron,
    torus,
    worst_difference,
)

from mjx_inertia.objects import mass_properties, polyhedron_properties
from mjx_inertia.spatial import Consistency, check_consistency

pytestmark = pytest.mark.float64


def bolt():
    """A solid without symmetry: a cylinder with a box through its head, turned."""
    mesh = trimesh.boolean.union(
        [
            trimesh.creation.cylinder(0.01, 0.08, sections=40),
            trimesh.creation.box((0.05, 0.02, 0.01)).apply_translation((0.01, 0.0, 0.03)),
        ],
        engine="manifold",
    )
    rotation = trimesh.transformations.random_rotation_matrix(np.array([0.3, 0.6, 0.1]))
    return mesh.apply_transform(rotation)


def size_of(mesh):
    return float(np.ptp(mesh.vertices, axis=0).max())


@pytest.mark.parametrize("solid", [box, tetrahedron, ellipsoid, torus, cylinder])
def test_closed_forms(solid):
    known = solid()
    body = mass_properties(known.mesh.vertices, known.mesh.faces)
    difference = worst_difference(body, known.volume, known.com, known.inertia, size_of(known.mesh))
    assert difference < known.tolerance


def test_finer_meshes_of_curved_solids_come_closer_with_the_square_of_their_edges():
    differences = []
    for sections in (16, 32, 64):
        known = torus(sections=sections)
        body = polyhedron_properties(jnp.asarray(known.mesh.vertices), known.mesh.faces)
        differences.append(worst_difference(body, known.volume, known.com, known.inertia, 0.5))
    assert np.allclose(np.log2(np.divide(differences[:-1], differences[1:])), 2.0, atol=0.05)


def test_density_scales_mass_and_tensor():
    mesh = bolt()
    one, steel = (mass_properties(mesh.vertices, mesh.faces, rho) for rho in (1.0, 7850))
    np.testing.assert_allclose(steel.mass, 7850.0 * one.mass, rtol=1e-14)
    np.testing.assert_allclose(steel.inertia, 7850.0 * one.inertia, rtol=1e-12)
    np.testing.assert_array_equal(steel.com, one.com)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (3.0, -2.0, 5.0), (1e3, -2e3, 5e2)])
def test_precision_far_from_the_origin_and_at_all_scales(scale, offset):
    """Ten thousand times its own size away, ten digits are left of the tensor."""
    mesh = bolt()
    size = size_of(mesh) * scale
    vertices = np.asarray(mesh.vertices) * scale + 8.0 * size * np.array(offset)
    expected = integrals_in_extended_precision(vertices, mesh.faces)
    far = max(1.0, np.abs(vertices).max() / size)
    for body in (
        mass_properties(vertices, mesh.faces),
        jax.jit(lambda v: mass_properties(v, mesh.faces))(vertices),
    ):
        assert worst_difference(body, *expected, size) < 1e-10
        assert worst_difference(body, *expected, size * far) < 1e-12


def test_moves_with_the_frame():
    mesh = bolt()
    turned = mesh.copy()
    matrix = trimesh.transformations.random_rotation_matrix(np.array([0.7, 0.2, 0.9]))
    turned.apply_transform(matrix).apply_translation((0.1, 0.2, -0.3))
    body, moved = (mass_properties(m.vertices, m.faces, 800.0) for m in (mesh, turned))
    rotation = matrix[:3, :3]
    np.testing.assert_allclose(moved.mass, body.mass, rtol=1e-13)
    np.testing.assert_allclose(
        moved.com, rotation @ np.asarray(body.com) + [0.1, 0.2, -0.3], atol=1e-15
    )
    expected = rotation @ np.asarray(body.inertia) @ rotation.T
    np.testing.assert_allclose(moved.inertia, expected, atol=1e-13 * np.abs(expected).max())


def test_a_cavity_and_a_second_body_count_with_their_sign():
    outer = trimesh.creation.box((1.0, 1.0, 1.0))
    inner = trimesh.creation.box((0.5, 0.5, 0.5))
    inner.invert()
    apart = trimesh.creation.box((0.5, 0.5, 0.5)).apply_translation((3.0, 0.0, 0.0))
    mesh = trimesh.util.concatenate([outer, inner, apart])
    body = mass_properties(mesh.vertices, mesh.faces)
    np.testing.assert_allclose(body.mass, 1.0)
    np.testing.assert_allclose(body.com, [0.125 * 3.0, 0.0, 0.0], atol=1e-15)


def test_a_soup_of_triangles_is_a_solid_when_places_are_known():
    mesh = bolt()
    soup = np.asarray(mesh.triangles).reshape(-1, 3)
    faces = np.arange(len(soup)).reshape(-1, 3)
    body, expected = mass_properties(soup, faces), mass_properties(mesh.vertices, mesh.faces)
    np.testing.assert_allclose(body.inertia, expected.inertia, rtol=1e-12)
    with pytest.raises(ValueError, match="not watertight"):
        jax.jit(lambda v: mass_properties(v, faces))(soup)


class TestTransformations:
    def test_jit_and_vmap_give_the_same(self):
        mesh = bolt()
        stretch = np.random.default_rng(0).uniform(0.5, 2.0, (6, 1, 3))
        batch = jnp.asarray(mesh.vertices * stretch)
        density = jnp.linspace(500.0, 8000.0, 6)
        traced = []

        @jax.jit
        @jax.vmap
        def all_at_once(vertices, rho):
            traced.append(1)
            return mass_properties(vertices, mesh.faces, rho)

        together = all_at_once(batch, density)
        all_at_once(2.0 * batch, density)
        assert len(traced) == 1
        for i in range(6):
            alone = mass_properties(batch[i], mesh.faces, density[i])
            for a, b in zip(jax.tree.leaves(together), jax.tree.leaves(alone), strict=True):
                np.testing.assert_allclose(a[i], b, rtol=1e-12, atol=1e-15)

    def test_faces_may_be_mapped_too_with_padding(self):
        meshes = [bolt(), trimesh.creation.box((0.1, 0.2, 0.3))]
        vertices = max(len(m.vertices) for m in meshes)
        faces = max(len(m.faces) for m in meshes)
        batch = [
            (
                np.pad(m.vertices, ((0, vertices - len(m.vertices)), (0, 0)), mode="edge"),
                np.pad(m.faces, ((0, faces - len(m.faces)), (0, 0))),
            )
            for m in meshes
        ]
        padded = jax.jit(jax.vmap(mass_properties))(*map(np.stack, zip(*batch, strict=True)))
        for i, mesh in enumerate(meshes):
            expected = mass_properties(mesh.vertices, mesh.faces)
            np.testing.assert_allclose(padded.inertia[i], expected.inertia, rtol=1e-11, atol=1e-18)

    def test_gradients_against_differences(self):
        mesh = bolt()
        faces = np.asarray(mesh.faces)
        rng = np.random.default_rng(1)
        weights = [jnp.asarray(rng.normal(size=shape)) for shape in ((), (3,), (3, 3))]
        scales = (1e2, 10.0, 1e6)

        def score(vertices, density):
            leaves = jax.tree.leaves(mass_properties(vertices, faces, density))
            return sum(s * jnp.sum(w * x) for s, w, x in zip(scales, weights, leaves, strict=True))

        score_of = jax.jit(score)
        vertices = jnp.asarray(mesh.vertices) + jnp.array([0.3, -0.2, 0.5])
        by_vertices, by_density = jax.jit(jax.grad(score, argnums=(0, 1)))(vertices, 700.0)
        step = 1e-4
        for _ in range(5):
            direction = jnp.asarray(rng.normal(size=vertices.shape)) * size_of(mesh)
            ahead, behind = (score_of(vertices + s * step * direction, 700.0) for s in (1, -1))
            expected = (ahead - behind) / (2 * step)
            np.testing.assert_allclose(jnp.sum(by_vertices * direction), expected, rtol=1e-5)
        expected = (score_of(vertices, 701.0) - score_of(vertices, 699.0)) / 2.0
        np.testing.assert_allclose(by_density, expected, rtol=1e-9)

    def test_volume_changes_by_the_area_swept(self):
        """dV/dv is a third of the area vectors around a vertex: nothing else, in any frame."""
        mesh = bolt()
        gradient = jax.grad(lambda v: mass_properties(v, mesh.faces).mass)(
            jnp.asarray(mesh.vertices) + 100.0
        )
        area = np.zeros_like(mesh.vertices)
        np.add.at(area, mesh.faces, (mesh.face_normals * mesh.area_faces[:, None] / 3)[:, None])
        np.testing.assert_allclose(gradient, area, atol=1e-11 * np.abs(area).max())

    def test_float32_keeps_its_digits_far_away(self):
        mesh = bolt()
        expected = mass_properties(mesh.vertices, mesh.faces)
        with jax.enable_x64(False):
            body = mass_properties(np.asarray(mesh.vertices) + 1e3, mesh.faces)
            assert body.inertia.dtype == np.float32
            np.testing.assert_allclose(body.mass, expected.mass, rtol=1e-6)
            scale = np.abs(expected.inertia).max()
            np.testing.assert_allclose(body.inertia, expected.inertia, atol=3e-6 * scale)


BOX = trimesh.creation.box((1.0, 1.0, 1.0))


class TestBadInput:
    @pytest.mark.parametrize("density", [0.0, -1.0, np.nan, np.inf])
    def test_density(self, density):
        with pytest.raises(ValueError, match="`density` must be positive"):
            mass_properties(BOX.vertices, BOX.faces, density)

    def test_wrong_types(self):
        jaxtyping.config.update("jaxtyping_disable", True)
        try:
            with pytest.raises(ValueError, match=r"`density` must be positive .* but is '7'"):
                mass_properties(BOX.vertices, BOX.faces, "7")  # pyright: ignore
            with pytest.raises(ValueError, match="`vertices` holds complex128, expected real"):
                mass_properties(BOX.vertices + 0j, BOX.faces)
        finally:
            jaxtyping.config.update("jaxtyping_disable", False)

    def test_faces_are_checked_where_vertices_are_traced(self):
        with pytest.raises(ValueError, match="not watertight"):
            jax.jit(lambda v: mass_properties(v, BOX.faces[1:]))(jnp.asarray(BOX.vertices))
        turned = np.array(BOX.faces)
        turned[0] = turned[0][::-1]
        with pytest.raises(ValueError, match="inconsistent winding"):
            jax.vmap(lambda v: mass_properties(v, turned))(jnp.asarray(BOX.vertices)[None])
        with pytest.raises(ValueError, match="missing vertex"):
            jax.jit(lambda v: mass_properties(v, BOX.faces + 1))(jnp.asarray(BOX.vertices))

    @pytest.mark.parametrize("what", ["inverted", "flat", "turned and flat", "nan", "density"])
    def test_traced_solids_that_are_none_say_so_in_their_row(self, what):
        good = np.asarray(BOX.vertices)
        turn = trimesh.transformations.random_rotation_matrix(np.array([0.7, 0.2, 0.9]))[:3, :3]
        bad, density = {
            "inverted": (-good, 1.0),
            "flat": (good * [1.0, 1.0, 0.0], 1.0),
            "turned and flat": (good * [1.0, 1.0, 0.0] @ turn + 0.3, 1.0),
            "nan": (np.where(good > 0, np.nan, good), 1.0),
            "density": (good, -1.0),
        }[what]
        batch = jnp.asarray(np.stack([good, bad, good]))
        densities = jnp.array([1.0, density, 1.0])
        bodies = jax.jit(jax.vmap(lambda v, rho: mass_properties(v, BOX.faces, rho)))(
            batch, densities
        )
        status = jax.vmap(check_consistency)(bodies)
        assert status.tolist() == [0, int(Consistency.NOT_FINITE), 0]
        assert all(np.isnan(leaf[1]).all() for leaf in jax.tree.leaves(bodies))

    def test_gradient_of_a_good_row_beside_a_bad_one(self):
        batch = jnp.asarray(np.stack([BOX.vertices, -BOX.vertices]))

        def total(vertices):
            masses = jax.vmap(lambda v: mass_properties(v, BOX.faces).mass)(vertices)
            return jnp.sum(jnp.where(jnp.isnan(masses), 0.0, masses))

        gradient = jax.grad(total)(batch)
        assert np.all(np.isfinite(gradient[0])) and np.any(gradient[0] != 0.0)
