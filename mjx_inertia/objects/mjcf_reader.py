"""An MJCF file as one rigid body.

In: a path. Out: `FileBody` in the frame of the outermost body. MuJoCo itself reads and compiles the
file, so that its defaults, angles, frames and inertia from geometries mean what they mean there;
bodies in that body without joints are parts of it. The world's own geometries (floor, table) are
left out.
"""

import warnings
from pathlib import Path

import mujoco
import numpy as np
import trimesh
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.objects.file_body import (
    FileBody,
    FileShape,
    Transform,
    primitive_mesh,
    read_mesh,
)
from mjx_inertia.objects.model import transform_mesh
from mjx_inertia.spatial import (
    InertialParameters,
    change_frame_float64,
    combine_float64,
    inertial_float64,
)

_UNNAMED = ("", "MuJoCo Model")  # what MuJoCo calls a model without a name
_LEGACY = 0.01  # of mass and moments: what MuJoCo's `legacy` mesh inertia may be off
_SAME = 1e-5  # of the size: a file's vertices and MuJoCo's, in single precision
_Geom = mujoco.mjtGeom


def read_mjcf(path: Path) -> FileBody:
    """The body of a model.

    Warns:
      UserWarning: mesh inertia of the kind `legacy` that is off by more than 1 %, or friction that
        differs between geometries.

    Raises:
      ValueError: MuJoCo cannot read or compile it (with its message), it has no body or several, a
        joint that moves, by its name, or a flex.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        # either would take away what is looked for
        spec.compiler.discardvisual = spec.compiler.fusestatic = False
        model = spec.compile()
    except ValueError as error:
        raise ValueError(f"MuJoCo cannot compile it: {error}") from None
    if model.nflex:
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, 0)
        raise ValueError(f"flex {name!r}: an object is rigid; give its shape as geoms")
    # geometries that touch nothing are to look at
    poses = _body_poses(model)
    shapes: dict[bool, list[FileShape]] = {True: [], False: []}
    closed: set[str] = set()  # names of meshes
    for geom in spec.geoms:
        if model.geom_bodyid[geom.id] > 0:
            touches = bool(model.geom_contype[geom.id] | model.geom_conaffinity[geom.id])
            shape = _shape(geom, model, poses)
            shapes[touches].append(shape)
            if geom.meshname and shape.mesh.is_volume:
                closed.add(geom.meshname)
    touching = np.flatnonzero(
        (model.geom_bodyid > 0) & (model.geom_contype | model.geom_conaffinity)
    )
    slide = np.unique(model.geom_friction[touching, 0])
    if len(slide) > 1:
        warnings.warn(
            f"geoms have friction {slide[0]:g} to {slide[-1]:g}; the object has that of the first",
            stacklevel=4,
        )
    inertial = _inertial(model, poses)
    _warn_of_legacy_inertia(spec, closed, inertial)
    texts = {text.name: text.data for text in spec.texts}
    return FileBody(
        name=path.stem if spec.modelname in _UNNAMED else spec.modelname,
        visuals=tuple(shapes[False]),
        collisions=tuple(shapes[True]),
        inertial=inertial,
        friction=float(model.geom_friction[touching[0], 0]) if len(touching) else None,
        category=texts.get(f"{spec.modelname}_category", ""),
        source=texts.get(f"{spec.modelname}_source", ""),
    )


def _outermost_body(model: mujoco.MjModel) -> int:
    """The one body in the world."""
    for i in range(model.njnt):
        kind = mujoco.mjtJoint(model.jnt_type[i])
        if kind != mujoco.mjtJoint.mjJNT_FREE:
            name = (
                model.joint(i).name or f"number {i} of body {model.body(model.jnt_bodyid[i]).name}"
            )
            raise ValueError(
                f"joint {name!r} moves ({kind.name.removeprefix('mjJNT_').lower()}): an object is "
                "one rigid body; remove the joint, or give each body a file of its own"
            )
    outer = [i for i in range(1, model.nbody) if model.body_parentid[i] == 0]
    if len(outer) != 1:
        names = [model.body(i).name for i in outer]
        raise ValueError(f"expected one body in the world, found {len(outer)}: {names}")
    return outer[0]


def _body_poses(model: mujoco.MjModel) -> dict[int, Transform]:
    """T_top_body of the outermost body and those in it.

    Not by `mj_kinematics`, which takes frames that differ by less than 1e-7 to be the same.
    """
    poses = {_outermost_body(model): np.eye(4)}
    for i in range(1, model.nbody):  # a body comes after the one that it is in
        if i not in poses:
            T_parent_body = _pose(model.body_pos[i], model.body_quat[i])
            poses[i] = poses[int(model.body_parentid[i])] @ T_parent_body
    return poses


def _pose(position: Float[ndarray, "3"], wxyz: Float[ndarray, "4"]) -> Transform:
    pose = trimesh.transformations.quaternion_matrix(wxyz)
    pose[:3, 3] = position
    return pose


def _inertial(model: mujoco.MjModel, poses: dict[int, Transform]) -> InertialParameters:
    """Of all bodies joined."""
    bodies = []
    for i, T_top_body in poses.items():
        own = inertial_float64(model.body_mass[i], np.zeros(3), np.diag(model.body_inertia[i]))
        T_body_axes = _pose(model.body_ipos[i], model.body_iquat[i])
        bodies.append(change_frame_float64(own, T_top_body @ T_body_axes))
    return combine_float64(bodies)


def _warn_of_legacy_inertia(
    spec: mujoco.MjSpec, closed: set[str], found: InertialParameters
) -> None:
    """Warns where the volume that MuJoCo takes for a mesh with notches is not the mesh's own."""
    if not (closed and found.mass > 0.0):
        return
    kind = mujoco.mjtMeshInertia
    exact = spec.copy()
    for mesh in exact.meshes:
        if mesh.inertia == kind.mjMESH_INERTIA_LEGACY and mesh.name in closed:
            mesh.inertia = kind.mjMESH_INERTIA_EXACT
    try:
        model = exact.compile()
    except ValueError:  # MuJoCo finds a mesh open that is closed when its corners are joined
        return
    true = _inertial(model, _body_poses(model))
    moment, true_moment = (np.linalg.eigvalsh(body.inertia) for body in (found, true))
    mass_off = abs(float(found.mass / true.mass) - 1.0)
    if mass_off > _LEGACY or np.abs(moment - true_moment).max() > _LEGACY * true_moment[-1]:
        warnings.warn(
            f"MuJoCo's `legacy` mesh inertia gives {found.mass:.4g} kg with a largest moment of "
            f"{moment[-1]:.4g} kg m², the meshes {true.mass:.4g} kg with {true_moment[-1]:.4g}; "
            '<mesh inertia="exact"> gives the latter',
            stacklevel=4,
        )


