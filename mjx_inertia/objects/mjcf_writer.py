"""An object as MJCF.

In: an `ObjectModel` and its mesh files. Out: the text of a model with one free body, whose frame is
that of the object. Mass, CoM and tensor are stated. The visual meshes (group 2, without contact)
carry the densities of their parts, and the convex pieces (group 3) no mass, so MuJoCo's own
integrals (`inertiafromgeom="true"`) agree where all parts are known. Names begin with that of the
object, so that several can share a scene.
"""

from xml.etree import ElementTree as ET

import numpy as np

from mjx_inertia.objects.mesh_files import FOLDER, MeshFiles
from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.urdf_writer import numbers, pretty

_TORSIONAL, _ROLLING = 0.005, 1e-4  # MuJoCo's own values of the other coefficients, m
_VISUAL_GROUP, _COLLISION_GROUP = "2", "3"


def mjcf_text(obj: ObjectModel, name: str, files: MeshFiles) -> bytes:
    """The file, which names meshes by their path from its folder."""
    root = ET.Element("mujoco", model=name)
    ET.SubElement(root, "compiler", meshdir=FOLDER, angle="radian")
    custom = ET.SubElement(root, "custom")
    for key, value in (("category", obj.category), ("source", obj.source)):
        if value:
            ET.SubElement(custom, "text", name=f"{name}_{key}", data=value)
    off = numbers([obj.pieces_error])
    ET.SubElement(custom, "numeric", name=f"{name}_pieces_error", data=off)
    assets = ET.SubElement(root, "asset")
    world = ET.SubElement(root, "worldbody")
    body = ET.SubElement(world, "body", name=name)
    ET.SubElement(body, "freejoint", name=name)
    _inertial(body, obj)
    for visual in files.visuals:
        geom = _geom(assets, body, name, visual.file, _VISUAL_GROUP)
        geom.attrib |= {"contype": "0", "conaffinity": "0"}
        geom.attrib |= {
            "density": numbers([visual.density]),
            "rgba": numbers([*visual.color, 1.0]),
        }
    for file in files.collisions:
        geom = _geom(assets, body, name, file, _COLLISION_GROUP)
        geom.attrib |= {"mass": "0", "friction": numbers([obj.friction, _TORSIONAL, _ROLLING])}
    return pretty(root)


def _inertial(body: ET.Element, obj: ObjectModel) -> None:
    tensor = np.asarray(obj.inertial.inertia, np.float64)
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]  # xx yy zz xy xz yz
    ET.SubElement(
        body,
        "inertial",
        pos=numbers(np.asarray(obj.inertial.com)),
        mass=numbers([float(obj.inertial.mass)]),
        fullinertia=numbers(tensor[rows, columns]),
    )


def _geom(assets: ET.Element, body: ET.Element, name: str, file: str, group: str) -> ET.Element:
    mesh = f"{name}_{file.removesuffix('.obj')}"
    inertia = "exact" if group == _VISUAL_GROUP else "convex"
    ET.SubElement(assets, "mesh", name=mesh, file=file, inertia=inertia)
    return ET.SubElement(body, "geom", name=mesh, type="mesh", mesh=mesh, group=group)
