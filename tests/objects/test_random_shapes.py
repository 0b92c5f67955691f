"""Random families: exact, consistent, all different, and the same for the same seed."""

import numpy as np
import pytest

from mjx_inertia.objects import RandomShapes, from_parts, random_objects
from mjx_inertia.objects.random_shapes import OUTLINES
from mjx_inertia.spatial import Consistency, check_consistency

pytestmark = pytest.mark.float64


@pytest.mark.parametrize("kind", OUTLINES)
def test_every_kind_is_exact_and_within_its_ranges(kind):
    settings = RandomShapes(kinds=(kind,), two_materials=0.7)
    for obj in random_objects(4, seed=2, settings=settings):
        assert check_consistency(obj.inertial) == Consistency.CONSISTENT
        assembled = from_parts(obj.name, obj.parts)
        np.testing.assert_allclose(obj.inertial.mass, assembled.inertial.mass, rtol=1e-12)
        np.testing.assert_allclose(obj.inertial.com, assembled.inertial.com, atol=1e-12)
        scale = float(assembled.inertial.inertia.max())
        np.testing.assert_allclose(
            obj.inertial.inertia, assembled.inertial.inertia, atol=1e-11 * scale
        )
        assert obj.mesh.is_watertight and obj.stability > 0.0 and obj.pieces_error < 0.04
        assert 0.1 <= obj.inertial.mass <= 5.0 and 0.02 <= obj.height <= 0.15
        length = 2 * obj.half_extents[:2].max()
        assert 0.1 <= length <= 0.3 + 1e-12


def test_the_same_for_the_same_seed_whatever_the_count():
    few, many = random_objects(3, seed=5), random_objects(6, seed=5)
    for a, b in zip(few, many, strict=False):
        np.testing.assert_array_equal(a.outline, b.outline)
        assert a.inertial.mass == b.inertial.mass and a.friction == b.friction
    other = random_objects(3, seed=6)
    assert all(a.inertial.mass != b.inertial.mass for a, b in zip(few, other, strict=True))


def test_two_materials_move_the_centre_of_mass():
    """Off the centroid, where one material leaves it."""
    for share in (0.0, 1.0):
        settings = RandomShapes(kinds=("rectangle",), two_materials=share)
        objects = random_objects(5, seed=1, settings=settings)
        away = [np.linalg.norm(np.asarray(o.inertial.com)[:2]) for o in objects]
        assert (min(away) > 1e-4) if share else (max(away) < 1e-12)


def test_settings_that_nothing_can_be_drawn_from():
    with pytest.raises(ValueError, match=r"kinds=.*choose from"):
        RandomShapes(kinds=("blob",))
    with pytest.raises(ValueError, match="mass="):
        RandomShapes(mass=(2.0, 1.0))
    with pytest.raises(ValueError, match="count=0"):
        random_objects(0, seed=1)
