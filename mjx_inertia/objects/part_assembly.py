"""Parts of known material become one rigid object at rest on a table.

In: `Part`s that touch but do not overlap, in their resting pose. Out: an `ObjectModel` with exact
inertial parameters: those of every part, by integrals over its mesh, combined.
"""

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
import trimesh
from numpy import ndarray

from mjx_inertia.objects.decomposition import object_pieces
from mjx_inertia.objects.manifolds import from_manifold, lowest, silhouette, union
from mjx_inertia.objects.mesh_integrals import is_positive, mass_properties
from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.part import Color, Part
from mjx_inertia.spatial import InertialParameters, combine

# What lies within this of the table bears the object: elastic bodies sink in, and so a ball has a
# patch and a lying cylinder a strip. It is beyond the facets of round surfaces (0.05 mm at a radius
# of 40 mm) and well below what stands free.
SUPPORT_DEPTH = 2e-4  # m
_OVERLAP = 1e-4  # of the volume: what parts may share before their mass is counted twice
_OFF_TABLE = 1e-6  # m
_ROWS = 16

_combine = jax.jit(combine)


def from_parts(
    name: str,
    parts: Sequence[Part],
    *,
    mass: float | None = None,
    category: str = "",
    friction: float = 0.4,
    source: str = "",
) -> ObjectModel:
    """The object that `parts` make up.

    Args:
      name: for messages and tables.
      parts: watertight, touching but not overlapping, with the lowest point on z = 0.
      mass: kg; densities are scaled by one factor to meet it, and are taken as they are if None.
      category: of the catalogue.
      friction: Coulomb's coefficient on a wooden or plastic table.
      source: where the figures come from.

    Raises:
      ValueError: which part is no solid or has no density, parts that overlap or lie apart as seen
        from above, an object that does not stand on z = 0, or a mass that is not positive.
    """
    if not parts:
        raise ValueError(f"{name}: no parts")
    if mass is not None and not is_positive(mass):
        raise ValueError(f"{name}: mass {mass!r} kg is not positive")
    bodies = [_part_inertial(name, i, part) for i, part in enumerate(parts)]
    factor = 1.0 if mass is None else mass / sum(float(body.mass) for body in bodies)
    whole = union(part.mesh for part in parts)
    _check_apart(name, parts, whole.volume())
    low, high = whole.bounding_box()[2], whole.bounding_box()[5]
    if abs(low) > _OFF_TABLE:
        raise ValueError(
            f"{name}: its lowest point is at z = {low:.3g} m, not on the table; move its parts"
        )
    return ObjectModel(
        name=name,
        outline=silhouette(whole, name),
        height=high,
        inertial=combine_bodies(bodies, factor),
        pieces=object_pieces(parts, whole),
        support=lowest(whole, SUPPORT_DEPTH),
        mesh=from_manifold(whole),
        parts=tuple(_as_made(part, factor) for part in parts),
        category=category,
        friction=friction,
        color=main_color(parts),
        source=source,
    )


def main_color(parts: Sequence[Part]) -> Color:
    """Colour of the largest part."""
    return max(parts, key=lambda part: part.mesh.volume).color


def combine_bodies(bodies: Sequence[InertialParameters], factor: float = 1.0) -> InertialParameters:
    """Bodies in one frame as one body, its mass and tensor times `factor`.

    Computed in double precision; the result is in the precision that JAX works in.
    """
    rows = -len(bodies) % _ROWS  # bodies of no mass, so that few numbers of bodies are compiled

    def stacked(*leaves: ndarray) -> ndarray:
        return np.concatenate([np.stack(leaves), np.zeros((rows, *leaves[0].shape))])

    with jax.enable_x64(True):
        total = jax.tree.map(np.asarray, _combine(jax.tree.map(stacked, *bodies)))
    return InertialParameters(
        mass=jnp.asarray(total.mass * factor),
        com=jnp.asarray(total.com),
        inertia=jnp.asarray(total.inertia * factor),
    )


def _part_inertial(name: str, index: int, part: Part) -> InertialParameters:
    """In double precision, as NumPy arrays."""
    try:
        with jax.enable_x64(True):
            body = mass_properties(part.mesh.vertices, part.mesh.faces, part.density)
            return jax.tree.map(np.asarray, body)
    except ValueError as error:
        raise ValueError(f"{name}: part {index}: {error}") from None


def _check_apart(name: str, parts: Sequence[Part], volume: float) -> None:
    shared = sum(part.mesh.volume for part in parts) - volume
    if shared > _OVERLAP * volume:
        raise ValueError(
            f"{name}: parts overlap by {1e6 * shared:.3g} cm³ of {1e6 * volume:.3g} cm³, which "
            "would count that mass twice; cut one part out of the other"
        )


def _as_made(part: Part, factor: float) -> Part:
    """The part with its true density; the object holds the pieces of all."""
    mesh = trimesh.Trimesh(part.mesh.vertices, part.mesh.faces, process=False)
    return dataclasses.replace(part, mesh=mesh, density=part.density * factor, pieces=())
