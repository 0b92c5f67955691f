"""A URDF file as one rigid body.

In: a path. Out: `FileBody` in the frame of the root link. Links that fixed joints join become one
body; a link without mass, inertia and geometry is a mere frame. Without <inertial> it is massless.
"""

import os
import warnings
from pathlib import Path
from xml.etree import ElementTree as ET

import jax
import numpy as np
import trimesh
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.files import read_xml
from mjx_inertia.objects.export import NOTE
from mjx_inertia.objects.file_body import (
    FileBody,
    FileShape,
    Transform,
    primitive_mesh,
    read_mesh,
)
from mjx_inertia.objects.model import Color, transform_mesh
from mjx_inertia.spatial import (
    Consistency,
    InertialParameters,
    change_frame_float64,
    check_consistency,
    combine_float64,
    explain_consistency,
    inertial_float64,
)

_PRIMITIVES = {
    "box": ("size", 3),
    "sphere": ("radius", 1),
    "cylinder": ("radius length", 1),
    "capsule": ("radius length", 1),
}
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_CONTENT = ("inertial", "visual", "collision")


def read_urdf(path: Path, root: ET.Element) -> FileBody:
    """The body that the links of a file make up; `root` is its element `robot`.

    Warns:
      UserWarning: links with a shape that are massless, beside others with mass.

    Raises:
      ValueError: a joint that moves, links that nothing joins or that share a name, or elements
        that are not as URDF defines them; each by its name. What is wrong with
        inertial parameters, `lacking` says.
      FileNotFoundError: a mesh that is not where the file says.
    """
    links: dict[str, ET.Element] = {}
    for link in root.findall("link"):
        if links.setdefault(_attribute(link, "name", "a link"), link) is not link:
            raise ValueError(f"two links have the name {link.get('name')!r}")
    poses = _link_poses(root, links)
    colors = {material.get("name"): _color(material) for material in root.findall("material")}
    # inertial parameters of each link, or why there are none
    bodies, lacking, massless = [], [], []
    for name, T_root_link in poses.items():
        inertials = links[name].findall("inertial")
        if len(inertials) > 1:
            lacking.append(f"link {name!r} has {len(inertials)} elements <inertial>, expected one")
        elif inertials:
            try:
                bodies.append(_inertial(inertials[0], f"link {name!r}", T_root_link))
            except ValueError as error:  # which matters only to those who ask for it
                lacking.append(str(error))
        elif any(links[name].find(kind) is not None for kind in ("visual", "collision")):
            massless.append(name)
    if not bodies:
        lacking += [f"link {name!r} has no <inertial>" for name in massless]
    elif not any(body.mass > 0.0 for body in bodies):
        lacking.append("its links have 0 kg")
    elif massless:
        warnings.warn(f"links without <inertial> are massless: {massless}", stacklevel=4)
    friction = root.find("link/contact/lateral_friction")
    note = root.find(NOTE)
    note = {} if note is None else note.attrib
    return FileBody(
        name=root.get("name", path.stem),
        visuals=_shapes("visual", links, poses, path, colors),
        collisions=_shapes("collision", links, poses, path, colors),
        inertial=combine_float64(bodies) if bodies and not lacking else None,
        lacking=" and ".join(lacking) or "no link has an <inertial>",
        friction=None if friction is None else float(_numbers(friction, "value", 1, "link")[0]),
        category=note.get("category", ""),
        source=note.get("source", ""),
    )


def _link_poses(root: ET.Element, links: dict[str, ET.Element]) -> dict[str, Transform]:
    """T_root_link of every link that is joined to the one with mass or shape."""
    above: dict[str, tuple[str, Transform]] = {}
    for joint in root.findall("joint"):
        where = f"joint {joint.get('name')!r}"
        kind = joint.get("type")
        parent, child = (_link_of(joint, end, links, where) for end in ("parent", "child"))
        if kind == "floating" and not _has_content(links[parent]):
            continue  # from the world to a body that is free
        if kind != "fixed":
            raise ValueError(
                f"{where} moves ({kind}): an object is one rigid body, so that only fixed joints "
                "may join its links; make it fixed, or give each link a file of its own"
            )
        if child in above:
            raise ValueError(f"{where} gives link {child!r} a second parent")
        above[child] = parent, _origin(joint, where)
    # from each link up to its root
    poses, roots = {}, {}
    for name in links:
        pose, link = np.eye(4), name
        for _ in links:
            if link not in above:
                break
            link, T_above_link = above[link]
            pose = T_above_link @ pose
        if link in above:
            raise ValueError(f"link {name!r} is in a loop of joints")
        poses[name], roots[name] = pose, link
    # one body: all links with mass or shape hang on one root
    solid = [name for name, link in links.items() if _has_content(link)]
    if not solid:
        raise ValueError(f"no link with mass or shape among {len(links)} links")
    for name in solid:
        if roots[name] != roots[solid[0]]:
            raise ValueError(f"links {solid[0]!r} and {name!r} are not joined into one body")
    return {name: pose for name, pose in poses.items() if roots[name] == roots[solid[0]]}


def _has_content(link: ET.Element) -> bool:
    return any(link.find(kind) is not None for kind in _CONTENT)


def _link_of(joint: ET.Element, end: str, links: dict[str, ET.Element], where: str) -> str:
    element = joint.find(end)
    name = None if element is None else element.get("link")
    if name is None or name not in links:
        raise ValueError(f"{where}: its {end} {name!r} is none of the links {list(links)}")
    return name


