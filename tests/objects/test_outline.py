"""Planar integrals against closed forms and shapely; closest points against shapely."""

import numpy as np
import pytest
import shapely
from scipy.integrate import dblquad

from mjx_inertia.objects import closest_on_outline, friction_radius, planar_integrals

SQUARE = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
ELL = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]) * 0.05


def turned(outline, angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return outline @ np.array([[c, s], [-s, c]]) + shift


def test_integrals_of_a_rectangle_and_a_triangle():
    rectangle = planar_integrals(SQUARE * [3.0, 2.0] + [7.0, -4.0])
    assert rectangle.area == pytest.approx(6.0)
    np.testing.assert_allclose(rectangle.centroid, [7.0, -4.0])
    np.testing.assert_allclose(
        rectangle.second_moment, np.diag([6 * 9 / 12, 6 * 4 / 12]), atol=1e-12
    )
    triangle = planar_integrals(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 6.0]]))
    np.testing.assert_allclose(triangle.centroid, [1.0, 2.0])
    # b h³ / 36 and its kin about the centroid.
    np.testing.assert_allclose(
        triangle.second_moment, [[6 * 27 / 36, -9.0 * 36 / 72], [-9.0 * 36 / 72, 3 * 216 / 36]]
    )


def test_integrals_turn_and_shift_with_the_outline():
    for angle in (0.3, 2.0, -1.1):
        c, s = np.cos(angle), np.sin(angle)
        rotation = np.array([[c, -s], [s, c]])
        plain, moved = planar_integrals(ELL), planar_integrals(turned(ELL, angle, [40.0, -9.0]))
        assert moved.area == pytest.approx(plain.area, rel=1e-9)
        np.testing.assert_allclose(moved.centroid, rotation @ plain.centroid + [40.0, -9.0])
        np.testing.assert_allclose(
            moved.second_moment, rotation @ plain.second_moment @ rotation.T, rtol=1e-8, atol=1e-12
        )
    with pytest.raises(ValueError, match="counter-clockwise"):
        planar_integrals(ELL[::-1])


def test_friction_radius_of_a_square():
    """(√2 + asinh 1) / 6 of the edge, 0.3826 (thesis Eq. 3.6, errata 5)."""
    closed_form = (np.sqrt(2.0) + np.arcsinh(1.0)) / 6.0
    assert friction_radius(SQUARE, np.zeros(2)) == pytest.approx(closed_form, rel=1e-12)
    assert friction_radius(0.2 * SQUARE + 3.0, np.full(2, 3.0)) == pytest.approx(0.2 * closed_form)


def test_friction_radius_of_a_disc_and_about_any_point():
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    disc = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    assert friction_radius(disc, np.zeros(2)) == pytest.approx(2.0 / 3.0, rel=1e-4)
    for about in ([0.2, 0.1], [0.5, 0.5], [0.5, 0.0], [-2.0, 1.0]):  # inside, corner, edge, outside
        x, y = about
        mean, _ = dblquad(lambda v, u: np.hypot(u - x, v - y), -0.5, 0.5, -0.5, 0.5)  # noqa: B023
        assert friction_radius(SQUARE, np.array(about)) == pytest.approx(mean, rel=1e-6)


def test_closest_points_against_shapely():
    points = np.random.default_rng(3).uniform(-0.05, 0.2, (400, 2))
    contact = closest_on_outline(ELL, points)
    polygon, ring = shapely.Polygon(ELL), shapely.LinearRing(ELL)
    places = shapely.points(points)
    inside = shapely.contains(polygon, places)
    distance = shapely.distance(ring, places)
    np.testing.assert_allclose(contact.distance, np.where(inside, -distance, distance), atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(contact.normal, axis=1), 1.0)
    # The inward normal goes down the signed distance.
    step = 1e-7
    further = closest_on_outline(ELL, points + step * contact.normal).distance
    np.testing.assert_allclose(further - contact.distance, -step, rtol=1e-3)
    np.testing.assert_allclose(contact.distance[:, None] * contact.normal, contact.point - points)


def test_normal_on_the_outline_itself_is_that_of_the_side():
    contact = closest_on_outline(SQUARE, np.array([[0.5, 0.2], [0.1, -0.5]]))
    np.testing.assert_allclose(contact.normal, [[-1.0, 0.0], [0.0, 1.0]], atol=1e-12)
    np.testing.assert_array_equal(contact.edge, [3, 2])
