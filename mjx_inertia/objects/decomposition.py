"""Any object as convex pieces, for collision.

In: parts and the solid that they make up. Out: vertices of convex bodies. Bodies may overlap inside
the whole, so a grip around a shaft counts as solid. Prisms and solids of revolution are recognised
and cut in the plane; the rest is cut by planes. (CoACD, tried on the catalogue, takes up to two
minutes for one lamp, and its error is several times larger.)
"""

import contextlib
import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence

import manifold3d
import numpy as np
import shapely
from jaxtyping import Float
from numpy import ndarray
from shapely.geometry.base import BaseGeometry
from tqdm import tqdm

from mjx_inertia.objects.convex import (
    SECTIONS,
    Pieces,
    hull_vertices,
    prism_pieces,
    revolution_pieces,
)
from mjx_inertia.objects.manifolds import (
    covered,
    difference_volume,
    filled,
    from_manifold,
    section,
    to_manifold,
)
from mjx_inertia.objects.model import Part

_NOTHING = 2e-3  # of the whole volume: what a part's hull may add
_WASTE = 0.02  # of a part's volume: what all hulls of its bodies may add
_ALIKE = 0.03  # of the volume by which a part may differ from a prism or a turned profile
_COARSE = 0.003  # of the whole's extent: how close outlines are followed
_MANY = 160  # pieces of a prism or a solid of revolution
_MOST = 48  # bodies that a part is cut into
_CORNERS = 64  # of a hull, beyond which it is made simpler
_QUIET_S = 5.0  # without a word
_CUTS = 5  # planes to choose from across each direction of a body


def object_pieces(parts: Sequence[Part], whole: manifold3d.Manifold) -> Pieces:
    """Convex bodies whose union is close to an object.

    Each part gives its own pieces where it has some; else its hull, if that adds little to the
    whole; else the pieces of the prism or the solid of revolution that it is; else those that
    planes cut it into. A progress bar shows after 5 s.
    """
    solid = filled(whole)
    low, high = np.array(whole.bounding_box()).reshape(2, 3)
    coarse = _COARSE * float(np.linalg.norm(high - low))
    pieces = (piece for part in parts for piece in _part_pieces(part, solid, coarse))
    # hundreds of bodies take minutes
    return tuple(tqdm(pieces, desc="convex pieces", unit="piece", delay=_QUIET_S, leave=False))


def _part_pieces(part: Part, whole: manifold3d.Manifold, coarse: float) -> Iterator[ndarray]:
    if part.pieces:
        yield from part.pieces
        return
    for body in filled(to_manifold(part.mesh)).decompose():
        hull = body.hull()
        if (hull - whole).volume() <= _NOTHING * whole.volume():
            yield _corners(hull, coarse)
        else:
            yield from _known_shape(body, coarse) or (
                _corners(piece.hull, coarse) for piece in _cut_up(_simpler(whole ^ hull, coarse))
            )


def _known_shape(solid: manifold3d.Manifold, coarse: float) -> Pieces:
    """Pieces of the prism or the solid of revolution that a solid is, or none."""
    mesh = from_manifold(solid)
    axes = np.asarray(mesh.principal_inertia_vectors)
    frames = [np.eye(3), *(np.stack([axes[i - 2], axes[i - 1], axes[i]]) for i in range(3))]
    for R_frame_part in frames:
        plan, low, high = _plan(solid, R_frame_part)
        if plan.area * (high - low) <= (1.0 + _ALIKE) * solid.volume():
            pieces = _few(functools.partial(prism_pieces, plan, high - low, low), coarse)
            return tuple(piece @ R_frame_part for piece in pieces)
    center = np.asarray(mesh.center_mass)
    for R_frame_part in frames:
        centred = solid.transform(np.c_[R_frame_part, -R_frame_part @ center])
        profile = section(centred)  # x is the radius, y the axis
        if difference_volume(_turned(profile), centred) <= _ALIKE * solid.volume():
            pieces = _few(functools.partial(revolution_pieces, profile), coarse)
            return tuple(piece @ R_frame_part + center for piece in pieces)
    return ()


