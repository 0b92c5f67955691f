"""The catalogue by name and category, and how one object is made of its recipe.

In: names, categories, changed parameters. Out: `ObjectModel`s at rest, made on demand and kept in
the user's cache: `.npz` files of arrays and text (no code) in double precision, whose key covers
recipe, parameters, code and versions.
"""

import contextlib
import dataclasses
import functools
import hashlib
import inspect
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from importlib import metadata
from pathlib import Path
from typing import get_args

import jax
import jax.numpy as jnp
import numpy as np
import trimesh
from numpy import ndarray

from mjx_inertia.files import OtherFormat, read_arrays, write_arrays
from mjx_inertia.objects.catalogue import (
    carpentry,
    fastening,
    household,
    primitives,
    pushing,
    tableware,
    thesis,
    toys,
    vehicles,
)
from mjx_inertia.objects.catalogue.recipe import Category, Recipe
from mjx_inertia.objects.composition import from_parts
from mjx_inertia.objects.model import ObjectModel, Part
from mjx_inertia.spatial import InertialParameters

# Modules of recipes, in the order of the catalogue within each category.
_MODULES = [primitives, carpentry, fastening, tableware, household, toys, vehicles, pushing, thesis]
CATEGORIES: tuple[str, ...] = get_args(Category)
Value = float | int | str | tuple[float, ...]
_EVERYWHERE = ("mass", "friction")  # parameters that every object has
_MAY_BE_ZERO = ("friction", "fill")
_FORMAT = "mjx_inertia object 1"
_PACKAGES = ("numpy", "scipy", "shapely", "trimesh", "manifold3d")
_CODE = ("objects", "spatial")  # rooms of this library that objects are made in


@functools.cache
def recipes() -> dict[str, Recipe]:
    """All recipes by name, category by category.

    Raises:
      ValueError: two recipes share a name.
    """
    every = [one for m in _MODULES for one in vars(m).values() if isinstance(one, Recipe)]
    known: dict[str, Recipe] = {}
    for recipe in sorted(every, key=lambda recipe: CATEGORIES.index(recipe.category)):
        if recipe.name in known:
            raise ValueError(f"{recipe.name}: two recipes have this name")
        known[recipe.name] = recipe
    return known


def load_catalogue(
    names: Iterable[str] | str | None = None,
    *,
    category: Iterable[str] | str | None = None,
    parameters: Mapping[str, Mapping[str, Value]] | None = None,
    cache: Path | str | bool = True,
) -> dict[str, ObjectModel]:
    """Objects of the catalogue.

    Args:
      names: of the objects; all if None.
      category: one or several of Primitives, Tools, Home, Toys and Pushing, to which the objects
        must belong; all if None.
      parameters: by the name of an object that is loaded, those that differ from its own, e.g.
        `{"mug": {"wall": 0.005, "mass": 0.4}}`: sizes in m, densities in kg/m³, `mass` in kg,
        `friction`. Sizes that change without the mass keep the density.
      cache: whether finished objects are kept in the user's cache, or the folder to keep them in.

    Returns:
      Objects by name, in the order of the catalogue.

    Raises:
      ValueError: an unknown name, category or parameter (with what is near), a name outside the
        categories, parameters of an object that is not loaded, or a value that no object can have.
    """
    known = recipes()
    wanted = list(known) if names is None else [names] if isinstance(names, str) else list(names)
    for name in [*wanted, *(parameters or {})]:
        if name not in known:
            raise ValueError(nearest("object", name, list(known)))
    within = [category] if isinstance(category, str) else list(category or CATEGORIES)
    for one in within:
        if one not in CATEGORIES:
            raise ValueError(f"unknown category {one!r}; choose from {list(CATEGORIES)}")
    outside = [name for name in wanted if known[name].category not in within]
    if names is not None and outside:
        raise ValueError(f"names: none of {outside} is in the category {within}")
    chosen = [name for name in known if name in wanted and name not in outside]
    idle = [name for name in parameters or {} if name not in chosen]
    if idle:
        raise ValueError(f"parameters: {idle} are not among the objects asked for")
    folder = {True: default_cache(), False: None}[cache] if isinstance(cache, bool) else Path(cache)
    return {name: build(known[name], (parameters or {}).get(name), cache=folder) for name in chosen}


