"""Objects on disk, and the key of a finished object in the user's cache.

In: an `ObjectModel`, a path. Out: an `.npz` file of arrays and text (no code) that holds it in
double precision, and the object read back. The key covers recipe, parameters, code and versions.
"""

import functools
import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import trimesh
from numpy import ndarray

from mjx_inertia.files import OtherFormat, read_arrays, write_arrays
from mjx_inertia.objects.model import ObjectModel, Part
from mjx_inertia.spatial import InertialParameters

_FORMAT = "mjx_inertia object 1"
_PACKAGES = ("numpy", "scipy", "shapely", "trimesh", "manifold3d")
_CODE = ("objects", "spatial")  # rooms of this library that objects are made in


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
