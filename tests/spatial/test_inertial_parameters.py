import jax
import jax.numpy as jnp
import jaxlie
import mujoco
import numpy as np
import pytest
from point_clouds import (
    assert_same_bodies,
    batched,
    body_of_points,
    random_bodies,
    random_clouds,
    random_poses,
)

from mjx_inertia.spatial import InertialParameters, change_frame, combine
from mjx_inertia.spatial.inertia import inertia_about, kinetic_energy, point_mass_inertia
from mjx_inertia.spatial.representations import (
    PrincipalInertia,
    from_principal,
    to_principal,
    to_spatial_inertia,
)

COUNT = 200


def test_a_frame_change_moves_the_points_of_the_body():
    masses, points = random_clouds(COUNT)
    T_new_old = random_poses(COUNT)
    moved = batched(lambda T, p: jax.vmap(T.apply)(p))(T_new_old, jnp.asarray(points))
    actual = batched(change_frame)(body_of_points(masses, points), T_new_old)
    assert_same_bodies(actual, body_of_points(masses, np.asarray(moved)))


def test_frame_changes_form_a_group():
    bodies, T_b_a, T_c_b = random_bodies(COUNT), random_poses(COUNT, 1), random_poses(COUNT, 2)
    change = batched(change_frame)
    in_b = change(bodies, T_b_a)
    composed = change(bodies, batched(jaxlie.SE3.multiply)(T_c_b, T_b_a))
    assert_same_bodies(change(in_b, T_c_b), composed)
    assert_same_bodies(change(in_b, batched(jaxlie.SE3.inverse)(T_b_a)), bodies)
    assert_same_bodies(batched(lambda p: change_frame(p, jaxlie.SE3.identity()))(bodies), bodies)


def test_kinetic_energy_does_not_depend_on_the_frame():
    bodies, T_new_old = random_bodies(COUNT), random_poses(COUNT)
    twist_old = jnp.asarray(np.random.default_rng(0).normal(size=(COUNT, 6)))

    def both(params, T, twist):
        moved = change_frame(params, T)
        return kinetic_energy(params, twist), kinetic_energy(moved, T.adjoint() @ twist)

    old, new = batched(both)(bodies, T_new_old, twist_old)
    np.testing.assert_allclose(new, old, rtol=1e-11)


def test_kinetic_energy_is_that_of_the_points():
    masses, points = random_clouds(COUNT)
    twist = np.random.default_rng(0).normal(size=(COUNT, 6))
    velocities = twist[:, None, :3] + np.cross(twist[:, None, 3:], points)
    expected = 0.5 * (masses * (velocities**2).sum(-1)).sum(-1)
    actual = batched(kinetic_energy)(body_of_points(masses, points), jnp.asarray(twist))
    np.testing.assert_allclose(actual, expected, rtol=1e-11)


def test_inertia_about_a_point_is_the_integral_about_it():
    masses, points = random_clouds(COUNT)
    about = np.random.default_rng(0).normal(size=(COUNT, 3))
    r = points - about[:, None]
    tensors = (r**2).sum(-1)[..., None, None] * np.eye(3) - r[..., :, None] * r[..., None, :]
    expected = (masses[..., None, None] * tensors).sum(1)
    actual = batched(inertia_about)(body_of_points(masses, points), jnp.asarray(about))
    np.testing.assert_allclose(actual, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_point_mass_on_an_axis():
    actual = point_mass_inertia(jnp.array(2.0), jnp.array([0.0, 0.0, 3.0]))
    np.testing.assert_allclose(actual, np.diag([18.0, 18.0, 0.0]))


join = jax.jit(combine)


class TestCombine:
    def test_points_make_the_body(self):
        masses, points = (jnp.asarray(x) for x in random_clouds(COUNT))
        parts = InertialParameters(masses, points, jnp.zeros((*points.shape, 3)))
        assert_same_bodies(batched(combine)(parts), body_of_points(*random_clouds(COUNT)))

    def test_commutes_with_a_change_of_frame(self):
        parts, T = random_bodies(5), random_poses(1)
        T = jaxlie.SE3(T.wxyz_xyz[0])
        moved = batched(change_frame, in_axes=(0, None))(parts, T)
        assert_same_bodies(join(moved), change_frame(join(parts), T))

    def test_a_negative_body_is_a_cavity(self):
        whole = random_bodies(2)
        hole = jax.tree.map(lambda x: x[1], whole)
        cavity = hole.replace(mass=-hole.mass, inertia=-hole.inertia)
        cut = join(jax.tree.map(lambda a, b: jnp.stack([a, b]), join(whole), cavity))
        assert_same_bodies(cut, jax.tree.map(lambda x: x[0], whole), rtol=1e-9)

    def test_nothing_is_padding(self):
        parts = random_bodies(4)
        padded = jax.tree.map(lambda x: jnp.concatenate([x, jnp.zeros_like(x[:2])]), parts)
        assert_same_bodies(join(padded), join(parts))
        nothing = join(jax.tree.map(jnp.zeros_like, parts))
        assert all(not np.any(leaf) for leaf in jax.tree.leaves(nothing))

    def test_one_body_is_refused(self):
        with pytest.raises(ValueError, match="one leading axis"):
            combine(jax.tree.map(lambda x: x[0], random_bodies(1)))


class TestPrincipal:
    def test_round_trip(self):
        bodies = random_bodies(COUNT)
        principal = batched(to_principal)(bodies)
        assert_same_bodies(batched(from_principal)(principal), bodies)
        assert np.all(np.diff(principal.moments, axis=-1) <= 0.0)
        rotations = principal.T_frame_principal.rotation().as_matrix()
        np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-12)

    @pytest.mark.parametrize("moments", [(1.0, 1.0, 1.0), (1.0, 1.0, 1e-12), (2.0, 1.0, 1.0)])
    def test_equal_moments(self, moments):
        pose = jaxlie.SE3(random_poses(1).wxyz_xyz[0])
        body = from_principal(PrincipalInertia(jnp.array(1.0), pose, jnp.array(moments)))
        principal = jax.jit(to_principal)(body)
        assert_same_bodies(jax.jit(from_principal)(principal), body)
        np.testing.assert_allclose(principal.moments, moments, atol=1e-14)
        slope = jax.jit(jax.grad(lambda p: to_principal(p).moments @ jnp.arange(3.0)))(body)
        assert np.all(np.isfinite(slope.inertia))


