"""Parts become an object: exact inertia, silhouette, what it stands on, and clear errors."""

import numpy as np
import pytest
import trimesh
from simple_parts import box, cylinder, tube

from mjx_inertia.objects import Part, friction_radius, from_parts
from mjx_inertia.objects.catalogue.primitives import ellipsoid
from mjx_inertia.objects.model import moved, turned

pytestmark = pytest.mark.float64


def hammer(mass=None):
    handle = turned(cylinder(0.015, 0.3, density=700.0), 90.0, (0.0, 1.0, 0.0))
    head = box((0.04, 0.12, 0.04), (-0.02, 0.0, 0.0), density=7800.0, color=(0.1, 0.2, 0.3))
    return from_parts("hammer", [moved(handle, (0.0, 0.0, 0.02)), head], mass=mass, friction=0.3)


def test_inertia_against_trimesh():
    """The scene of trimesh's own integrals, shifted by parallel axes."""
    obj = hammer()
    com, mass = np.zeros(3), 0.0
    for part in obj.parts:
        mass += part.density * part.mesh.volume
        com += part.density * part.mesh.volume * part.mesh.center_mass
    com /= mass
    tensor = np.zeros((3, 3))
    for part in obj.parts:
        mesh = part.mesh.copy()
        mesh.density = part.density
        away = mesh.center_mass - com
        tensor += mesh.moment_inertia
        tensor += mesh.mass * (away @ away * np.eye(3) - np.outer(away, away))
    np.testing.assert_allclose(obj.inertial.mass, mass, rtol=1e-12)
    np.testing.assert_allclose(obj.inertial.com, com, atol=1e-13)
    np.testing.assert_allclose(obj.inertial.inertia, tensor, rtol=1e-10, atol=1e-15)


def test_a_stated_mass_scales_all_densities():
    plain, stated = hammer(), hammer(mass=2.0)
    factor = 2.0 / float(plain.inertial.mass)
    np.testing.assert_allclose(stated.inertial.mass, 2.0, rtol=1e-14)
    np.testing.assert_allclose(stated.inertial.inertia, factor * plain.inertial.inertia, rtol=1e-13)
    np.testing.assert_allclose(stated.inertial.com, plain.inertial.com, atol=1e-15)
    for before, after in zip(plain.parts, stated.parts, strict=True):
        assert after.density == pytest.approx(factor * before.density)


def test_mesh_outline_height_and_colour():
    obj = hammer()
    assert obj.mesh.is_watertight
    assert obj.mesh.volume == pytest.approx(sum(part.mesh.volume for part in obj.parts), rel=1e-6)
    np.testing.assert_allclose(obj.outline.min(axis=0), [-0.04, -0.06], atol=1e-6)
    np.testing.assert_allclose(obj.outline.max(axis=0), [0.3, 0.06], atol=1e-6)
    assert obj.height == pytest.approx(0.04, abs=1e-6)
    assert obj.color == (0.6, 0.6, 0.6) and obj.friction == 0.3  # the handle is larger
    assert not obj.is_box and not obj.is_convex and obj.pieces_error < 1e-6


def test_what_it_stands_on():
    """Four feet: their patches alone bear it, and the friction radius is theirs."""
    feet = [
        box((0.02, 0.02, 0.05), (x, y, 0.0), density=1.0) for x in (-0.1, 0.1) for y in (-0.1, 0.1)
    ]
    stool = from_parts("stool", [box((0.3, 0.3, 0.02), (0.0, 0.0, 0.05), density=1.0), *feet])
    assert len(stool.support) == 4
    assert stool.stability == pytest.approx(0.11, abs=1e-6)
    assert friction_radius(stool.support, np.zeros(2)) == pytest.approx(0.1 * np.sqrt(2), rel=5e-3)
    pipe = from_parts("pipe", [tube(0.1, 0.09, 0.1, density=1.0)])
    assert len(pipe.support) == 2
    mean = 2 / 3 * (0.1**3 - 0.09**3) / (0.1**2 - 0.09**2)
    assert friction_radius(pipe.support, np.zeros(2)) == pytest.approx(mean, rel=2e-3)


def test_round_things_stand_on_a_small_patch_and_leaning_ones_topple():
    (ball,) = ellipsoid.build(0.05, 0.05, 0.05, density=500.0)
    resting = moved(ball, (0.0, 0.0, -float(ball.mesh.bounds[0, 2])))
    assert 0.001 < from_parts("ball", [resting]).stability < 0.006
    arm = [
        box((0.02, 0.02, 0.1), density=1.0),
        box((0.2, 0.02, 0.02), (0.09, 0.0, 0.1), density=1.0),
    ]
    assert from_parts("crane", arm).stability < -0.02


UNIT = box((1.0, 1.0, 1.0), density=1.0)
OPEN = Part(
    trimesh.creation.box((1.0, 1.0, 1.0)).slice_plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), 1.0
)


@pytest.mark.parametrize(
    ("parts", "options", "message"),
    [
        ([], {}, "no parts"),
        ([UNIT], {"mass": -1.0}, r"mass -1\.0 kg is not positive"),
        ([Part(UNIT.mesh, 0.0)], {}, "part 0: `density` must be positive"),
        ([moved(UNIT, (0.0, 0.0, 0.1))], {}, "not on the table"),
        ([UNIT, moved(UNIT, (0.5, 0.0, 0.0))], {}, "parts overlap by 5e"),
        ([OPEN], {}, "part 0"),
    ],
)
def test_errors(parts, options, message):
    with pytest.raises(ValueError, match=f"thing: .*{message}"):
        from_parts("thing", parts, **options)
