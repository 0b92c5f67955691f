"""The catalogue by name: parameters, the cache, and errors that say what to do."""

import jax
import jaxtyping
import numpy as np
import pytest
import trimesh

from mjx_inertia.objects import load_catalogue
from mjx_inertia.objects.catalogue import load as load_module
from mjx_inertia.objects.catalogue.load import build, load_model, recipes, save_model
from mjx_inertia.objects.catalogue.recipe import Recipe
from mjx_inertia.objects.model import Part, moved


def mass_of(name, **parameters):
    loaded = load_catalogue(name, parameters={name: parameters}, cache=False)
    return float(loaded[name].inertial.mass)


def test_names_and_categories():
    assert list(load_catalogue(["rock", "cube"])) == ["cube", "rock"]  # the catalogue's order
    pushing = load_catalogue(["rock"], category="Pushing")
    assert list(pushing) == ["rock"] and pushing["rock"].category == "Pushing"


def test_parameters():
    """Sizes keep the density, of a recipe with a stated mass too; a mass is a mass."""
    assert mass_of("cube", edge=0.2) == pytest.approx(8 * mass_of("cube"))
    assert mass_of("hexagonal_prism", height=0.11) == pytest.approx(2.0)
    assert mass_of("hexagonal_prism", density=350.0) == pytest.approx(0.5)
    assert mass_of("rock", mass=1.5, x=0.3) == pytest.approx(1.5)
    slippery = load_catalogue("cube", parameters={"cube": {"friction": 0.1}}, cache=False)
    assert slippery["cube"].friction == 0.1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"names": "hexagonal_prsm"}, "unknown object 'hexagonal_prsm'; did you mean 'hexagonal_p"),
        ({"names": "zzzz"}, "unknown object 'zzzz'; known: "),
        ({"category": "Toy"}, "unknown category 'Toy'; choose from"),
        ({"names": "cube", "parameters": {"cube": {"edges": 1.0}}}, "cube: .* did you mean 'edge'"),
        ({"names": "cube", "parameters": {"cub": {}}}, "unknown object 'cub'"),
        ({"names": "cube", "parameters": {"cube": {"edge": np.nan}}}, "edge=nan is not finite"),
        ({"names": "cube", "parameters": {"cube": {"mass": 0.0}}}, "mass=0.0 is not positive"),
        ({"names": "cube", "parameters": {"cube": {"density": -1.0}}}, "density=-1.0 is negative"),
        (
            {"names": "mug", "parameters": {"mug": {"wall": -1}}},
            "mug: parameter wall=-1 is negativ",
        ),
        (
            {"names": "mug", "parameters": {"mug": {"wall": 0}}},
            "mug: parameter wall=0 is not posit",
        ),
        ({"names": "mug", "parameters": {"mug": {"wall": "thick"}}}, "wall='thick' is not one num"),
        ({"names": "mug", "parameters": {"mug": {"wall": None}}}, "wall=None is not one number"),
        ({"names": "mug", "parameters": {"mug": 5}}, "mug: parameters 5; give values by name"),
        ({"names": "building_brick", "parameters": {"building_brick": {"rows": 1.5}}}, "no whole"),
        ({"names": ["mug", "hammer"], "category": "Tools"}, r"none of \['mug'\] is in the categ"),
        ({"names": "mug", "parameters": {"cube": {"edge": 0.2}}}, r"\['cube'\] are not among th"),
    ],
)
def test_errors(arguments, message):
    jaxtyping.config.update("jaxtyping_disable", True)
    try:
        with pytest.raises(ValueError, match=message):
            load_catalogue(**arguments, cache=False)
    finally:
        jaxtyping.config.update("jaxtyping_disable", False)


def test_a_failure_names_the_object_and_its_parameters():
    def ring(width: float = 0.5):
        return (Part(trimesh.creation.box((0.1, 0.1, 0.1 / (1.0 - width))), 1.0),)

    with pytest.raises(
        ValueError, match=r"ring: no such object with parameters {'width': 1\.0}: fl"
    ):
        build(Recipe("ring", "Toys", ring, None, "made up"), {"width": 1.0})


def test_an_object_that_topples_is_refused():
    def crane():
        arm = Part(trimesh.creation.box((0.2, 0.02, 0.02)), 1.0)
        pole = Part(trimesh.creation.box((0.02, 0.02, 0.1)), 1.0)
        return moved(pole, (0.0, 0.0, 0.05)), moved(arm, (0.09, 0.0, 0.11))

    with pytest.raises(ValueError, match="crane: topples, its CoM at x, y = "):
        build(Recipe("crane", "Toys", crane, None, "made up"))


def assert_same(a, b):
    for field in ("name", "category", "friction", "color", "source", "height"):
        assert getattr(a, field) == getattr(b, field)
    for x, y in zip(jax.tree.leaves(a.inertial), jax.tree.leaves(b.inertial), strict=True):
        np.testing.assert_array_equal(x, y)
    np.testing.assert_array_equal(a.outline, b.outline)
    for field in ("pieces", "support"):
        for x, y in zip(getattr(a, field), getattr(b, field), strict=True):
            np.testing.assert_array_equal(x, y)
    pairs = [(a.mesh, b.mesh), *((p.mesh, q.mesh) for p, q in zip(a.parts, b.parts, strict=True))]
    for x, y in pairs:
        np.testing.assert_array_equal(x.vertices, y.vertices)
        np.testing.assert_array_equal(x.faces, y.faces)
    assert [(p.density, p.color) for p in a.parts] == [(p.density, p.color) for p in b.parts]


@pytest.mark.parametrize("float64", [False, True])
def test_the_cache_gives_back_what_was_made(tmp_path, monkeypatch, float64):
    with jax.enable_x64(float64):
        made = load_catalogue("saucepan", cache=tmp_path)["saucepan"]
        (file,) = tmp_path.glob("saucepan-*.npz")

        def fail(*_):
            raise AssertionError("made anew")

        monkeypatch.setattr(load_module, "_made", fail)
        kept = load_catalogue("saucepan", cache=tmp_path)["saucepan"]
        assert_same(made, kept)
        assert kept.inertial.mass.dtype == (np.float64 if float64 else np.float32)
        with pytest.raises(ValueError, match="made anew"):  # other parameters, another file
            load_catalogue("saucepan", parameters={"saucepan": {"wall": 0.004}}, cache=tmp_path)
        file.write_bytes(b"damaged")
        with pytest.raises(AssertionError, match="made anew"):
            load_catalogue("saucepan", cache=tmp_path)


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert list(load_catalogue("cube", cache=blocked / "below")) == ["cube"]


def test_a_file_that_is_no_object(tmp_path):
    path = tmp_path / "object.npz"
    with pytest.raises(FileNotFoundError):
        load_model(path)
    np.savez(path, text="{}")
    with pytest.raises(ValueError, match=f"{path}: expected an object"):
        load_model(path)
    save_model(path, load_catalogue("cube")["cube"])
    assert load_model(path).name == "cube"


def test_recipes_are_documented():
    for recipe in recipes().values():
        assert recipe.build.__doc__, recipe.name


def test_the_cache_knows_the_code_that_an_object_runs_on(tmp_path, monkeypatch):
    load_catalogue("cube", cache=tmp_path)
    monkeypatch.setattr(load_module, "_code", lambda: "changed")
    load_catalogue("cube", cache=tmp_path)
    assert len(list(tmp_path.iterdir())) == 2