def _plan(
    solid: manifold3d.Manifold, R_frame_part: Float[ndarray, "3 3"]
) -> tuple[BaseGeometry, float, float]:
    """What a turned solid covers as seen along z, and between which heights it lies."""
    turned = solid.transform(np.c_[R_frame_part, np.zeros(3)])
    box = turned.bounding_box()
    return covered(turned), box[2], box[5]


def _turned(profile: BaseGeometry) -> manifold3d.Manifold:
    rings = [np.asarray(polygon.exterior.coords)[:-1] for polygon in shapely.get_parts(profile)]
    flat = manifold3d.CrossSection(rings, manifold3d.FillRule.NonZero)
    return flat.revolve(SECTIONS)


def _few(pieces_at: Callable[..., Pieces], coarse: float) -> Pieces:
    """Not too many pieces: the tolerance grows until they are."""
    for _ in range(8):
        with contextlib.suppress(ValueError):  # many more than too many
            pieces = pieces_at(coarse=coarse)
            if len(pieces) <= _MANY:
                return pieces
        coarse *= 2.0
    return ()


@dataclasses.dataclass(frozen=True, eq=False)
class _Body:
    """A piece of a solid, its hull, and the volume that the hull adds, m³."""

    solid: manifold3d.Manifold
    hull: manifold3d.Manifold
    waste: float


def _bodies(solids: Iterable[manifold3d.Manifold]) -> list[_Body]:
    """The connected bodies of solids."""
    connected = [part for solid in solids for part in solid.decompose()]
    hulls = [part.hull() for part in connected]
    return [
        _Body(part, hull, hull.volume() - part.volume())
        for part, hull in zip(connected, hulls, strict=True)
    ]


def _cut_up(solid: manifold3d.Manifold) -> list[_Body]:
    """Bodies that planes cut a solid into, until their hulls add little, or they are many.

    The body whose hull adds most is cut next, where each body more saves most.
    """
    bodies = _bodies([solid])
    while len(bodies) < _MOST:
        if sum(body.waste for body in bodies) <= _WASTE * solid.volume():
            break
        worst = max(bodies, key=lambda body: body.waste)
        bodies.remove(worst)
        bodies += max(_ways_to_cut(worst), key=lambda way: _saved(worst, way))
    least = 1e-6 * solid.volume()
    return [body for body in bodies if body.hull.volume() > least]


def _ways_to_cut(body: _Body) -> Iterator[list[_Body]]:
    """By one plane across a principal direction, or in four: halving a tube saves nothing yet."""
    corners = np.asarray(body.hull.to_mesh64().vert_properties)
    _, _, axes = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)
    middles = []
    for normal in axes:
        low, high = np.min(corners @ normal), np.max(corners @ normal)
        middles.append((tuple(normal), 0.5 * (low + high)))
        for offset in np.linspace(low, high, _CUTS + 2)[1:-1]:
            yield _bodies(body.solid.split_by_plane(tuple(normal), float(offset)))
    for first, second in itertools.combinations(middles, 2):
        halves = body.solid.split_by_plane(*first)
        yield _bodies([quarter for half in halves for quarter in half.split_by_plane(*second)])


def _saved(body: _Body, way: list[_Body]) -> float:
    """What the hulls of a cut body add less than its own, for each body more."""
    return (body.waste - sum(part.waste for part in way)) / max(len(way) - 1, 1)


def _simpler(solid: manifold3d.Manifold, coarse: float) -> manifold3d.Manifold:
    """The solid without details that hardly matter."""
    simpler = solid.simplify(0.2 * coarse)
    return simpler if abs(simpler.volume() / solid.volume() - 1.0) < 0.01 else solid


def _corners(hull: manifold3d.Manifold, coarse: float) -> Float[ndarray, "_ 3"]:
    """Vertices of a hull, without those that hardly matter."""
    for tolerance in coarse * np.array([0.2, 0.5, 1.0, 2.0]):
        simpler = hull.simplify(float(tolerance))
        if simpler.volume() < 0.98 * hull.volume():
            break
        hull = simpler
        if hull.num_vert() <= _CORNERS:
            break
    return hull_vertices(np.asarray(hull.to_mesh64().vert_properties))
