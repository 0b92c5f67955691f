import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from point_clouds import random_poses
from scipy.spatial.transform import Rotation

from mjx_inertia.spatial import Pose
from mjx_inertia.spatial.components import (
    apply,
    axis_rotation,
    components,
    cross,
    multiply,
    root,
    stacked,
    symmetric_change,
    transpose,
    turn_axis,
)
from mjx_inertia.spatial.small_cholesky import factorize, inverse, solve_lower, solve_upper

AXES = [*np.eye(3), *-np.eye(3), np.array([0.6, 0.0, -0.8]), np.array([1.0, 2.0, 2.0]) / 3.0]


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_rotation_about_an_axis(axis):
    rotation = jax.jit(lambda angle: stacked(axis_rotation(components(axis), angle), jnp.float64))
    expected = Rotation.from_rotvec(0.7 * axis).as_matrix()
    np.testing.assert_allclose(rotation(0.7), expected, atol=1e-15)


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_axis_of_a_turn(axis):
    rotation = components(Rotation.from_rotvec(0.7 * axis).as_matrix())
    expected = np.sin(0.7 * np.linalg.norm(axis)) * axis / np.linalg.norm(axis)
    np.testing.assert_allclose(turn_axis(rotation), expected, atol=1e-15)


def test_a_root_has_a_slope_where_it_vanishes():
    assert root(4.0) == 2.0 and root(0.0) == 0.0
    value, slope = jax.vmap(jax.value_and_grad(root))(jnp.array([0.0, 4.0]))
    np.testing.assert_array_equal(value, [0.0, 2.0])
    np.testing.assert_array_equal(slope, [0.0, 0.25])


def test_what_is_known_is_left_out():
    turned = multiply(components(np.eye(3)[[2, 0, 1]]), axis_rotation((0.0, 0.0, 1.0), 0.3))
    assert [x for row in turned for x in row if isinstance(x, float)] == [0.0, 0.0, 1.0, 0.0, 0.0]
    program = jax.make_jaxpr(lambda x: stacked(apply(components(np.eye(3)), (x, x, 0.0)), x.dtype))
    assert not any(str(e.primitive) in ("mul", "add") for e in program(1.0).jaxpr.eqns)


def test_algebra_is_that_of_matrices():
    rng = np.random.default_rng(0)
    a, b, v, w = (
        rng.normal(size=(3, 3)),
        rng.normal(size=(3, 3)),
        rng.normal(size=3),
        rng.normal(size=3),
    )
    in_components = [components(x) for x in (a, b, v, w)]
    ca, cb, cv, cw = in_components
    for actual, expected in (
        (multiply(ca, cb), a @ b),
        (apply(transpose(ca), cv), a.T @ v),
        (cross(cv, cw), np.cross(v, w)),
        (symmetric_change(ca, components(b + b.T)), a @ (b + b.T) @ a.T),
    ):
        np.testing.assert_allclose(stacked(actual, jnp.float64), expected, atol=1e-14)


def test_traced_arrays_become_components_of_their_entries():
    array = jnp.arange(12.0).reshape(2, 2, 3)
    again = jax.jit(lambda x: stacked(components(x), x.dtype))(array)
    np.testing.assert_array_equal(again, array)


@pytest.mark.parametrize("size", [1, 3, 7])
def test_cholesky_of_a_small_matrix(size):
    rng = np.random.default_rng(size)
    root, right = rng.normal(size=(size, size)), rng.normal(size=size)
    matrix = root @ root.T + 0.1 * np.eye(size)

    @jax.jit
    def solved(matrix, right):
        factor = factorize(components(matrix))
        solution = solve_upper(factor, solve_lower(factor, components(right)))
        return stacked(solution, right.dtype), stacked(inverse(factor), right.dtype)

    solution, inverted = solved(matrix, right)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, right), rtol=1e-9)
    np.testing.assert_allclose(inverted, np.linalg.inv(matrix), rtol=1e-9)


def test_a_pose_is_the_jaxlie_pose():
    T_a_b, T_b_c = random_poses(20), random_poses(20, 1)
    ours = Pose.from_se3(T_a_b) @ Pose.from_se3(T_b_c)
    expected = jax.vmap(jaxlie.SE3.multiply)(T_a_b, T_b_c)
    np.testing.assert_allclose(ours.rotation, expected.as_matrix()[:, :3, :3], atol=1e-14)
    np.testing.assert_allclose(ours.translation, expected.translation(), atol=1e-13)
    unit = ours @ ours.inverse()
    np.testing.assert_allclose(unit.rotation, np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-14)
    np.testing.assert_allclose(unit.translation, 0.0, atol=1e-13)
    again = jax.vmap(Pose.to_se3)(ours)
    np.testing.assert_allclose(again.as_matrix(), expected.as_matrix(), atol=1e-13)