def _inertial(element: ET.Element, where: str, T_root_link: Transform) -> InertialParameters:
    """In the root's frame; the tensor of the file is in the axes of the inertial's own origin."""
    mass, tensor = element.find("mass"), element.find("inertia")
    if mass is None or tensor is None:
        raise ValueError(f"{where}: <inertial> needs <mass> and <inertia>")
    xx, xy, xz, yy, yz, zz = (_numbers(tensor, key, 1, where)[0] for key in _TENSOR)
    about_com = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    own = inertial_float64(_numbers(mass, "value", 1, where)[0], np.zeros(3), about_com)
    body = change_frame_float64(own, T_root_link @ _origin(element, where))
    frame_only = body.mass == 0.0 and not np.any(body.inertia)
    with jax.enable_x64(True):
        if not frame_only and int(check_consistency(body)) > Consistency.ON_BOUNDARY:
            raise ValueError(f"{where}: {explain_consistency(body)}")
    return body


def _shapes(
    kind: str,
    links: dict[str, ET.Element],
    poses: dict[str, Transform],
    path: Path,
    colors: dict[str | None, Color | None],
) -> tuple[FileShape, ...]:
    shapes = []
    for name, T_root_link in poses.items():
        for i, element in enumerate(links[name].findall(kind)):
            where = f"link {name!r}, {kind} {i}"
            mesh = _geometry(element, where, path)
            material = element.find("material")
            color = None
            if material is not None:
                color = _color(material) or colors.get(material.get("name"))
            pose = T_root_link @ _origin(element, where)
            shapes.append(FileShape(where, transform_mesh(mesh, pose), color))
    return tuple(shapes)


def _geometry(element: ET.Element, where: str, path: Path) -> trimesh.Trimesh:
    """In the frame of the geometry, m."""
    shapes = element.findall("geometry/*")
    if len(shapes) != 1:
        raise ValueError(f"{where}: expected a <geometry> with one shape, found {len(shapes)}")
    shape = shapes[0]
    if shape.tag == "mesh":
        mesh = read_mesh(_mesh_path(_attribute(shape, "filename", where), where, path))
        scale = _numbers(shape, "scale", 3, where) if "scale" in shape.attrib else np.ones(3)
        return transform_mesh(mesh, np.diag([*scale, 1.0]))
    if shape.tag not in _PRIMITIVES:
        known = ["mesh", *_PRIMITIVES]
        raise ValueError(f"{where}: unknown shape <{shape.tag}>; expected one of {known}")
    names, count = _PRIMITIVES[shape.tag]
    size = np.concatenate([_numbers(shape, name, count, where) for name in names.split()])
    try:
        return primitive_mesh(shape.tag, size)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def _mesh_path(name: str, where: str, path: Path) -> Path:
    """Where the mesh is: beside the file, or in the package that its address names."""
    if name.startswith("package://"):
        package, _, inside = name.removeprefix("package://").partition("/")
        places = [folder / inside for folder in _package_folders(package, path)]
        at = (
            f"in the package {package!r}, a folder of that name or with a package.xml of that name "
            f"above {path}, beside one of these or in ROS_PACKAGE_PATH"
        )
    else:
        places = [path.parent / name.removeprefix("file://")]
        at = f"at {places[0]}"
    for place in places:
        if place.is_file():
            return place
    raise FileNotFoundError(f"{path}: {where}: expected the mesh {name!r} {at}, found no such file")


def _package_folders(package: str, path: Path) -> list[Path]:
    """Where a package may be: around the file, or on the search path of ROS."""
    above = path.resolve().parents
    around = [folder for folder in above if package in (folder.name, _package_name(folder))]
    path_of_ros = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    searched = [Path(folder) for folder in path_of_ros if folder]
    around += [folder for folder in searched if folder.name == package]
    return around + [folder / package for folder in (*above, *searched)]


def _package_name(folder: Path) -> str | None:
    """The name that a folder's package.xml states."""
    try:
        return (read_xml(folder / "package.xml").findtext("name") or "").strip()
    except (OSError, ValueError):
        return None


def _origin(element: ET.Element, where: str) -> Transform:
    """The pose that an element `origin` states; angles are about fixed axes, x first."""
    origin = element.find("origin")
    pose = np.eye(4)
    if origin is not None and "rpy" in origin.attrib:
        roll, pitch, yaw = map(float, _numbers(origin, "rpy", 3, where))
        pose = trimesh.transformations.euler_matrix(roll, pitch, yaw, "sxyz")
    if origin is not None and "xyz" in origin.attrib:
        pose[:3, 3] = _numbers(origin, "xyz", 3, where)
    return pose


def _color(material: ET.Element) -> Color | None:
    color = material.find("color")
    if color is None:
        return None
    red, green, blue, _ = _numbers(color, "rgba", 4, f"material {material.get('name')!r}")
    return float(red), float(green), float(blue)


def _numbers(element: ET.Element, key: str, count: int, where: str) -> Float[ndarray, " n"]:
    text = _attribute(element, key, where)
    try:
        values = np.array(text.split(), dtype=np.float64)
    except ValueError:
        values = np.zeros(0)
    if values.shape != (count,) or not np.all(np.isfinite(values)):
        wanted = "one finite number" if count == 1 else f"{count} finite numbers"
        raise ValueError(f"{where}: <{element.tag} {key}>: expected {wanted}, found {text!r}")
    return values


def _attribute(element: ET.Element, key: str, where: str) -> str:
    value = element.get(key)
    if value is None:
        raise ValueError(f"{where}: <{element.tag}> has no attribute {key!r}")
    return value
