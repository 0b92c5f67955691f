"""The catalogue by name and category.

In: names, categories, changed parameters. Out: `ObjectModel`s, made on demand and cached.
"""

import functools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import get_args

from mjx_inertia.objects.catalogue import (
    animals,
    carpentry,
    electronics,
    fastening,
    household,
    primitives,
    pushing,
    site_tools,
    tableware,
    thesis,
    toys,
    vehicles,
)
from mjx_inertia.objects.catalogue.recipe import (
    Category,
    Recipe,
    Value,
    build,
    default_cache,
    nearest,
)
from mjx_inertia.objects.model import ObjectModel

# Modules of recipes, in the order of the catalogue within each category.
_MODULES = (
    primitives,
    carpentry,
    fastening,
    site_tools,
    tableware,
    household,
    electronics,
    toys,
    vehicles,
    animals,
    pushing,
    thesis,
)
CATEGORIES: tuple[str, ...] = get_args(Category)


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
