"""One object of the catalogue: how it is made, where its figures come from, and its cache.

In: a builder of parts, changed parameters. Out: an `ObjectModel` at rest. Finished objects are kept
in the user's cache under their recipe, parameters and the code that made them.
"""

import contextlib
import dataclasses
import functools
import hashlib
import inspect
import json
import os
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from importlib import metadata
from pathlib import Path
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.model_file import load_model, save_model
from mjx_inertia.objects.part import Part
from mjx_inertia.objects.part_assembly import from_parts
from mjx_inertia.spatial import InertialParameters

Category = Literal["Primitives", "Tools", "Home", "Toys", "Pushing"]
Builder = Callable[..., tuple[Part, ...]]
Value = float | int | str | tuple[float, ...]

WORKSHOP_TOOLS = "Workshop Tools Dataset (Nadeau, Giamou, Kelly 2023, arXiv 2302.06685)"
_EVERYWHERE = ("mass", "friction")  # parameters that every object has
_MAY_BE_ZERO = ("friction", "fill")
_PACKAGES = ("numpy", "scipy", "shapely", "trimesh", "manifold3d")
_CODE = ("objects", "spatial")  # rooms of this library that objects are made in


@dataclasses.dataclass(frozen=True)
class Recipe:
    """One object of the catalogue."""

    name: str  # lower case, words joined by underscores
    category: Category  # one of the five
    # keyword parameters, all with defaults (sizes, wall thicknesses, m; densities, kg/m³), to parts
    # that touch but do not overlap, standing on z = 0 in their resting pose
    build: Builder
    # kg of the real thing; the parts' densities are scaled by one factor to meet it. None where the
    # parts' own densities and sizes give it.
    mass: float | None
    source: str  # where the mass and the sizes come from
    friction: float = 0.4  # on a wooden or plastic table, Coulomb's coefficient


def catalogue_object(
    category: Category, source: str, *, mass: float | None = None, friction: float = 0.4
) -> Callable[[Builder], Recipe]:
    """Turns a builder into the recipe that has its name; arguments as in `Recipe`."""
    return lambda build: Recipe(build.__name__, category, build, mass, source, friction)


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
    path = cache / f"{recipe.name}-{_key(recipe, chosen)}.npz"
    try:
        return load_model(path)
    except (FileNotFoundError, ValueError):  # not there yet, or damaged: made anew
        made = _attempted(recipe, chosen)
    with contextlib.suppress(OSError):  # a cache that cannot be written costs time alone
        save_model(path, made)
    return _in_use(made)


def default_cache() -> Path:
    """Folder of finished objects in the user's cache."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "mjx_inertia" / "objects"


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
        parts = _parts(recipe, sizes)
        mass = chosen.get("mass", recipe.mass)
        if "mass" not in chosen and recipe.mass is not None and sizes:
            mass = recipe.mass * _weight(parts) / _weight(_parts(recipe, {}))
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


def _parts(recipe: Recipe, sizes: Mapping[str, Value]) -> tuple[Part, ...]:
    build_parts: Callable[..., tuple[Part, ...]] = recipe.build
    return build_parts(**sizes)


def _weight(parts: tuple[Part, ...]) -> float:
    return sum(part.density * part.mesh.volume for part in parts)


def _in_use(model: ObjectModel) -> ObjectModel:
    """The same with inertial parameters in the precision that JAX works in."""
    exact = jax.tree.map(np.asarray, model.inertial)
    inertial = InertialParameters(*map(jnp.asarray, (exact.mass, exact.com, exact.inertia)))
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


def _key(recipe: Recipe, chosen: Mapping[str, Value]) -> str:
    """Of all that decides how an object comes out."""
    what = [recipe.name, sorted(chosen.items()), _code(), _versions()]
    return hashlib.sha256(json.dumps(what, default=float).encode()).hexdigest()[:16]


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
