"""What a tip meets of an object, seen from above: against the solids themselves."""

import numpy as np
import pytest
import shapely
import trimesh

from mjx_inertia.objects import Part, cube, from_parts, load_catalogue, prism
from mjx_inertia.pushing import first_contact, plan_polygons, stack_polygons
from mjx_inertia.pushing.plan_view import upright_polygons

RADIUS = 0.005


def area(polygons):
    return shapely.union_all([shapely.Polygon(p) for p in polygons])


def test_a_ball_shows_the_widest_circle_of_the_slab():
    ball = load_catalogue("sphere")["sphere"]
    assert upright_polygons(ball) is None
    for height in (0.01, 0.02, 0.05):
        seen = area(plan_polygons(ball, height, RADIUS))
        above = min(abs(0.05 - height - RADIUS), abs(0.05 - height + RADIUS))
        above = 0.0 if abs(0.05 - height) < RADIUS else above
        widest = np.pi * (0.05**2 - above**2)
        assert seen.area == pytest.approx(widest, rel=0.02)  # facets of the ball


def test_wheels_are_apart_at_their_height_and_the_body_is_whole_above():
    car = load_catalogue("car_on_wheels")["car_on_wheels"]
    low = area(plan_polygons(car, 0.006, RADIUS))
    assert len(shapely.get_parts(low)) == 4
    high = area(plan_polygons(car, 0.04, RADIUS))
    assert high.contains(shapely.Point(*np.asarray(car.inertial.com)[:2]))


def test_polygons_follow_a_prism_with_a_notch():
    outline = np.array([[0, 0], [0.2, 0], [0.2, 0.05], [0.05, 0.05], [0.05, 0.2], [0, 0.2]])
    corner = prism(outline, 0.05, 1.0)
    polygons = plan_polygons(corner, 0.02, RADIUS)
    assert area(polygons).symmetric_difference(shapely.Polygon(outline)).area < 1e-8
    for polygon in polygons:
        assert shapely.Polygon(polygon).exterior.is_ccw


@pytest.mark.long
def test_every_object_shows_something_and_the_tip_finds_it():
    """From all sides a line through the outline's centroid meets the object, face to face."""
    for name, obj in load_catalogue(category=("Primitives", "Pushing")).items():
        polygons = plan_polygons(obj, min(0.02, obj.height / 2), RADIUS)
        whole = area(polygons)
        for angle in np.linspace(0.0, 2 * np.pi, 7):
            direction = np.array([np.cos(angle), np.sin(angle)])
            found = first_contact(polygons, np.array(whole.centroid.coords[0]), direction, RADIUS)
            if found is None:
                assert not shapely.intersects(whole, whole.centroid), name
                continue
            middle, point, normal = found
            assert whole.distance(shapely.Point(middle)) == pytest.approx(RADIUS, rel=2e-3), name
            np.testing.assert_allclose(middle + RADIUS * normal, point, atol=2e-5)
            assert normal @ direction > 0.0, name


def test_a_tip_that_passes_by_meets_nothing():
    box = plan_polygons(cube(0.1, 1.0), 0.02, RADIUS)
    ahead = np.array([1.0, 0.0])
    assert first_contact(box, np.array([0.0, 0.0551]), ahead, RADIUS) is None
    middle, point, normal = first_contact(box, np.array([0.0, 0.03]), ahead, RADIUS)
    np.testing.assert_allclose(middle, [-0.055, 0.03], atol=1e-9)
    np.testing.assert_allclose(point, [-0.05, 0.03], atol=1e-9)
    np.testing.assert_allclose(normal, ahead, atol=1e-6)


def test_filling_is_out_of_reach():
    shapes = [np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]), np.ones((3, 5, 2))]
    stacked = stack_polygons(shapes)
    assert stacked.shape == (2, 3, 5, 2)
    np.testing.assert_array_equal(stacked[0, 0, :3], shapes[0][0])
    assert np.all(stacked[0, 1:] >= 1e3)


def test_nothing_at_that_height():
    plate = trimesh.creation.box((0.1, 0.1, 0.01)).apply_translation((0.0, 0.0, 0.005))
    low = from_parts("low", [Part(plate, 500.0)])
    table = load_catalogue("tank")["tank"]
    with pytest.raises(ValueError, match=r"tank: nothing of it is 0\.5 m above the table"):
        plan_polygons(table, 0.5, RADIUS)
    assert area(plan_polygons(low, 0.005, RADIUS)).area == pytest.approx(0.01)
