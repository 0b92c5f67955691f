"""Every object of the catalogue is a solid of consistent inertia that stands by itself."""

import numpy as np
import pytest

from mjx_inertia.objects import friction_radius, load_catalogue
from mjx_inertia.objects.catalogue.load import CATEGORIES, recipes
from mjx_inertia.spatial import Consistency, check_consistency

pytestmark = pytest.mark.float64

FIRST = {next(n for n, r in recipes().items() if r.category == c) for c in CATEGORIES}
every_object = pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n in FIRST else pytest.mark.long) for n in recipes()],
)


def test_how_many_there_are():
    counts = {c: sum(r.category == c for r in recipes().values()) for c in CATEGORIES}
    assert len(recipes()) >= 57
    assert min(counts.values()) >= 10 and counts["Primitives"] >= 13


@every_object
def test_solid_consistent_and_at_rest(name):
    obj = load_catalogue(name)[name]
    assert obj.mesh.is_watertight and obj.mesh.is_winding_consistent and obj.mesh.volume > 0.0
    assert check_consistency(obj.inertial) == Consistency.CONSISTENT
    assert obj.stability > 1e-3  # m
    np.testing.assert_allclose(obj.mesh.bounds[:, 2], [0.0, obj.height], atol=2e-6)
    np.testing.assert_allclose(obj.mesh.bounds[0, :2], obj.outline.min(axis=0), atol=1e-5)
    np.testing.assert_allclose(obj.mesh.bounds[1, :2], obj.outline.max(axis=0), atol=1e-5)
    com = np.asarray(obj.inertial.com)
    assert np.all(com > obj.mesh.bounds[0]) and np.all(com < obj.mesh.bounds[1])


@every_object
def test_size_mass_and_words_are_those_of_real_things(name):
    obj = load_catalogue(name)[name]
    assert 0.04 < 2 * obj.half_extents.max() < 0.7  # m: what one arm can handle
    assert 0.01 < float(obj.inertial.mass) < 6.0
    assert 20.0 < float(obj.inertial.mass) / obj.mesh.volume < 9000.0  # kg/m³: foam to brass
    assert 0.1 < obj.friction < 1.0
    assert obj.name == name and obj.category in CATEGORIES and len(obj.source) > 10
    assert all(0.0 <= c <= 1.0 for part in obj.parts for c in part.color)


@every_object
def test_parts_add_up_to_the_whole(name):
    obj = load_catalogue(name)[name]
    mass = sum(part.density * part.mesh.volume for part in obj.parts)
    assert mass == pytest.approx(float(obj.inertial.mass), rel=1e-9)
    volume = sum(part.mesh.volume for part in obj.parts)
    assert volume == pytest.approx(obj.mesh.volume, rel=1e-4)


@every_object
def test_convex_pieces_and_support(name):
    """Few enough to collide with; the error of thin shells is large in shares of their volume."""
    obj = load_catalogue(name)[name]
    assert 1 <= len(obj.pieces) <= 400
    low = min(piece[:, 2].min() for piece in obj.pieces)
    high = max(piece[:, 2].max() for piece in obj.pieces)
    assert low == pytest.approx(0.0, abs=2e-3) and high == pytest.approx(obj.height, abs=3e-3)
    radius = friction_radius(obj.support, np.asarray(obj.inertial.com)[:2])
    assert 0.0 < radius < 2.0 * np.linalg.norm(obj.half_extents[:2])
