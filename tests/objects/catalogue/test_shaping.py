"""Shapes against closed forms: Pappus' theorems, capsules, frusta."""

import numpy as np
import pytest
from manifold3d import CrossSection

from mjx_inertia.objects.catalogue.shaping import (
    arc,
    block,
    core,
    ellipsoid_manifold,
    lathe,
    limb,
    outline,
    plate,
    rectangle,
    rod,
    side_view,
    slab,
    soften,
    spline,
    sweep,
    vessel,
)

SIDES = 96


def regular(sides):
    """Area of the polygon inside the unit circle, which facets give instead of π."""
    return 0.5 * sides * np.sin(2.0 * np.pi / sides)


def test_spline_goes_through_its_points():
    knots = np.array([(0.0, 0.0), (1.0, 0.5), (1.5, 2.0)])
    curve = spline(knots, 101)
    np.testing.assert_allclose(curve[[0, -1]], knots[[0, -1]], atol=1e-12)
    assert np.min(np.linalg.norm(curve - knots[1], axis=1)) < 0.02


def test_arc_ends_where_it_says():
    points = arc((1.0, 2.0), 0.5, 90.0, 180.0)
    np.testing.assert_allclose(points[[0, -1]], [(1.0, 2.5), (0.5, 2.0)], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points - [1.0, 2.0], axis=1), 0.5)


@pytest.mark.parametrize("sense", [1, -1])
def test_outline_takes_either_sense(sense):
    corners = np.array([(0.0, 0.0), (0.2, 0.0), (0.2, 0.1), (0.0, 0.1)])[::sense]
    assert outline(corners).area() == pytest.approx(0.02)


def test_softened_corners():
    area = soften(rectangle(0.1, 0.1), 0.01)
    assert area.area() == pytest.approx(0.01 - (4.0 - np.pi) * 1e-4, rel=1e-3)
    assert rectangle(0.1, 0.1, 0.01).area() == pytest.approx(area.area(), rel=1e-3)


@pytest.mark.parametrize("make", [plate, slab])
def test_plates(make):
    area = rectangle(0.1, 0.06, 0.01) - CrossSection.circle(0.015, 64)
    sharp, rounded = make(area, 0.02), make(area, 0.02, 0.004)
    assert sharp.volume() == pytest.approx(0.02 * area.area(), rel=1e-9)
    # each rim loses (1 - π/4) e² along its length, by Pappus nearly so; the chords a little more
    length = sum(
        np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1).sum()
        for ring in area.to_polygons()
    )
    lost = 2.0 * length * (1.0 - np.pi / 4.0) * 0.004**2
    assert sharp.volume() - rounded.volume() == pytest.approx(lost, rel=0.2)
    np.testing.assert_allclose(rounded.bounding_box(), sharp.bounding_box(), atol=1e-12)


def test_plate_too_thin_for_its_edges():
    with pytest.raises(ValueError, match=r"edge: 0\.01 m is not below half of the thickness"):
        plate(rectangle(0.1, 0.1), 0.02, 0.01)


def test_side_view_stands_about_the_vertical_plane():
    low_x, low_y, low_z, high_x, high_y, high_z = side_view(
        outline([(0.0, 0.0), (0.3, 0.0), (0.3, 0.1)]), 0.02
    ).bounding_box()
    np.testing.assert_allclose([low_x, high_x, low_z, high_z], [0.0, 0.3, 0.0, 0.1], atol=1e-9)
    np.testing.assert_allclose([low_y, high_y], [-0.01, 0.01], atol=1e-12)


def test_blocks():
    np.testing.assert_allclose(
        block(0.1, 0.2, 0.3, 0.02).bounding_box(), [-0.05, -0.1, 0.0, 0.05, 0.1, 0.3], atol=1e-9
    )
    inner, r = np.array([0.06, 0.16, 0.26]), 0.02  # Steiner's formula for the box within
    faces = 2.0 * (inner[0] * inner[1] + inner[1] * inner[2] + inner[2] * inner[0])
    steiner = inner.prod() + faces * r + np.pi * inner.sum() * r**2 + 4.0 / 3.0 * np.pi * r**3
    assert block(0.1, 0.2, 0.3, 0.02).volume() == pytest.approx(steiner, rel=5e-3)


def test_lathe_by_pappus():
    ring = lathe(CrossSection.circle(0.01, SIDES).translate((0.05, 0.0)), SIDES)
    torus = 2.0 * np.pi * 0.05 * np.pi * 0.01**2
    assert ring.volume() == pytest.approx(torus, rel=3e-3)
    cone = lathe([(0.0, 0.0), (0.03, 0.0), (0.0, 0.1)], SIDES)
    assert cone.volume() == pytest.approx(regular(SIDES) * 0.03**2 * 0.1 / 3.0, rel=1e-5)


def test_vessel_and_what_lies_below_its_surface():
    curve = np.array([(0.0, 0.0), (0.04, 0.0), (0.04, 0.1)])
    cup = vessel(curve, 0.004, SIDES)
    solid = regular(SIDES) * (0.04**2 * 0.1 - 0.036**2 * 0.096)
    assert cup.volume() == pytest.approx(solid, rel=0.01)  # its rim and corner are rounded
    assert cup.bounding_box()[5] == pytest.approx(0.1, abs=1e-6)
    deeper = core(curve, 0.002, SIDES)
    assert deeper.volume() == pytest.approx(regular(SIDES) * 0.038**2 * 0.096, rel=1e-3)


def test_ellipsoid_limb_and_rod():
    ball = ellipsoid_manifold((0.1, 0.2, 0.3), (0.03, 0.02, 0.01), 64)
    assert ball.volume() == pytest.approx(4.0 / 3.0 * np.pi * 6e-6, rel=0.01)
    assert ball.bounding_box()[3] == pytest.approx(0.13)
    capsule = limb([(0.0, 0.0, 0.0), (0.0, 0.03, 0.04)], 0.01, 64)
    round_bar = np.pi * 0.01**2 * 0.05 + 4.0 / 3.0 * np.pi * 0.01**3
    assert capsule.volume() == pytest.approx(round_bar, rel=0.01)
    start, end = np.array([0.01, 0.02, 0.03]), np.array([-0.05, 0.04, 0.1])
    cone = rod(start, end, 0.02, 0.01, SIDES)
    length = np.linalg.norm(end - start)
    assert cone.volume() == pytest.approx(regular(SIDES) * length * 7e-4 / 3.0, rel=1e-5)
    middle = rod(start, end, 0.02, -1.0, SIDES).bounding_box()
    np.testing.assert_allclose(0.5 * (np.array(middle[:3]) + middle[3:]), 0.5 * (start + end))


def test_sweep_by_pappus():
    path = arc((0.0, 0.0), 0.05, 0.0, 90.0, 60)
    quarter = sweep(rectangle(0.01, 0.02), path)
    assert quarter.volume() == pytest.approx(0.5 * np.pi * 0.05 * 2e-4, rel=1e-3)
    straight = sweep(rectangle(0.01, 0.02), [(0.0, 0.0), (0.0, 0.1)], [(1.0, 1.0), (0.0001, 1.0)])
    assert straight.volume() == pytest.approx(0.5 * 0.1 * 2e-4, rel=1e-3)
    leaning = sweep(rectangle(0.01, 0.02).translate((0.005, 0.0)), [(0.0, 0.0), (0.0, 0.1)])
    assert leaning.bounding_box()[0] == pytest.approx(0.0, abs=1e-12)  # right of the way up is +x
