"""Turned, extruded and swept parts: watertight, of the true volume, and their convex pieces."""

import numpy as np
import pytest
import shapely
import trimesh
from simple_parts import box, cylinder, extrusion, revolution, tube

from mjx_inertia.objects.catalogue.primitives import ellipsoid
from mjx_inertia.objects.convex import pieces_error
from mjx_inertia.objects.manifolds import union
from mjx_inertia.objects.model import moved, on_table, transformed, turned

CUP = np.array([[0, 0], [0.04, 0], [0.04, 0.09], [0.036, 0.09], [0.036, 0.005], [0, 0.005]])
HOLED = shapely.box(0.0, 0.0, 0.2, 0.1).difference(shapely.Point(0.1, 0.05).buffer(0.03))
PARTS = {
    "box": (box((0.1, 0.2, 0.3), density=1.0), 0.006),
    "cylinder": (cylinder(0.05, 0.2, density=1.0), np.pi * 0.05**2 * 0.2),
    "tube": (tube(0.05, 0.03, 0.2, density=1.0), np.pi * (0.05**2 - 0.03**2) * 0.2),
    "cone": (
        revolution(np.array([[0.0, 0.0], [0.06, 0.0], [0.0, 0.1]]), density=1.0),
        np.pi * 0.06**2 * 0.1 / 3,
    ),
    "cup": (
        revolution(CUP, density=1.0),
        np.pi * (0.04**2 * 0.09 - 0.036**2 * 0.085),
    ),
    "ellipsoid": (
        ellipsoid.build(0.1, 0.07, 0.05)[0],
        4 / 3 * np.pi * 0.1 * 0.07 * 0.05,
    ),
    "holed plate": (extrusion(HOLED, 0.02, density=1.0), HOLED.area * 0.02),
}


@pytest.mark.parametrize("name", PARTS)
def test_volume_of_the_true_shape(name):
    part, volume = PARTS[name]
    assert part.mesh.is_watertight and part.mesh.is_winding_consistent
    assert part.mesh.volume == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "error"),
    [("cup", 0.15), ("tube", 0.03), ("holed plate", 0.01), ("cone", 1e-6)],
)
def test_convex_pieces_follow_the_part(name, error):
    """Sectors fill a hollow up to their chords; what is not hollow is exact."""
    part, _ = PARTS[name]
    assert pieces_error(part.mesh, part.pieces) < error
    for piece in part.pieces:
        hull = trimesh.convex.convex_hull(piece)
        assert len(hull.vertices) == len(piece)  # every vertex is a corner of its hull


def test_round_shapes_have_the_moments_of_the_true_ones():
    part = cylinder(0.05, 0.2, density=1.0)
    axial = part.mesh.moment_inertia[2, 2] / part.mesh.volume
    assert axial == pytest.approx(0.05**2 / 2, rel=1e-5)
    ball = moved(ellipsoid.build(0.05, 0.05, 0.05)[0], (0.1, 0.0, 0.0)).mesh
    expected = 0.4 * 0.05**2 * ball.volume * np.eye(3)
    np.testing.assert_allclose(ball.moment_inertia, expected, rtol=2e-3, atol=1e-15)
    np.testing.assert_allclose(ball.center_mass, [0.1, 0.0, 0.5 * ball.extents[2]], atol=1e-12)


def test_rings_fit_their_shafts():
    """Facets match, so a ring on a shaft touches it everywhere and shares nothing with it."""
    shaft = cylinder(0.01, 0.2, density=1.0)
    ring = moved(tube(0.03, 0.01, 0.02, density=1.0), (0.0, 0.0, 0.1))
    both = [turned(part, 90.0, (0.0, 1.0, 0.0)) for part in (shaft, ring)]
    whole = union(part.mesh for part in both)
    assert whole.volume() == pytest.approx(shaft.mesh.volume + ring.mesh.volume, rel=1e-7)
    assert len(whole.decompose()) == 1


def test_moving_turning_and_mirroring_keep_the_solid():
    part, volume = PARTS["cup"]
    mirrored = transformed(turned(part, 30.0, (1.0, 2.0, 0.5)), np.diag([-1.0, 1.0, 1.0, 1.0]))
    assert mirrored.mesh.volume == pytest.approx(volume)
    assert pieces_error(mirrored.mesh, mirrored.pieces) == pytest.approx(
        pieces_error(part.mesh, part.pieces), rel=1e-6
    )
    (down,) = on_table(moved(part, (0.0, 0.0, -3.0)))
    assert down.mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-12)
