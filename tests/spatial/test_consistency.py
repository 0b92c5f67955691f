import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import pytest
from point_clouds import batched, random_bodies, random_poses

from mjx_inertia.spatial import (
    Consistency,
    InertialParameters,
    change_frame,
    check_consistency,
    explain_consistency,
    to_pseudo_inertia,
)
from mjx_inertia.spatial.consistency import thicken


def body(moments, mass=1.0, com=(0.1, 0.2, 0.3)):
    inertia = jnp.diag(jnp.asarray(moments, float))
    return InertialParameters(jnp.asarray(mass, float), jnp.asarray(com, float), inertia)


def skewed():
    good = body((1.0, 1.2, 1.5))
    return good.replace(inertia=good.inertia.at[0, 1].set(0.25))


CASES = {
    "good": (lambda: body((1.0, 1.2, 1.5)), Consistency.CONSISTENT, "1, 1.2, 1.5"),
    "rod": (lambda: body((0.0, 1.0, 1.0)), Consistency.ON_BOUNDARY, "rod"),
    "plate": (lambda: body((1.0, 1.0, 2.0)), Consistency.ON_BOUNDARY, "plate"),
    "point": (lambda: body((0.0, 0.0, 0.0)), Consistency.ON_BOUNDARY, "point"),
    "triangle": (lambda: body((1.0, 1.0, 2.5)), Consistency.TRIANGLE_INEQUALITY, "by 0.5 kg m²"),
    "negative": (lambda: body((-0.1, 1.0, 1.0)), Consistency.NEGATIVE_MOMENT, "-0.1"),
    "skewed": (skewed, Consistency.NOT_SYMMETRIC, "I_xy = 0.25 and I_yx = 0"),
    "no mass": (lambda: body((1, 1, 1), mass=0.0), Consistency.NONPOSITIVE_MASS, "0 kg"),
    "light": (lambda: body((1, 1, 1), mass=-2.0), Consistency.NONPOSITIVE_MASS, "-2 kg"),
    "nan mass": (lambda: body((1, 1, 1), mass=np.nan), Consistency.NOT_FINITE, "mass = nan"),
    "nan tensor": (lambda: body((1, np.nan, 1)), Consistency.NOT_FINITE, "inertia = "),
    "far": (lambda: body((1, 1, 1), com=(np.inf, 0, 0)), Consistency.NOT_FINITE, "com = [inf"),
}


@pytest.mark.parametrize("case", CASES)
def test_each_reason_is_found_and_told(case):
    make, status, words = CASES[case]
    params = make()
    assert check_consistency(params) == status
    assert words in explain_consistency(params)


@pytest.mark.parametrize("x64", [True, False])
def test_a_batch_keeps_its_bad_bodies_apart(x64):
    with jax.enable_x64(x64):
        bodies = jax.tree.map(lambda *x: jnp.stack(x), *(make() for make, *_ in CASES.values()))
        statuses = batched(check_consistency)(bodies)
        assert statuses.tolist() == [int(status) for _, status, _ in CASES.values()]
        with pytest.raises(ValueError, match="one body"):
            explain_consistency(bodies)


@pytest.mark.parametrize("x64", [True, False])
def test_status_does_not_depend_on_the_frame(x64):
    names = ("good", "rod", "plate", "point", "triangle", "negative")
    statuses = [int(CASES[name][1]) for name in names]
    wxyz_xyz = np.asarray(random_poses(300).wxyz_xyz)

    def status(params, wxyz_xyz):
        return check_consistency(change_frame(params, jaxlie.SE3(wxyz_xyz)))

    with jax.enable_x64(x64):
        bodies = jax.tree.map(lambda *x: jnp.stack(x), *(CASES[name][0]() for name in names))
        turned = batched(jax.vmap(status, (None, 0)), (0, None))(bodies, jnp.asarray(wxyz_xyz))
        np.testing.assert_array_equal(turned, np.repeat(statuses, 300).reshape(-1, 300))


def test_consistent_is_a_positive_definite_pseudo_inertia():
    """Random symmetric tensors on both sides of the boundary, CoM away from the origin."""
    root = np.random.default_rng(0).normal(size=(500, 3, 9))
    bodies = random_bodies(500)
    bodies = bodies.replace(inertia=jnp.asarray(root @ root.swapaxes(1, 2)))
    positive = np.linalg.eigvalsh(np.asarray(batched(to_pseudo_inertia)(bodies)))[:, 0] > 0.0
    consistent = np.asarray(batched(check_consistency)(bodies)) == Consistency.CONSISTENT
    assert 50 < positive.sum() < 450
    np.testing.assert_array_equal(consistent, positive)


@pytest.mark.parametrize(
    ("x64", "thinnest_rod", "thinnest_plate"), [(True, 1e-6, 1e-6), (False, 3e-3, 8e-3)]
)
def test_how_thin_a_body_may_be(x64, thinnest_rod, thinnest_plate):
    """The radius of a 1 m rod and the thickness of a 1 m plate that the dtype can still tell."""

    def rod(radius):
        across = (3 * radius**2 + 1) / 12
        return body((radius**2 / 2, across, across))

    def plate(thickness):
        across = (1 + thickness**2) / 12
        return body((across, across, 1 / 6))

    with jax.enable_x64(x64):
        status = jax.jit(check_consistency)
        assert status(rod(thinnest_rod)) == Consistency.CONSISTENT
        assert status(plate(thinnest_plate)) == Consistency.CONSISTENT
        assert status(rod(thinnest_rod / 100)) == Consistency.ON_BOUNDARY
        assert status(plate(thinnest_plate / 100)) == Consistency.ON_BOUNDARY


def test_tolerance_admits_rounded_files():
    rounded = body((0.333, 0.333, 0.667))
    assert check_consistency(rounded) == Consistency.TRIANGLE_INEQUALITY
    assert check_consistency(rounded, 2e-3) == Consistency.ON_BOUNDARY
    assert "within 0.002" in explain_consistency(rounded, 2e-3)


def test_thickening_is_alike_in_all_frames_and_makes_bodies_consistent():
    poses = random_poses(20)

    def both(params, T):
        return thicken(change_frame(params, T), 1e-3), change_frame(thicken(params, 1e-3), T)

    for name in ("rod", "plate", "point"):
        params = CASES[name][0]()
        first, second = batched(both, (None, 0))(params, poses)
        np.testing.assert_allclose(first.inertia, second.inertia, atol=1e-14)
        assert np.all(batched(check_consistency)(first) == Consistency.CONSISTENT)