# Differently posed geoms with closed-form inertia: type, MuJoCo sizes (m), density (kg/m³),
# position (m), quaternion (wxyz, not normalised).
GEOMS = [
    ("box", (0.1, 0.02, 0.05), 700.0, (0.3, -0.1, 0.2), (0.9, 0.1, 0.3, -0.2)),
    ("sphere", (0.04,), 7800.0, (-0.2, 0.1, 0.0), (1.0, 0.0, 0.0, 0.0)),
    ("cylinder", (0.03, 0.15), 2700.0, (0.0, 0.25, -0.3), (0.2, 0.8, -0.5, 0.4)),
    ("ellipsoid", (0.02, 0.05, 0.09), 1200.0, (0.1, 0.0, 0.6), (0.5, -0.5, 0.1, 0.7)),
    ("box", (0.001, 0.2, 0.2), 8000.0, (-0.3, -0.3, 0.1), (0.3, 0.3, 0.3, 0.9)),
]


def closed_form(kind, size, density):
    """Mass (kg) and principal moments (kg m²) of a geom about its axes, by the textbook."""
    if kind == "box":
        a, b, c = size
        mass = 8 * a * b * c * density
        return mass, mass / 3 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    if kind == "cylinder":
        r, half = size
        mass = 2 * np.pi * r**2 * half * density
        across = mass * (3 * r**2 + 4 * half**2) / 12
        return mass, np.array([across, across, mass * r**2 / 2])
    a, b, c = size if kind == "ellipsoid" else size * 3
    mass = 4 / 3 * np.pi * a * b * c * density
    return mass, mass / 5 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])


@jax.jit
def joined(geoms):
    return combine(jax.vmap(from_principal)(geoms))


def composite_from_library():
    masses, moments = zip(*(closed_form(*geom[:3]) for geom in GEOMS), strict=True)
    poses = [
        (*(np.array(quaternion) / np.linalg.norm(quaternion)), *position)
        for *_, position, quaternion in GEOMS
    ]
    masses, poses, moments = (jnp.asarray(np.array(x), float) for x in (masses, poses, moments))
    return joined(PrincipalInertia(masses, jaxlie.SE3(poses), moments))


def composite_from_mujoco():
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body()
    body.add_freejoint()
    for kind, size, density, position, quaternion in GEOMS:
        body.add_geom(
            type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"),
            size=[*size, 0, 0][:3],
            density=density,
            pos=position,
            quat=quaternion,
        )
    return spec.compile()


class TestAgainstMuJoCo:
    def test_composite_body(self):
        model = composite_from_mujoco()
        pose = jaxlie.SE3(jnp.concatenate([model.body_iquat[1], model.body_ipos[1]]))
        mass, moments = jnp.asarray(model.body_mass[1]), jnp.asarray(model.body_inertia[1])
        expected = from_principal(PrincipalInertia(mass, pose, moments))
        actual = composite_from_library()
        assert_same_bodies(actual, expected, rtol=1e-10)
        np.testing.assert_allclose(to_principal(actual).moments, moments, rtol=1e-10)

    def test_spatial_inertia_is_the_mass_matrix_of_a_free_body(self):
        model = composite_from_mujoco()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        expected = np.zeros((6, 6))
        mujoco.mj_fullM(model, data, expected)
        actual = to_spatial_inertia(composite_from_library())
        np.testing.assert_allclose(actual, expected, atol=1e-10 * np.abs(expected).max())


def test_float32_holds_to_its_precision():
    """Through frames, combination and principal axes."""
    expected = composite_from_library()
    with jax.enable_x64(False):
        actual = composite_from_library()
        assert {leaf.dtype for leaf in jax.tree.leaves(actual)} == {np.dtype("float32")}
        assert_same_bodies(actual, expected, rtol=1e-5)
        again = jax.jit(lambda p: from_principal(to_principal(p)))(actual)
        assert_same_bodies(again, expected, rtol=1e-5)
