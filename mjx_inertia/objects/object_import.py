"""Any URDF, MJCF or mesh file as an object.

In: a path. Out: an `ObjectModel` that stands on z = 0, in the axes of the file.
"""

import dataclasses
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

import jax
import jax.numpy as jnp
import manifold3d
import numpy as np
import trimesh

from mjx_inertia.files import read_xml
from mjx_inertia.objects.composition import SUPPORT_DEPTH, main_color
from mjx_inertia.objects.convex import Pieces, hull_vertices
from mjx_inertia.objects.decomposition import object_pieces
from mjx_inertia.objects.file_body import FileBody, FileShape, read_mesh
from mjx_inertia.objects.manifolds import from_manifold, lowest, silhouette, to_manifold, union
from mjx_inertia.objects.mesh_defects import checked_mesh
from mjx_inertia.objects.mesh_integrals import is_positive, solid_properties_float64
from mjx_inertia.objects.mesh_repair import repair_mesh
from mjx_inertia.objects.mjcf_reader import read_mjcf
from mjx_inertia.objects.model import ObjectModel, Part, transform_mesh
from mjx_inertia.objects.urdf_reader import read_urdf
from mjx_inertia.spatial import InertialParameters, combine_float64

Shape = Literal["visual", "collision", "hull"]

_MESHES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf", ".dae", ".3mf")
_ON_TABLE = 1e-6  # m: a body that close to z = 0 stays where it is
_CONVEX = 1e-4  # of the volume that a hull may add
_OVERLAP = 1e-4  # of the volume that parts may share
_AGREE = 1e-6  # relative: parts whose densities give the stated parameters
_MISFIT = 1e-3  # of the size: how far stated parameters may leave the shape without a warning
_LARGE, _HEAVY = 3.0, 300.0  # m, kg: nothing larger or heavier is held in a hand
_DEFAULT_FRICTION = 0.4
_GREY = (0.6, 0.6, 0.6)


def import_object(
    path: Path | str,
    *,
    density: float | None = None,
    mass: float | None = None,
    shape: Shape = "visual",
    repair: bool = False,
    unit: float | None = None,
) -> ObjectModel:
    """The object that a file describes.

    Its surface is the union of the file's visual shapes. Where these bound no solid but the
    inertial parameters are stated, it is that of the collision shapes or of the convex hulls.
    Collision shapes become the convex pieces; one that is not convex is decomposed. Outline, height
    and support come from the surface. The object keeps the axes of the file and is moved along z so
    that its lowest point is at z = 0; whether it stands there by itself, its `stability` says.

    Args:
      path: of a `.urdf`, an `.xml` (MJCF or URDF) or a mesh file. Links may be joined by fixed
        joints, bodies without joints; a free joint to the world is allowed.
      density: kg/m³ of a uniform solid, instead of the inertial parameters in the file.
      mass: kg of a uniform solid, likewise.
      shape: which of the file's shapes the surface is, where it has both; "hull" for the convex
        hull of each visual shape, which need not be a solid.
      repair: whether the surface is repaired where it bounds no solid (`repair_mesh`), which a
        warning tells.
      unit: m, of the coordinates in a mesh file; if None, that which the file states (3MF, COLLADA)
        or metres. URDF and MJCF are in metres.

    Warns:
      UserWarning: what was repaired, a defect too small to matter, another shape in place of one
        that bounds no solid, links without mass, stated parameters that no body within this shape
        has, `legacy` mesh inertia of MuJoCo that is off by more than 1 %, or a size or mass that
        tells of another unit.

    Raises:
      FileNotFoundError: the file, or a mesh that it names, does not exist.
      ValueError: with the path, what was expected and what was found: a file that is something
        else, no inertial parameters and neither density nor mass, a mesh that bounds no solid (the
        defect by its name), shapes that lie apart as seen from above, parameters that no body can
        have, or a joint that moves.
    """
    file = Path(path)
    if not file.is_file():
        found = "a folder" if file.is_dir() else "nothing"
        raise FileNotFoundError(f"{file}: expected a URDF, MJCF or mesh file, found {found}")
    try:
        _check_arguments(density, mass, shape, unit)
        body = _read(file, unit)
        stated = body.inertial is not None and density is None and mass is None
        return _object(body, _solids(body, shape, repair, stated), density, mass)
    except ValueError as error:
        already = str(error).startswith(f"{file}: ")
        raise ValueError(str(error) if already else f"{file}: {error}") from None


def _check_arguments(
    density: float | None, mass: float | None, shape: str, unit: float | None
) -> None:
    if density is not None and mass is not None:
        raise ValueError(f"density {density} kg/m³ and mass {mass} kg: give one of them")
    for name, value in (("density", density), ("mass", mass), ("unit", unit)):
        if value is not None and not is_positive(value):
            raise ValueError(f"{name}: {value!r} is not positive")
    if shape not in get_args(Shape):
        raise ValueError(f"shape: {shape!r}; choose one of {list(get_args(Shape))}")


