"""Primitives against closed forms, and the objects that the thesis names against its figures."""

import numpy as np
import pytest

from mjx_inertia.objects import load_catalogue
from mjx_inertia.objects.catalogue.load import recipes
from mjx_inertia.objects.catalogue.thesis import TABLE_3_2

pytestmark = pytest.mark.float64


def solid(name, **parameters):
    """Inertial parameters; `mass` as a float."""
    obj = load_catalogue(name, parameters={name: parameters})[name]
    return float(obj.inertial.mass), np.asarray(obj.inertial.com), np.asarray(obj.inertial.inertia)


PI = np.pi
# name: parameters, volume, height of the centroid, moments of unit mass about x, y, z
CLOSED_FORMS = {
    "sphere": ({"radius": 0.05}, 4 / 3 * PI * 0.05**3, 0.05, [0.4 * 0.05**2] * 3),
    "cube": ({"edge": 0.1}, 1e-3, 0.05, [0.01 / 6] * 3),
    "cuboid": (
        {"x": 0.3, "y": 0.2, "z": 0.1},
        6e-3,
        0.05,
        [0.05 / 12, 0.10 / 12, 0.13 / 12],
    ),
    "cylinder": (
        {"radius": 0.04, "height": 0.12},
        PI * 0.04**2 * 0.12,
        0.06,
        [(3 * 0.04**2 + 0.12**2) / 12] * 2 + [0.04**2 / 2],
    ),
    "cone": (
        {"radius": 0.05, "height": 0.12},
        PI * 0.05**2 * 0.12 / 3,
        0.03,
        [3 / 20 * 0.05**2 + 3 / 80 * 0.12**2] * 2 + [0.3 * 0.05**2],
    ),
    "ellipsoid": (
        {"semi_x": 0.08, "semi_y": 0.055, "semi_z": 0.04},
        4 / 3 * PI * 0.08 * 0.055 * 0.04,
        0.04,
        [0.2 * (0.055**2 + 0.04**2), 0.2 * (0.08**2 + 0.04**2), 0.2 * (0.08**2 + 0.055**2)],
    ),
    "elliptic_prism": (
        {"semi_x": 0.15, "semi_y": 0.1, "height": 0.03},
        PI * 0.15 * 0.1 * 0.03,
        0.015,
        [0.1**2 / 4 + 0.03**2 / 12, 0.15**2 / 4 + 0.03**2 / 12, (0.15**2 + 0.1**2) / 4],
    ),
    "hexagonal_prism": (
        {"side": 0.1, "height": 0.06},
        1.5 * np.sqrt(3) * 0.01 * 0.06,
        0.03,
        [5 / 24 * 0.01 + 0.06**2 / 12] * 2 + [5 / 12 * 0.01],
    ),
    "triangular_prism": (
        {"side": 0.2, "height": 0.06},
        np.sqrt(3) / 4 * 0.04 * 0.06,
        0.03,
        [0.04 / 24 + 0.06**2 / 12] * 2 + [0.04 / 12],
    ),
    "wedge": (
        {"length": 0.15, "width": 0.08, "height": 0.06},
        0.15 * 0.08 * 0.06 / 2,
        0.02,
        [
            0.08**2 / 12 + 0.06**2 / 18,
            (0.15**2 + 0.06**2) / 18,
            0.08**2 / 12 + 0.15**2 / 18,
        ],
    ),
    "torus": (
        {"ring_radius": 0.06, "bar_radius": 0.02},
        2 * PI**2 * 0.06 * 0.02**2,
        0.02,
        [0.06**2 / 2 + 5 / 8 * 0.02**2] * 2 + [0.06**2 + 3 / 4 * 0.02**2],
    ),
    "tube": (
        {"outer": 0.05, "wall": 0.01, "height": 0.12},
        PI * (0.05**2 - 0.04**2) * 0.12,
        0.06,
        [(3 * (0.05**2 + 0.04**2) + 0.12**2) / 12] * 2 + [(0.05**2 + 0.04**2) / 2],
    ),
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_forms(name):
    """Facets enclose the true volume; moments are met to 0.2 %."""
    parameters, volume, height, moments = CLOSED_FORMS[name]
    obj = load_catalogue(name, parameters={name: {**parameters, "mass": 1.0}})[name]
    assert obj.mesh.volume == pytest.approx(volume, rel=1e-6)
    assert float(obj.inertial.mass) == pytest.approx(1.0)
    np.testing.assert_allclose(obj.inertial.com[2], height, rtol=4e-3)
    np.testing.assert_allclose(np.diag(obj.inertial.inertia), moments, rtol=2e-3)


def test_capsule():
    """A cylinder and two half balls, each half 3/8 r beyond the cylinder's end."""
    r, length = 0.03, 0.1
    _, com, tensor = solid("capsule", radius=r, length=length, mass=1.0)
    tube, ball = PI * r**2 * length, 4 / 3 * PI * r**3
    tube, ball = tube / (tube + ball), ball / (tube + ball)
    along = tube * r**2 / 2 + ball * 0.4 * r**2
    across = tube * (3 * r**2 + length**2) / 12
    across += ball * (83 / 320 * r**2 + (length / 2 + 3 / 8 * r) ** 2)
    np.testing.assert_allclose(np.diag(tensor), [along, across, across], rtol=2e-3)
    np.testing.assert_allclose(com, [0.0, 0.0, r], atol=1e-4)


@pytest.mark.parametrize("name", TABLE_3_2)
def test_table_3_2(name):
    """Thesis Table 3.2: mass and I_zz within 1 %, at densities that materials have."""
    mass, inertia_zz = TABLE_3_2[name]
    obj = load_catalogue(name)[name]
    assert float(obj.inertial.mass) == pytest.approx(mass, rel=1e-6)
    assert float(obj.inertial.inertia[2, 2]) == pytest.approx(inertia_zz, rel=0.01)
    made = {part.density for part in obj.parts}
    designed = {part.density for part in recipes()[name].build()}
    for density, own in zip(sorted(made), sorted(designed), strict=True):
        assert density == pytest.approx(own, rel=0.05)


@pytest.mark.parametrize(
    ("name", "mass", "size"),
    [
        ("cuboid", 0.4, (0.5, 0.15, 0.2)),
        ("book", 0.34, (0.15, 0.22, 0.015)),
        ("disk_with_weights", 0.3, (0.3, 0.3, 0.28)),
        ("tensor_object", 0.43, None),
    ],
)
def test_objects_of_the_grasping_chapters(name, mass, size):
    obj = load_catalogue(name)[name]
    assert float(obj.inertial.mass) == pytest.approx(mass, rel=1e-9)
    if size:
        np.testing.assert_allclose(2 * obj.half_extents, size, rtol=2e-3)


def test_weights_of_the_disk_lie_along_x():
    """So it is easiest to turn around x."""
    _, com, inertia = solid("disk_with_weights")
    np.testing.assert_allclose(com[:2], 0.0, atol=1e-9)
    assert inertia[0, 0] < inertia[1, 1]


def test_rings_of_the_tensor_object_shift_inertia_not_mass():
    """Opposite rings that move out together keep the CoM and raise the moments across them."""
    mass, com, inertia = solid("tensor_object")
    moved_mass, moved_com, moved = solid("tensor_object", x_plus=0.14, x_minus=0.14)
    assert moved_mass == pytest.approx(mass)
    np.testing.assert_allclose(moved_com, com, atol=1e-9)
    ring = (load_catalogue("tensor_object")["tensor_object"].parts)[2]
    gained = 2 * ring.density * ring.mesh.volume * (0.14**2 - 0.08**2)
    np.testing.assert_allclose(np.diag(moved - inertia), [0.0, gained, gained], atol=1e-9)
    with pytest.raises(ValueError, match=r"y_plus: 0\.3 m is off the arm"):
        solid("tensor_object", y_plus=0.3)
