"""Inertia of primitives and prisms against closed forms and trimesh; checks of the model."""

import numpy as np
import pytest
import shapely
import trimesh

from mjx_inertia.objects import ObjectModel, cube, cuboid, prism
from mjx_inertia.spatial import InertialParameters

BOOT = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.08, 0.1], [0.0, 0.12]])


def test_cube_and_cuboid():
    model = cube(0.15, 2.0)
    np.testing.assert_allclose(model.inertial.inertia, 2.0 * 0.15**2 / 6 * np.eye(3), atol=1e-9)
    np.testing.assert_allclose(model.inertial.com, [0.0, 0.0, 0.075])
    model = cuboid((0.1, 0.2, 0.3), 1.5)
    expected = 1.5 / 12 * np.diag([0.2**2 + 0.3**2, 0.1**2 + 0.3**2, 0.1**2 + 0.2**2])
    np.testing.assert_allclose(model.inertial.inertia, expected, rtol=1e-6, atol=1e-9)
    assert model.is_box and model.is_convex
    np.testing.assert_allclose(model.half_extents, [0.05, 0.1, 0.15])
    np.testing.assert_allclose(model.center, [0.0, 0.0, 0.15])
    assert model.mean_diameter == pytest.approx(2 * np.sqrt(0.02 / np.pi))


def test_box_off_the_origin_is_a_box_and_a_turned_one_is_not():
    outline = np.array([[1.0, 1.0], [1.2, 1.0], [1.2, 1.1], [1.0, 1.1]])
    model = prism(outline, 0.1, 1.0)
    assert model.is_box
    np.testing.assert_allclose(model.center, [1.1, 1.05, 0.05])
    assert not prism(outline @ np.array([[0.8, 0.6], [-0.6, 0.8]]), 0.1, 1.0).is_box


def test_prism_against_trimesh():
    height, density = 0.07, 800.0
    mesh = trimesh.creation.extrude_polygon(shapely.Polygon(BOOT), height)
    mesh.density = density
    model = prism(BOOT, height, mesh.volume * density)
    np.testing.assert_allclose(model.inertial.com, mesh.center_mass, atol=1e-7)
    np.testing.assert_allclose(model.inertial.inertia, mesh.moment_inertia, rtol=1e-5, atol=1e-8)


def test_stated_inertia_scales_the_spread_in_the_plane():
    plain = prism(BOOT, 0.05, 2.0)
    stated = prism(BOOT, 0.05, 2.0, inertia_zz=0.02, com=(0.1, 0.04))
    before, after = np.asarray(plain.inertial.inertia), np.asarray(stated.inertial.inertia)
    assert after[2, 2] == pytest.approx(0.02)
    ratio = 0.02 / before[2, 2]
    along_z = 2.0 * 0.05**2 / 12
    np.testing.assert_allclose(
        after[:2, :2] - along_z * np.eye(2),
        ratio * (before[:2, :2] - along_z * np.eye(2)),
        rtol=1e-4,
    )
    np.testing.assert_allclose(stated.inertial.com, [0.1, 0.04, 0.025])


def test_clockwise_and_closed_outlines_are_put_right():
    closed = np.concatenate([BOOT, BOOT[:1]])[::-1]
    model = prism(closed, 0.05, 1.0)
    assert len(model.outline) == len(BOOT)
    assert model.footprint.area == pytest.approx(shapely.Polygon(BOOT).area)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"outline": BOOT[[0, 2, 1, 3, 4]]}, "not simple"),
        ({"outline": BOOT * [1.0, 0.0]}, "no area"),
        ({"outline": BOOT[:2]}, "2 distinct vertices"),
        ({"outline": np.where(BOOT > 0.1, np.nan, BOOT)}, "not finite"),
        ({"mass": 0.0}, "mass"),
        ({"mass": np.inf}, "mass"),
        ({"height": -1.0}, "height"),
        ({"inertia_zz": -1.0}, "inertia_zz"),
        ({"com": (np.nan, 0.0)}, "com"),
    ],
)
def test_impossible_objects(change, message):
    arguments = {"outline": BOOT, "height": 0.1, "mass": 1.0, "name": "boot", **change}
    with pytest.raises(ValueError, match=f"boot: .*{message}"):
        prism(**arguments)


def test_an_inconsistent_tensor_is_refused():
    good = prism(BOOT, 0.1, 1.0).inertial
    bad = InertialParameters(good.mass, good.com, good.inertia * np.diag([1.0, 1.0, 9.0]))
    with pytest.raises(ValueError, match="boot: no body has principal moments"):
        ObjectModel("boot", BOOT, 0.1, bad)


def test_cuboid_edges():
    with pytest.raises(ValueError, match="edge that is not positive"):
        cuboid((0.1, 0.0, 0.1), 1.0)