def _read(file: Path, unit: float | None) -> FileBody:
    if file.suffix.lower() in _MESHES:
        mesh = read_mesh(file, unit)
        return FileBody(file.stem, (FileShape("the mesh", mesh),), lacking="a mesh has no mass")
    if unit not in (None, 1.0):
        raise ValueError(f"unit: {unit} m is for mesh files; URDF and MJCF are in metres")
    if file.suffix.lower() not in (".urdf", ".xml", ".mjcf"):
        known = [".urdf", ".xml", ".mjcf", *_MESHES]
        raise ValueError(f"expected a name that ends in one of {known}")
    root = read_xml(file)
    if root.tag == "robot":
        return read_urdf(file, root)
    if root.tag == "mujoco":
        return read_mjcf(file)
    raise ValueError(f"expected the element <robot> (URDF) or <mujoco> (MJCF), found <{root.tag}>")


def _object(
    body: FileBody, solids: Sequence[FileShape], density: float | None, mass: float | None
) -> ObjectModel:
    # put down on the table
    low = min(float(solid.mesh.bounds[0, 2]) for solid in solids)
    up = 0.0 if abs(low) <= _ON_TABLE else -low
    solids, collisions = _lifted(solids, up), _lifted(body.collisions, up)
    whole = union(solid.mesh for solid in solids)
    # inertial parameters as asked for or as stated
    if density is None and mass is not None:
        density = mass / whole.volume()
    if density is None:
        inertial = _stated(body, up)
        _warn_of_misfit(inertial, from_manifold(whole.hull()))
    else:
        inertial = solid_properties_float64(from_manifold(whole), density)
    _warn_of_unit(whole, float(inertial.mass))
    colored = [Part(solid.mesh, 1.0, solid.color or _GREY) for solid in solids]
    return ObjectModel(
        name=body.name,
        outline=silhouette(whole, body.name),
        height=whole.bounding_box()[5],
        inertial=jax.tree.map(jnp.asarray, inertial),
        pieces=_pieces(collisions, solids, whole),
        support=lowest(whole, SUPPORT_DEPTH),
        mesh=from_manifold(whole),
        parts=_parts(solids, density, inertial, whole.volume()),
        category=body.category,
        friction=_DEFAULT_FRICTION if body.friction is None else body.friction,
        color=main_color(colored),
        source=body.source,
    )


def _stated(body: FileBody, up: float) -> InertialParameters:
    if body.inertial is None:
        raise ValueError(
            f"{body.lacking}; give `density` (kg/m³) or `mass` (kg) for the inertial parameters of "
            "a uniform solid"
        )
    return body.inertial.replace(com=body.inertial.com + np.array([0.0, 0.0, up]))


def _warn_of_misfit(inertial: InertialParameters, hull: trimesh.Trimesh) -> None:
    """Warns of a CoM or a tensor that no mass within the convex hull of the shape gives."""
    com, mass = np.asarray(inertial.com), float(inertial.mass)
    if not mass > 0.0:
        return  # such parameters are refused when the object is made
    inside = np.einsum("fd,fd->f", com - hull.triangles[:, 0], hull.face_normals)
    outside, size = float(inside.max()), float(np.linalg.norm(hull.extents))
    if outside > _MISFIT * size:
        warnings.warn(
            f"the stated CoM {com.round(4).tolist()} m is {outside:.3g} m outside of the convex "
            f"hull of the shape, whose size is {size:.3g} m",
            stacklevel=4,
        )
    # ∫ r² dm about the CoM is half the trace of the tensor
    gyration = float(np.sqrt(0.5 * np.trace(inertial.inertia) / mass))
    farthest = float(np.linalg.norm(hull.vertices - com, axis=1).max())
    if gyration > (1.0 + _MISFIT) * farthest:
        warnings.warn(
            f"the stated inertia has a radius of gyration of {gyration:.3g} m, but no point of the "
            f"shape is farther than {farthest:.3g} m from the stated CoM",
            stacklevel=4,
        )


def _warn_of_unit(whole: manifold3d.Manifold, mass: float) -> None:
    """Warns of an object that is too large or too heavy for a hand."""
    low, high = np.array(whole.bounding_box()).reshape(2, 3)
    size = float((high - low).max())
    if size <= _LARGE and mass <= _HEAVY:
        return
    name, unit = ("millimetres", 1e-3) if size > 10.0 * _LARGE else ("centimetres", 1e-2)
    smaller = f"; in {name} it would be {unit * size:.3g} m long" if size > _LARGE else ""
    warnings.warn(
        f"the object is {size:.3g} m long and has {mass:.3g} kg, more than anything held in a "
        f"hand{smaller}: look at the unit of its meshes (`unit` for a mesh file, `scale` in URDF "
        "and MJCF)",
        stacklevel=4,
    )