def build(
    recipe: Recipe, parameters: Mapping[str, Value] | None = None, *, cache: Path | None = None
) -> ObjectModel:
    """The object of a recipe.

    Args:
      recipe: what to make.
      parameters: those that differ from the recipe's own. `mass` (kg) and `friction` every object
        has; where the mass is not among them, changed sizes keep the density and a changed density
        the sizes.
      cache: folder that keeps finished objects; none if None.

    Raises:
      ValueError: a parameter that the recipe does not have, or of a value that no object can have
        (all but `_MAY_BE_ZERO` are positive); sizes that fit no object together; a recipe whose
        object would topple.
    """
    if parameters is not None and not isinstance(parameters, Mapping):
        raise ValueError(f"{recipe.name}: parameters {parameters!r}; give values by name")
    chosen = dict(parameters or {})
    _check_values(recipe, chosen)
    if cache is None:
        return _in_use(_attempted(recipe, chosen))
    path = cache / f"{recipe.name}-{cache_key(recipe.name, chosen)}.npz"
    try:
        return load_model(path)
    except (FileNotFoundError, ValueError):  # not there yet, or damaged: made anew
        made = _attempted(recipe, chosen)
    with contextlib.suppress(OSError):  # a cache that cannot be written costs time alone
        save_model(path, made)
    return _in_use(made)


def describe(recipe: Recipe) -> dict[str, Value]:
    """Parameters of a recipe with their own values."""
    return {name: p.default for name, p in inspect.signature(recipe.build).parameters.items()}


def nearest(kind: str, name: str, known: list[str]) -> str:
    """The message for a name that is not known."""
    close = get_close_matches(name, known, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(map(repr, close))}?" if close else f"known: {known}"
    return f"unknown {kind} {name!r}; {hint}"


def _attempted(recipe: Recipe, chosen: Mapping[str, Value]) -> ObjectModel:
    """`_made`, whose failures name the object and what was asked for."""
    try:
        return _made(recipe, chosen)
    except Exception as error:  # sizes that do not go together upset any of five libraries
        if not chosen or str(error).startswith(f"{recipe.name}: "):
            raise
        raise ValueError(
            f"{recipe.name}: no such object with parameters {dict(chosen)}: {error}"
        ) from error


def _made(recipe: Recipe, chosen: Mapping[str, Value]) -> ObjectModel:
    """In double precision."""
    sizes = {name: value for name, value in chosen.items() if name not in _EVERYWHERE}
    with jax.enable_x64(True):
        parts = recipe.build(**sizes)
        mass = chosen.get("mass", recipe.mass)
        if "mass" not in chosen and recipe.mass is not None and sizes:
            mass = recipe.mass * _weight(parts) / _weight(recipe.build())
        model = from_parts(
            recipe.name,
            parts,
            mass=None if mass is None else float(mass),  # pyright: ignore[reportArgumentType]
            category=recipe.category,
            friction=float(chosen.get("friction", recipe.friction)),  # pyright: ignore
            source=recipe.source,
        )
    if not model.stability > 0.0:
        com = np.asarray(model.inertial.com)
        raise ValueError(
            f"{recipe.name}: topples, its CoM at x, y = {com[0]:.4g}, {com[1]:.4g} m is "
            f"{-model.stability:.2g} m outside what it stands on; change its sizes"
        )
    return model


def _weight(parts: tuple[Part, ...]) -> float:
    return sum(part.density * part.mesh.volume for part in parts)


def _in_use(model: ObjectModel) -> ObjectModel:
    """The same with inertial parameters in the precision that JAX works in."""
    inertial = jax.tree.map(lambda x: jnp.asarray(np.asarray(x)), model.inertial)
    return dataclasses.replace(model, inertial=inertial)


def _check_values(recipe: Recipe, chosen: Mapping[str, Value]) -> None:
    known = {**describe(recipe), **dict.fromkeys(_EVERYWHERE, 1.0)}
    for name, value in chosen.items():
        if name not in known:
            raise ValueError(f"{recipe.name}: {nearest('parameter', name, list(known))}")
        wanted, numbers = np.asarray(known[name]), _numbers(value)
        where = f"{recipe.name}: parameter {name}={value!r} is"
        if numbers is None or numbers.shape != wanted.shape:
            what = "one number" if wanted.shape == () else f"{wanted.size} numbers"
            raise ValueError(f"{where} not {what}")
        if wanted.dtype.kind == "i" and numbers.dtype.kind not in "iu":
            raise ValueError(f"{where} no whole number")
        if not np.all(np.isfinite(numbers)):
            raise ValueError(f"{where} not finite")
        if np.any(numbers < 0.0):
            raise ValueError(f"{where} negative")
        if wanted.shape == () and numbers == 0.0 and name not in _MAY_BE_ZERO:
            raise ValueError(f"{where} not positive")


