import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from point_clouds import assert_same_bodies, batched, random_bodies, random_poses

from mjx_inertia.spatial import (
    Consistency,
    InertialParameters,
    change_frame,
    check_consistency,
    from_log_cholesky,
    to_log_cholesky,
    to_planar,
    to_pseudo_inertia,
    to_ten_vector,
)
from mjx_inertia.spatial.consistency import thicken
from mjx_inertia.spatial.inertia import kinetic_energy
from mjx_inertia.spatial.representations import LOG_CHOLESKY_NAMES, to_spatial_inertia

COUNT = 300

to_theta, to_body = jax.jit(to_log_cholesky), jax.jit(from_log_cholesky)


def random_thetas(count, seed=0, scale=1.0):
    return jnp.asarray(scale * np.random.default_rng(seed).normal(size=(count, 10)))


def test_round_trip_from_bodies():
    bodies = random_bodies(COUNT)
    again = batched(from_log_cholesky)(batched(to_log_cholesky)(bodies))
    assert_same_bodies(again, bodies)


def test_round_trip_from_thetas():
    thetas = random_thetas(COUNT)
    again = batched(to_log_cholesky)(batched(from_log_cholesky)(thetas))
    np.testing.assert_allclose(again, thetas, atol=1e-8)


def test_is_the_factor_of_rucker_and_wensing():
    thetas = random_thetas(COUNT)
    for theta, actual in zip(
        np.asarray(thetas),
        np.asarray(batched(lambda t: to_pseudo_inertia(from_log_cholesky(t)))(thetas)),
        strict=True,
    ):
        alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3 = theta
        root = np.exp(alpha) * np.array(
            [
                [np.exp(d1), s12, s13, t1],
                [0.0, np.exp(d2), s23, t2],
                [0.0, 0.0, np.exp(d3), t3],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
        expected = root @ root.T
        np.testing.assert_allclose(actual, expected, atol=1e-13 * np.abs(expected).max())
    assert len(LOG_CHOLESKY_NAMES) == 10


@pytest.mark.parametrize(("scale", "worst"), [(1.0, "CONSISTENT"), (4.0, "ON_BOUNDARY")])
def test_every_theta_is_a_consistent_body(scale, worst):
    bodies = batched(from_log_cholesky)(random_thetas(5000, scale=scale))
    assert batched(check_consistency)(bodies).max() <= Consistency[worst]


def test_every_float32_theta_is_a_body():
    with jax.enable_x64(False):
        bodies = batched(from_log_cholesky)(random_thetas(5000, scale=2.0))
        assert bodies.inertia.dtype == jnp.float32
        assert batched(check_consistency)(bodies).max() <= Consistency.ON_BOUNDARY


def test_float32_round_trip_far_from_the_origin():
    """The CoM is one of the ten, so a small body ten metres away keeps its tensor."""
    with jax.enable_x64(False):
        inertia = jnp.diag(jnp.array([2e-6, 3e-6, 4e-6]))
        body = InertialParameters(jnp.array(0.1), jnp.array([10.0, -7.0, 3.0]), inertia)
        assert_same_bodies(to_body(to_theta(body)), body, rtol=1e-5)


def thin_rod(radius):
    """A solid cylinder of 1 kg and 1 m along x, turned into a general frame."""
    across = (3 * radius**2 + 1.0) / 12
    moments = jnp.array([radius**2 / 2, across, across])
    body = InertialParameters(jnp.array(1.0), jnp.zeros(3), jnp.diag(moments))
    pose = random_poses(1)
    return body, jax.jit(change_frame)(body, jaxlie.SE3(pose.wxyz_xyz[0]))


def test_rod_a_millionth_thin():
    aligned, turned = thin_rod(1e-6)
    assert_same_bodies(to_body(to_theta(aligned)), aligned)
    assert_same_bodies(to_body(to_theta(turned)), turned)
    gyration = np.exp(2 * np.asarray(to_theta(aligned))[2])  # of y about the CoM: r²/4
    np.testing.assert_allclose(gyration, 0.25e-12, rtol=1e-3)


def test_bodies_without_thickness_gain_it():
    rod = InertialParameters(jnp.array(1.0), jnp.zeros(3), jnp.diag(jnp.array([0.0, 1.0, 1.0])))
    plate = rod.replace(inertia=jnp.diag(jnp.array([1.0, 1.0, 2.0])))
    point = rod.replace(inertia=jnp.zeros((3, 3)))
    for body in (rod, plate, point):
        theta = to_theta(thicken(body, 1e-4))
        np.testing.assert_allclose(
            to_body(theta).inertia, body.inertia + 2e-8 * np.eye(3), atol=1e-13
        )


def test_impossible_bodies_have_no_theta():
    impossible = InertialParameters(jnp.array(1.0), jnp.zeros(3), jnp.diag(jnp.array([1.0, 1, 3])))
    assert np.any(np.isnan(to_theta(impossible)))
    assert np.isnan(np.asarray(to_theta(impossible.replace(mass=jnp.array(-1.0))))[0])


class TestGradients:
    """Against central differences in float64: their error is about 1e-16 / step + step²."""

    @staticmethod
    def assert_derivative(function, x, step=1e-5, rtol=1e-7):
        steps = step * np.concatenate([np.eye(x.size), -np.eye(x.size)])
        ahead, behind = np.split(np.asarray(batched(function)(jnp.asarray(x + steps))), 2)
        expected = (ahead - behind).T / (2 * step)
        scale = np.abs(expected).max()
        actual = jax.jit(jax.jacrev(function))(x)
        np.testing.assert_allclose(actual, expected, atol=rtol * scale, rtol=0)

    def test_from_theta(self):
        def outputs(theta):
            body = from_log_cholesky(theta)
            views = (to_ten_vector(body), to_planar(body), to_spatial_inertia(body))
            return ravel_pytree(views)[0]

        self.assert_derivative(outputs, random_thetas(1)[0])

    def test_to_theta(self):
        flat, unravel = ravel_pytree(jax.jit(from_log_cholesky)(random_thetas(1)[0]))
        self.assert_derivative(lambda x: to_log_cholesky(unravel(x)), flat, step=1e-6)

    def test_energy_after_a_frame_change(self):
        def energy(x):
            theta, twist, wxyz_xyz = jnp.split(x, (10, 16))
            body = change_frame(from_log_cholesky(theta), jaxlie.SE3(wxyz_xyz))
            return kinetic_energy(body, twist)[None]

        pose = random_poses(1).wxyz_xyz[0]
        self.assert_derivative(
            energy, jnp.concatenate([random_thetas(1)[0], jnp.arange(1.0, 7.0), pose])
        )

    def test_finite_at_the_sphere(self):
        there_and_back = jax.jacobian(lambda t: to_log_cholesky(from_log_cholesky(t)))
        np.testing.assert_allclose(jax.jit(there_and_back)(jnp.zeros(10)), np.eye(10), atol=1e-12)


def test_jit_and_vmap_change_nothing():
    bodies = random_bodies(3)
    together = batched(to_log_cholesky)(bodies)
    one_by_one = [to_log_cholesky(jax.tree.map(lambda x, i=i: x[i], bodies)) for i in range(3)]
    np.testing.assert_allclose(together, np.stack(one_by_one), rtol=1e-10)
