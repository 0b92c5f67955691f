import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from point_clouds import random_poses
from scipy.spatial.transform import Rotation

from mjx_inertia.spatial import Pose
from mjx_inertia.spatial.small_cholesky import cholesky
from mjx_inertia.spatial.unrolled import (
    IDENTITY,
    Matrix,
    SymmetricMatrix,
    Vector,
    axis_rotation,
    components,
    computed_once,
    quaternion_rotation,
    rotation_axis,
    safe_sqrt,
    stacked,
)

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
    np.testing.assert_allclose(rotation_axis(rotation), expected, atol=1e-15)


def test_a_root_has_a_slope_where_it_vanishes():
    assert safe_sqrt(4.0) == 2.0 and safe_sqrt(0.0) == 0.0
    value, slope = jax.vmap(jax.value_and_grad(safe_sqrt))(jnp.array([0.0, 4.0]))
    np.testing.assert_array_equal(value, [0.0, 2.0])
    np.testing.assert_array_equal(slope, [0.0, 0.25])


def test_what_is_known_is_left_out():
    turned = components(np.eye(3)[[2, 0, 1]]) @ axis_rotation(Vector((0.0, 0.0, 1.0)), 0.3)
    assert [x for row in turned for x in row if isinstance(x, float)] == [0.0, 0.0, 1.0, 0.0, 0.0]
    program = jax.make_jaxpr(lambda x: stacked(IDENTITY @ Vector((x, x, 0.0)), x.dtype))
    assert not any(str(e.primitive) in ("mul", "add") for e in program(1.0).jaxpr.eqns)


def test_algebra_is_that_of_matrices():
    rng = np.random.default_rng(0)
    a, b, v, w = (
        rng.normal(size=(3, 3)),
        rng.normal(size=(3, 3)),
        rng.normal(size=3),
        rng.normal(size=3),
    )
    symmetric = b + b.T
    A, B, V, W = (components(x) for x in (a, b, v, w))
    S = SymmetricMatrix(components(symmetric))
    for actual, expected in (
        (A @ B, a @ b),
        (A.T @ V, a.T @ v),
        (2.0 * A - B * 3.0 + S, 2.0 * a - 3.0 * b + symmetric),
        (V + 2.0 * W - V * W, v + 2.0 * w - v * w),
        (-V[1:], -v[1:]),
        (V.cross(W), np.cross(v, w)),
        (A.gram(), a @ a.T),
        (S.rotated(A), a @ symmetric @ a.T),
        (S + 0.5 * S, 1.5 * symmetric),
        ([V @ W, A.trace()], [v @ w, np.trace(a)]),
    ):
        np.testing.assert_allclose(stacked(actual, jnp.float64), expected, atol=1e-14)


def test_an_array_times_a_vector_is_a_vector():
    """Also on the left, and for a NumPy number."""
    for factor in (jnp.array(2.0), np.float64(2.0), np.array(2.0), 2):
        assert isinstance(factor * Vector((1.0, 2.0)), Vector)
        assert isinstance(factor * Matrix(((1.0, 2.0),)), Matrix)
        np.testing.assert_array_equal(stacked(factor * Vector((1.0, 2.0)), float), [2.0, 4.0])


def test_vectors_and_matrices_are_pytrees():
    symmetric = SymmetricMatrix([[1.0], [2.0, 3.0]])
    tree = Vector((1.0, 2.0)), Matrix(((1.0, 2.0),)), symmetric
    assert [len(jax.tree.leaves(x)) for x in tree] == [2, 2, 3]
    twice = jax.jit(lambda tree: jax.tree.map(lambda x: 2.0 * x, tree))(tree)
    for x, y in zip(tree, twice, strict=True):
        assert type(x) is type(y)
        np.testing.assert_array_equal(stacked(y, float), 2.0 * stacked(x, float))


def test_an_entry_is_marked_once():
    """Known zeros, what is marked, and its negative are not marked again."""

    def marked(x):
        v = computed_once(Vector((x * x, 0.0)))
        return stacked(computed_once(-computed_once(v)), x.dtype)

    program = jax.make_jaxpr(marked)(2.0)
    assert sum(str(e.primitive) == "computed_once" for e in program.jaxpr.eqns) == 1
    np.testing.assert_array_equal(jax.jit(marked)(2.0), [-4.0, 0.0])


def test_rotation_of_a_quaternion():
    quaternion = np.array([0.5, -0.1, 0.7, 0.5])
    rotation = quaternion_rotation(components(quaternion / np.linalg.norm(quaternion)))
    expected = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    np.testing.assert_allclose(stacked(rotation, jnp.float64), expected, atol=1e-15)


def test_traced_arrays_become_components_of_their_entries():
    array = jnp.arange(12.0).reshape(2, 2, 3)
    again = jax.jit(lambda x: stacked(components(x), x.dtype))(array)
    np.testing.assert_array_equal(again, array)


@pytest.mark.parametrize("marked", [True, False])
@pytest.mark.parametrize("size", [1, 3, 7])
def test_cholesky_of_a_small_matrix(size, marked):
    rng = np.random.default_rng(size)
    root, right = rng.normal(size=(size, size)), rng.normal(size=size)
    matrix = root @ root.T + 0.1 * np.eye(size)

    @jax.jit
    def solved(matrix, right):
        factor = cholesky(components(matrix), marked=marked)
        solution = factor.solve(components(right))
        return stacked(solution, right.dtype), stacked(factor.inverse(), right.dtype)

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
