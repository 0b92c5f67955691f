"""Convex pieces: convex, and together the outline within the tolerance."""

import numpy as np
import pytest
import shapely

from mjx_inertia.objects import convex_pieces, load_mcube_objects

STAR = np.array(
    [
        (1.0 if k % 2 else 0.4) * 0.1 * np.array([np.cos(k * np.pi / 5), np.sin(k * np.pi / 5)])
        for k in range(10)
    ]
)


def area_error(outline, pieces):
    """Area in the outline or in the union of the pieces but not in both, as a fraction."""
    whole = shapely.Polygon(outline)
    union = shapely.union_all([shapely.Polygon(piece) for piece in pieces])
    return whole.symmetric_difference(union).area / whole.area


def is_convex(outline):
    step = np.roll(outline, -1, axis=0) - outline
    following = np.roll(step, -1, axis=0)
    return bool(np.all(step[:, 0] * following[:, 1] - step[:, 1] * following[:, 0] > -1e-15))


@pytest.mark.parametrize("tolerance", [2e-3, 2e-4])
@pytest.mark.parametrize("name", ["star", "butter"])
def test_union_follows_the_outline(name, tolerance):
    outline = STAR if name == "star" else load_mcube_objects()["butter"].outline
    pieces = convex_pieces(outline, tolerance)
    assert all(is_convex(piece) for piece in pieces)
    union = shapely.union_all([shapely.Polygon(piece) for piece in pieces])
    gap = shapely.hausdorff_distance(union.boundary, shapely.LinearRing(outline), densify=0.1)
    assert gap <= tolerance
    assert area_error(outline, pieces) < 20.0 * tolerance
    total = sum(shapely.Polygon(piece).area for piece in pieces)
    assert total == pytest.approx(union.area, rel=0.02)  # they hardly overlap
    assert 2 <= len(pieces) <= 20


def test_a_convex_outline_is_one_piece_as_it_is():
    outline = load_mcube_objects()["ellip2"].outline
    (piece,) = convex_pieces(outline)
    np.testing.assert_array_equal(piece, outline)
    assert area_error(outline, (piece,)) == pytest.approx(0.0, abs=1e-12)


def test_a_star_is_cut_at_its_notches():
    pieces = convex_pieces(STAR)
    assert area_error(STAR, pieces) == pytest.approx(0.0, abs=1e-9)
    assert len(pieces) <= 6


def test_senseless_tolerances():
    with pytest.raises(ValueError, match="not positive"):
        convex_pieces(STAR, 0.0)
    with pytest.raises(ValueError, match="more than 3 convex pieces; give a larger tolerance"):
        convex_pieces(STAR, 1e-5, most=3)
