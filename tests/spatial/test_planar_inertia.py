import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from point_clouds import batched, random_bodies

from mjx_inertia.spatial import (
    Consistency,
    PlanarInertia,
    change_frame,
    check_consistency,
    to_planar,
)
from mjx_inertia.spatial.inertia import kinetic_energy
from mjx_inertia.spatial.planar import change_frame_planar, from_planar


def slab():
    return PlanarInertia(jnp.array(0.8), jnp.array(2e-3), jnp.array([0.02, -0.01]))


@pytest.mark.parametrize("height", [0.0, 0.05])
def test_round_trip_is_exact(height):
    again = to_planar(from_planar(slab(), height=height, com_z=0.3))
    jax.tree.map(np.testing.assert_array_equal, again, slab())


def test_a_square_prism_is_recovered():
    mass, side, height = 2.0, 0.09, 0.04
    planar = PlanarInertia(jnp.array(mass), jnp.array(mass * side**2 / 6), jnp.zeros(2))
    across = mass * (side**2 + height**2) / 12
    actual = from_planar(planar, height=jnp.array(height)).inertia
    np.testing.assert_allclose(actual, np.diag([across, across, mass * side**2 / 6]), rtol=1e-12)


def test_embedding_is_consistent():
    status = jax.jit(lambda height: check_consistency(from_planar(slab(), height=height)))
    assert status(0.05) == Consistency.CONSISTENT
    assert status(0.0) == Consistency.ON_BOUNDARY


def test_planar_energy_is_that_of_any_body_with_these_parameters():
    bodies = random_bodies(100)
    twist = jnp.array([0.3, -0.2, 0.0, 0.0, 0.0, 1.5])
    embedded = batched(lambda p: from_planar(to_planar(p), height=0.1, com_z=0.2))(bodies)
    energy = batched(kinetic_energy, in_axes=(0, None))
    np.testing.assert_allclose(energy(embedded, twist), energy(bodies, twist), rtol=1e-11)


def test_planar_frame_change_is_the_spatial_one():
    bodies = random_bodies(50)
    yaw, shift = 0.7, jnp.array([0.3, -0.4])
    T_planar = jaxlie.SE2.from_rotation_and_translation(jaxlie.SO2.from_radians(yaw), shift)
    T = jaxlie.SE3.from_rotation_and_translation(
        jaxlie.SO3.from_z_radians(yaw), jnp.append(shift, 0.5)
    )
    actual = batched(lambda p: change_frame_planar(to_planar(p), T_planar))(bodies)
    expected = batched(lambda p: to_planar(change_frame(p, T)))(bodies)
    jax.tree.map(lambda a, e: np.testing.assert_allclose(a, e, rtol=1e-11), actual, expected)
