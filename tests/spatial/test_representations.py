import jax
import jax.numpy as jnp
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

from mjx_inertia.spatial import (
    change_frame,
    combine,
    from_pseudo_inertia,
    from_ten_vector,
    to_pseudo_inertia,
    to_ten_vector,
)
from mjx_inertia.spatial.inertia import kinetic_energy
from mjx_inertia.spatial.representations import (
    TEN_VECTOR_NAMES,
    from_spatial_inertia,
    skew,
    to_spatial_inertia,
)

COUNT = 200
PAIRS = [
    (to_ten_vector, from_ten_vector),
    (to_spatial_inertia, from_spatial_inertia),
    (to_pseudo_inertia, from_pseudo_inertia),
]


@pytest.mark.parametrize(("there", "back"), PAIRS)
def test_round_trip(there, back):
    bodies = random_bodies(COUNT)
    # eps m|c|²/I: the CoM is up to about 1 m from the origin, the bodies are down to 1 cm small
    assert_same_bodies(batched(back)(batched(there)(bodies)), bodies, rtol=1e-9)


@pytest.mark.parametrize(("there", "back"), PAIRS)
def test_linear_in_the_joining_of_bodies(there, back):
    parts = random_bodies(6)
    total = np.asarray(jax.jit(lambda p: there(combine(p)))(parts))
    scale = np.abs(total).max()
    np.testing.assert_allclose(np.sum(batched(there)(parts), 0), total, atol=1e-12 * scale)


@pytest.mark.parametrize(("there", "back"), PAIRS)
def test_jit_and_vmap_change_nothing(there, back):
    bodies = random_bodies(3)
    together = batched(there)(bodies)
    one_by_one = [there(jax.tree.map(lambda x, i=i: x[i], bodies)) for i in range(3)]
    scale = np.abs(together).max()
    np.testing.assert_allclose(together, np.stack(one_by_one), atol=1e-14 * scale)


@pytest.mark.parametrize(("there", "back"), PAIRS)
def test_float32(there, back):
    expected = random_bodies(COUNT)
    with jax.enable_x64(False):
        bodies = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), expected)
        centred = bodies.replace(com=0.1 * bodies.inertia[:, :, 0] / bodies.mass[:, None])
        again = batched(back)(batched(there)(centred))
        assert {leaf.dtype for leaf in jax.tree.leaves(again)} == {np.dtype("float32")}
        assert_same_bodies(again, centred, rtol=1e-5)


def test_the_ten_vector_has_its_order():
    masses, points = random_clouds(1)
    m, (x, y, z) = masses[0], points[0].T
    expected = {
        "m": m.sum(),
        "mc_x": (m * x).sum(),
        "mc_y": (m * y).sum(),
        "mc_z": (m * z).sum(),
        "I_xx": (m * (y**2 + z**2)).sum(),
        "I_xy": -(m * x * y).sum(),
        "I_yy": (m * (x**2 + z**2)).sum(),
        "I_xz": -(m * x * z).sum(),
        "I_yz": -(m * y * z).sum(),
        "I_zz": (m * (x**2 + y**2)).sum(),
    }
    body = jax.tree.map(lambda leaf: leaf[0], body_of_points(masses, points))
    actual = to_ten_vector(body)
    assert tuple(expected) == TEN_VECTOR_NAMES
    np.testing.assert_allclose(actual, list(expected.values()), rtol=1e-10)


def test_pseudo_inertia_is_its_integral():
    masses, points = random_clouds(COUNT)
    homogeneous = np.concatenate([points, np.ones((COUNT, 8, 1))], axis=-1)
    expected = np.einsum("bn,bni,bnj->bij", masses, homogeneous, homogeneous)
    actual = batched(to_pseudo_inertia)(body_of_points(masses, points))
    np.testing.assert_allclose(actual, expected, atol=1e-12 * np.abs(expected).max())


def test_matrices_change_frame_by_congruence():
    bodies, poses = random_bodies(COUNT), random_poses(COUNT)

    def both(params, T_new_old):
        moved = change_frame(params, T_new_old)
        T, adjoint = T_new_old.as_matrix(), T_new_old.inverse().adjoint()
        return (
            (to_pseudo_inertia(moved), T @ to_pseudo_inertia(params) @ T.T),
            (to_spatial_inertia(moved), adjoint.T @ to_spatial_inertia(params) @ adjoint),
        )

    for actual, expected in batched(both)(bodies, poses):
        scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
        np.testing.assert_array_less(np.abs(actual - expected) / scale, 1e-13)


def test_spatial_inertia_gives_the_kinetic_energy():
    bodies = random_bodies(COUNT)
    twists = jnp.asarray(np.random.default_rng(0).normal(size=(COUNT, 6)))
    expected = batched(kinetic_energy)(bodies, twists)
    actual = batched(lambda p, v: 0.5 * v @ to_spatial_inertia(p) @ v)(bodies, twists)
    np.testing.assert_allclose(actual, expected, rtol=1e-10)


def test_skew_is_the_cross_product():
    a, b = np.random.default_rng(0).normal(size=(2, 3))
    np.testing.assert_allclose(skew(jnp.asarray(a)) @ b, np.cross(a, b), atol=1e-15)
