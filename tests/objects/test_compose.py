"""Scaled, re-massed and combined objects against the same parts assembled anew."""

import jaxlie
import jaxtyping
import numpy as np
import pytest
from simple_parts import box, cylinder

from mjx_inertia.objects import combine_objects, cuboid, from_parts, re_mass, scale_object
from mjx_inertia.objects.model import moved, turned
from mjx_inertia.spatial import Consistency, check_consistency

pytestmark = pytest.mark.float64


def lamp():
    foot = cylinder(0.08, 0.02, density=7000.0)
    pole = cylinder(0.01, 0.3, (0.02, 0.0, 0.02), density=2700.0)
    return from_parts("lamp", [foot, pole], friction=0.5)


def assert_same_body(a, b, tolerance=1e-9):
    np.testing.assert_allclose(a.inertial.mass, b.inertial.mass, rtol=tolerance)
    np.testing.assert_allclose(a.inertial.com, b.inertial.com, atol=tolerance)
    np.testing.assert_allclose(
        a.inertial.inertia, b.inertial.inertia, atol=tolerance * float(b.inertial.inertia.max())
    )


def test_a_stretched_object_is_that_of_its_stretched_parts():
    stretched = scale_object(lamp(), (1.5, 0.7, 2.0))
    assert_same_body(stretched, from_parts("again", stretched.parts))
    assert stretched.height == pytest.approx(0.64, abs=1e-6)
    assert stretched.mesh.volume == pytest.approx(2.1 * lamp().mesh.volume)
    assert stretched.pieces_error == pytest.approx(lamp().pieces_error, abs=1e-6)
    assert stretched.support[0].max(axis=0)[0] == pytest.approx(
        1.5 * lamp().support[0].max(axis=0)[0]
    )


def test_scaling_of_a_cuboid():
    """At twice the size the mass is 8 times and the tensor 32 times as large."""
    small, large = cuboid((0.1, 0.2, 0.3), 1.0), scale_object(cuboid((0.1, 0.2, 0.3), 1.0), 2.0)
    np.testing.assert_allclose(large.inertial.inertia, 32 * small.inertial.inertia, rtol=1e-12)
    assert float(large.inertial.mass) == pytest.approx(8.0) and large.is_box
    light = scale_object(small, 2.0, mass=1.0)
    np.testing.assert_allclose(light.inertial.inertia, 4 * small.inertial.inertia, rtol=1e-12)


def test_another_mass():
    heavy = re_mass(lamp(), 5.0)
    assert float(heavy.inertial.mass) == 5.0
    assert_same_body(heavy, from_parts("again", heavy.parts))
    assert_same_body(heavy, from_parts("again", lamp().parts, mass=5.0))


def test_combined_objects_are_the_sum_of_their_parts():
    brick = from_parts("brick", [box((0.1, 0.05, 0.02), density=1800.0)])
    turn = jaxlie.SO3.from_z_radians(0.7)
    up = jaxlie.SE3.from_rotation_and_translation(turn, np.array([0.02, 0.01, 0.32]))
    both = combine_objects([lamp(), brick], [jaxlie.SE3.identity(), up], name="loaded lamp")
    above = moved(turned(brick.parts[0], np.degrees(0.7)), (0.02, 0.01, 0.32))
    assert_same_body(both, from_parts("again", [*lamp().parts, above]), 1e-8)
    assert both.mesh.is_watertight and both.stability > 0.0
    assert both.height == pytest.approx(0.34, abs=1e-6)
    assert both.friction == 0.5 and len(both.parts) == 3 and both.pieces_error < 1e-6
    assert check_consistency(both.inertial) == Consistency.CONSISTENT


def test_the_whole_is_put_down():
    flat = cuboid((0.1, 0.1, 0.02), 1.0)
    low = jaxlie.SE3.from_translation(np.array([0.0, 0.0, -0.02]))
    both = combine_objects([flat, flat], [jaxlie.SE3.identity(), low])
    np.testing.assert_allclose(both.inertial.com, [0.0, 0.0, 0.02], atol=1e-8)
    assert both.height == pytest.approx(0.04, abs=1e-6)


def test_rounding_does_not_part_what_touches():
    """A pose in single precision leaves a gap of nanometres."""
    box = cuboid((0.1, 0.1, 0.1), 1.0)
    beside = jaxlie.SE3.from_translation(np.array([0.1 + 4e-9, 0.0, 0.0]))
    both = combine_objects([box, box], [jaxlie.SE3.identity(), beside])
    assert both.footprint.area == pytest.approx(0.02, rel=1e-6)


def test_wrong_types():
    box = cuboid((0.1, 0.1, 0.1), 1.0)
    jaxtyping.config.update("jaxtyping_disable", True)
    try:
        with pytest.raises(ValueError, match="mass None kg is not positive"):
            re_mass(box, None)  # pyright: ignore[reportArgumentType]
        with pytest.raises(ValueError, match=r"factor \(1, 2\) is not one number or three"):
            scale_object(box, (1, 2))  # pyright: ignore[reportArgumentType]
        with pytest.raises(ValueError, match=r"pose 0 is a ndarray, expected a jaxlie\.SE3"):
            combine_objects([box], [np.eye(4)])  # pyright: ignore[reportArgumentType]
    finally:
        jaxtyping.config.update("jaxtyping_disable", False)


def test_errors():
    box = cuboid((0.1, 0.1, 0.1), 1.0)
    with pytest.raises(ValueError, match="overlap by 500 cm³"):
        half = jaxlie.SE3.from_translation(np.array([0.05, 0.0, 0.0]))
        combine_objects([box, box], [jaxlie.SE3.identity(), half])
    with pytest.raises(ValueError, match="2 objects with 1 poses"):
        combine_objects([box, box], [jaxlie.SE3.identity()])
    here = jaxlie.SE3.identity()
    with pytest.raises(ValueError, match=r"combined: it is 2 bodies that lie 9\.9e\+03 mm "):
        combine_objects([box, box], [here, jaxlie.SE3.from_translation(np.array([10.0, 0.0, 0.0]))])
    with pytest.raises(ValueError, match="combined: pose 1 is not finite"):
        combine_objects([box, box], [here, jaxlie.SE3.from_translation(np.full(3, np.nan))])
    with pytest.raises(ValueError, match="one has leading axes"):
        combine_objects([box], [jaxlie.SE3.identity((3,))])
    with pytest.raises(ValueError, match=r"factor 0\.0 is not positive"):
        scale_object(box, 0.0)
    with pytest.raises(ValueError, match="mass nan kg is not positive"):
        re_mass(box, np.nan)