def _solids(body: FileBody, shape: Shape, repair: bool, stated: bool) -> tuple[FileShape, ...]:
    """The shapes whose union is the object, each of which bounds a solid.

    Where the inertial parameters are stated, others stand in for those that bound none.
    """
    shapes = {"visual": body.visuals, "collision": body.collisions}
    first, second = ("collision", "visual") if shape == "collision" else ("visual", "collision")
    chosen = shapes[first] or shapes[second]
    if not chosen:
        raise ValueError("expected a shape, found no visual and no collision geometry")
    if shape == "hull":
        return tuple(map(_hull, chosen))
    try:
        return tuple(_sound(solid, repair) for solid in chosen)
    except ValueError as error:
        defect = str(error)
    others = shapes[second] if shapes[first] else ()
    ways = [] if repair else ["`repair=True`"]
    if not stated:
        ways += [f"the {second} shapes (`shape={second!r}`)"] if others else []
        ways.append("the convex hull (`shape='hull'`)")
        raise ValueError(f"{defect}; try {' or '.join(ways)}")
    standing_in = f"the {second} shapes"
    try:
        solids = tuple(_sound(solid, repair) for solid in others)
    except ValueError:
        solids = ()
    if not solids:
        standing_in, solids = "the convex hulls", tuple(map(_hull, chosen))
    hint = f"; {ways[0]} may mend them" if ways else ""
    warnings.warn(
        f"{defect}; {standing_in} stand in for such shapes, with the stated inertia{hint}",
        stacklevel=4,
    )
    return solids


def _hull(solid: FileShape) -> FileShape:
    points = np.asarray(solid.mesh.vertices)
    hull = manifold3d.Manifold.hull_points(points[np.isfinite(points).all(axis=1)])
    if not hull.volume() > 0.0:
        raise ValueError(f"{solid.where}: its convex hull is flat; a body needs volume")
    return dataclasses.replace(solid, mesh=from_manifold(hull))


def _sound(solid: FileShape, repair: bool) -> FileShape:
    mesh = solid.mesh
    try:
        if repair:
            repaired = repair_mesh(mesh.vertices, mesh.faces)
            mesh = trimesh.Trimesh(repaired.vertices, repaired.faces, process=False)
            if repaired.remedied:
                found = ", ".join(str(finding) for finding in repaired.remedied)
                warnings.warn(f"{solid.where} was repaired: {found}", stacklevel=5)
        checked_mesh(mesh.vertices, mesh.faces)
        to_manifold(mesh)
    except ValueError as error:
        raise ValueError(f"{solid.where}: {error}") from None
    return dataclasses.replace(solid, mesh=mesh)


def _lifted(shapes: Sequence[FileShape], by: float) -> tuple[FileShape, ...]:
    matrix = np.eye(4)
    matrix[2, 3] = by
    return tuple(dataclasses.replace(s, mesh=transform_mesh(s.mesh, matrix)) for s in shapes)


def _parts(
    solids: Sequence[FileShape], density: float | None, inertial: InertialParameters, volume: float
) -> tuple[Part, ...]:
    """The shapes with their densities, if these are known and give the object's parameters."""
    densities = [solid.density if density is None else density for solid in solids]
    shared = sum(solid.mesh.volume for solid in solids) - volume
    if None in densities or shared > _OVERLAP * volume:
        return ()
    parts = tuple(
        Part(solid.mesh, float(known), solid.color or _GREY)
        for solid, known in zip(solids, densities, strict=True)
        if known is not None
    )
    if any(not part.density > 0.0 for part in parts):
        return ()
    total = combine_float64([solid_properties_float64(p.mesh, p.density) for p in parts])
    for found, stated in zip(jax.tree.leaves(total), jax.tree.leaves(inertial), strict=True):
        if not np.allclose(found, stated, rtol=0.0, atol=_AGREE * np.abs(stated).max()):
            return ()
    return parts


def _pieces(
    collisions: Sequence[FileShape], solids: Sequence[FileShape], whole: manifold3d.Manifold
) -> Pieces:
    """Collision shapes as convex bodies; those of the surface where the file has none."""
    pieces: list[np.ndarray] = []
    for collision in collisions:
        hull = to_manifold(_hull(collision).mesh)
        if hull.volume() - collision.mesh.volume <= _CONVEX * hull.volume():
            pieces.append(hull_vertices(collision.mesh.vertices))
            continue
        try:
            body = to_manifold(collision.mesh)
        except ValueError:  # an open mesh: simulators take its hull
            pieces.append(hull_vertices(collision.mesh.vertices))
        else:
            pieces += object_pieces([Part(collision.mesh, 1.0)], body)
    return tuple(pieces) or object_pieces([Part(solid.mesh, 1.0) for solid in solids], whole)
