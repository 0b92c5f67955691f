"""The shipped table of real objects, and what is said of a table with a mistake in it."""

import numpy as np
import pytest

from mjx_inertia.objects import load_mcube_objects

STEEL = 7900.0  # kg/m³

GOOD = """
height: 0.02
objects:
  plate:
    mass: 1.5
    inertia_zz: 0.002
    outline: [[0, 0], [0.1, 0], [0.1, 0.05], [0, 0.05]]
  coin: {mass: 0.5, inertia_zz: 0.0003, ellipse: [0.05, 0.04], com: [0.001, 0], height: 0.01}
"""


def test_published_objects_are_steel_plates():
    objects = load_mcube_objects()
    assert len(objects) == 11
    for name, model in objects.items():
        assert model.name == name
        assert model.height == pytest.approx(0.013)
        mass = float(model.inertial.mass)
        assert mass == pytest.approx(STEEL * model.height * model.footprint.area, rel=0.02)
        # Published I_zz, CoM and outline belong together.
        uniform = mass * np.trace(model.footprint.second_moment) / model.footprint.area
        assert float(model.inertial.inertia[2, 2]) == pytest.approx(uniform, rel=0.02)
        np.testing.assert_allclose(model.inertial.com[:2], model.footprint.centroid, atol=2e-4)
    assert [name for name, model in objects.items() if model.is_box] == ["rect1", "rect2", "rect3"]
    assert [name for name, model in objects.items() if not model.is_convex] == ["butter"]


def test_a_table_of_ones_own(tmp_path):
    path = tmp_path / "objects.yaml"
    path.write_text(GOOD)
    objects = load_mcube_objects(path)
    plate, coin = objects["plate"], objects["coin"]
    np.testing.assert_allclose(plate.inertial.com, [0.05, 0.025, 0.01], atol=1e-7)
    assert float(plate.inertial.inertia[2, 2]) == pytest.approx(0.002)
    assert coin.height == pytest.approx(0.01)
    np.testing.assert_allclose(coin.inertial.com, [0.001, 0.0, 0.005], atol=1e-7)
    assert coin.footprint.area == pytest.approx(np.pi * 0.05 * 0.04, rel=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 1.5", "mass: heavy", r"'plate': key `mass`: expected a number, found 'heavy'"),
        ("mass: 1.5", "mass: -1", r"'plate': key `mass`: .*above 0"),
        ("mass: 1.5", "weight: 1.5", r"'plate': unknown key 'weight'"),
        ("    inertia_zz: 0.002\n", "", r"'plate': key `inertia_zz` is missing"),
        ("height: 0.02", "size: 1", r"'plate': key `height` is missing"),
        (
            "ellipse: [0.05, 0.04]",
            "ellipse: [0.05]",
            r"'coin': key `ellipse`: expected two numbers",
        ),
        ("ellipse: [0.05, 0.04], ", "", r"'coin': give either"),
        ("[0.1, 0.05]", "[0.1]", r"'plate': key `outline`: expected a list of"),
        ("[0.1, 0.05]", "[-0.1, 0.05]", r"plate: outline is not simple"),
        ("objects:", "things:", r"the key `objects`"),
        ("height: 0.02", "height: [", r"not a YAML file"),
    ],
)
def test_mistakes_are_named(tmp_path, old, new, message):
    path = tmp_path / "objects.yaml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(ValueError, match=message) as error:
        load_mcube_objects(path)
    assert str(path) in str(error.value)


def test_aliases_of_aliases_nesting_and_long_numbers_are_refused(tmp_path):
    path = tmp_path / "objects.yaml"
    lines = ["a0: &a0 [1, 1]", *(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 60))]
    path.write_text("\n".join([*lines, "objects: {box: {mass: *a59}}"]))
    with pytest.raises(ValueError, match="aliases"):
        load_mcube_objects(path)
    path.write_text("objects: " + "[" * 3000)
    with pytest.raises(ValueError, match="not a YAML file"):
        load_mcube_objects(path)
    path.write_text("objects: {box: {ellipse: [1, 1], mass: 1" + "0" * 400 + "}}")
    with pytest.raises(ValueError, match="key `mass`: expected a number"):
        load_mcube_objects(path)
    path.write_bytes(b"objects: \xff\xfe")
    with pytest.raises(ValueError, match="not a text file"):
        load_mcube_objects(path)