def _numbers(value: object) -> np.ndarray | None:
    """As an array; None where the value is something else."""
    try:
        numbers = np.asarray(value)
    except ValueError:  # rows of different lengths
        return None
    return numbers if numbers.dtype.kind in "iuf" else None


def default_cache() -> Path:
    """Folder of finished objects in the user's cache."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "mjx_inertia" / "objects"


def cache_key(name: str, parameters: Mapping[str, object]) -> str:
    """Key of everything that determines an object: parameters, our code, versions of packages."""
    what = [name, sorted(parameters.items()), _code(), _versions()]
    return hashlib.sha256(json.dumps(what, default=float).encode()).hexdigest()[:16]


def save_model(path: Path, model: ObjectModel) -> None:
    """Writes `model` in one step: a reader never meets half a file.

    Raises:
      OSError: the file cannot be written.
    """
    meshes = [model.mesh, *(part.mesh for part in model.parts)]
    text = {
        "format": _FORMAT,
        "name": model.name,
        "category": model.category,
        "source": model.source,
    }
    arrays = {
        "text": np.array(json.dumps(text)),
        "scalars": np.array([model.height, model.friction, *model.color]),
        "mass": np.asarray(model.inertial.mass),
        "com": np.asarray(model.inertial.com),
        "inertia": np.asarray(model.inertial.inertia),
        "outline": model.outline,
        "materials": np.array([[p.density, *p.color] for p in model.parts]).reshape(-1, 4),
        **_joined("pieces", model.pieces),
        **_joined("support", model.support),
        **_joined("vertices", [np.asarray(mesh.vertices) for mesh in meshes]),
        **_joined("faces", [np.asarray(mesh.faces, np.int32) for mesh in meshes]),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, arrays)


def load_model(path: Path) -> ObjectModel:
    """Reads what `save_model` wrote; inertial parameters in the precision that JAX works in.

    Raises:
      FileNotFoundError: there is no such file.
      ValueError: the file is damaged or something else.
    """
    with read_arrays(path, f"an object ({_FORMAT})") as arrays:
        text = json.loads(str(arrays["text"]))
        if text["format"] != _FORMAT:
            raise OtherFormat(f"format {text['format']!r}")
        return _model(text, arrays)


def _model(text: dict[str, str], arrays: dict[str, ndarray]) -> ObjectModel:
    vertices, faces = _split("vertices", arrays), _split("faces", arrays)
    meshes = [trimesh.Trimesh(v, f, process=False) for v, f in zip(vertices, faces, strict=True)]
    height, friction, red, green, blue = map(float, arrays["scalars"])
    return ObjectModel(
        name=text["name"],
        outline=arrays["outline"],
        height=height,
        inertial=InertialParameters(
            mass=jnp.asarray(arrays["mass"]),
            com=jnp.asarray(arrays["com"]),
            inertia=jnp.asarray(arrays["inertia"]),
        ),
        pieces=tuple(_split("pieces", arrays)),
        support=tuple(_split("support", arrays)),
        mesh=meshes[0],
        parts=tuple(
            Part(mesh, float(density), (float(r), float(g), float(b)))
            for mesh, (density, r, g, b) in zip(meshes[1:], arrays["materials"], strict=True)
        ),
        category=text["category"],
        friction=friction,
        color=(red, green, blue),
        source=text["source"],
    )


def _joined(name: str, rows: Sequence[ndarray]) -> dict[str, ndarray]:
    """Arrays of different lengths as one, and where each ends."""
    return {name: np.concatenate(rows), f"{name}_ends": np.cumsum([len(row) for row in rows])}


def _split(name: str, arrays: dict[str, ndarray]) -> list[ndarray]:
    return np.split(arrays[name], arrays[f"{name}_ends"][:-1])


@functools.cache
def _code() -> str:
    """SHA-256 of all code that objects are made with."""
    library = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for path in sorted(path for room in _CODE for path in (library / room).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@functools.cache
def _versions() -> list[str]:
    return [metadata.version(package) for package in _PACKAGES]