def _shape(geom: mujoco.MjsGeom, model: mujoco.MjModel, poses: dict[int, Transform]) -> FileShape:
    body = model.body(model.geom_bodyid[geom.id]).name
    where = f"body {body!r}, geom {geom.name or geom.id!r}"
    kind, size = _Geom(model.geom_type[geom.id]), model.geom_size[geom.id]
    if kind == _Geom.mjGEOM_MESH:
        mesh = _mesh(model, int(model.geom_dataid[geom.id]))
    elif kind == _Geom.mjGEOM_BOX:
        mesh = primitive_mesh("box", 2.0 * size)
    elif kind in (_Geom.mjGEOM_CYLINDER, _Geom.mjGEOM_CAPSULE):
        mesh = primitive_mesh(kind.name.removeprefix("mjGEOM_").lower(), size[:2] * [1.0, 2.0])
    elif kind in (_Geom.mjGEOM_SPHERE, _Geom.mjGEOM_ELLIPSOID):
        mesh = primitive_mesh(
            "ellipsoid", size if kind == _Geom.mjGEOM_ELLIPSOID else size[[0] * 3]
        )
    else:
        raise ValueError(f"{where}: a {kind.name.removeprefix('mjGEOM_').lower()} bounds no solid")
    T_body_geom = _pose(model.geom_pos[geom.id], model.geom_quat[geom.id])
    T_top_geom = poses[int(model.geom_bodyid[geom.id])] @ T_body_geom
    # MuJoCo keeps colours in single precision
    red, green, blue, _ = (round(float(value), 6) for value in model.geom_rgba[geom.id])
    density = geom.density if np.isnan(geom.mass) else geom.mass / mesh.volume
    return FileShape(where, transform_mesh(mesh, T_top_geom), (red, green, blue), float(density))


def _mesh(model: mujoco.MjModel, i: int) -> trimesh.Trimesh:
    """A mesh in the frame that MuJoCo gives it: about its CoM, along its principal axes.

    From its file, because MuJoCo keeps single precision; as MuJoCo has it where the file is of a
    format of its own, or the model changes it in more ways than its scale.
    """
    first, count = model.mesh_vertadr[i], model.mesh_vertnum[i]
    vertices = model.mesh_vert[first : first + count].astype(np.float64)
    start, number = model.mesh_faceadr[i], model.mesh_facenum[i]
    compiled = trimesh.Trimesh(vertices, model.mesh_face[start : start + number], process=False)
    compiled.merge_vertices()
    if model.mesh_pathadr[i] < 0:
        return compiled
    file = model.paths[model.mesh_pathadr[i] :].split(b"\0", 1)[0].decode()
    T_file_mesh = _pose(model.mesh_pos[i], model.mesh_quat[i])
    try:
        exact = read_mesh(Path(file))
    except (OSError, ValueError):
        return compiled
    exact = transform_mesh(exact, np.linalg.inv(T_file_mesh) @ np.diag([*model.mesh_scale[i], 1.0]))
    close = np.abs(exact.bounds - compiled.bounds).max() <= _SAME * compiled.extents.max()
    return exact if close else compiled
