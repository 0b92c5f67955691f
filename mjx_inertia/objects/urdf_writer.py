"""An object as URDF.

In: an `ObjectModel` and its mesh files. Out: the text of a file with one link, whose frame is that
of the object. Friction is in Bullet's element `contact`; `mujoco` makes MuJoCo keep the link, its
visual meshes and their paths; category, source and `pieces_error` are in an element of our own.
Readers pass over elements that they do not know.
"""

from collections.abc import Iterable
from xml.etree import ElementTree as ET

import numpy as np

from mjx_inertia.objects.mesh_files import FOLDER, MeshFiles
from mjx_inertia.objects.model import ObjectModel

NOTE = "mjx_inertia"  # the element of our own


def urdf_text(obj: ObjectModel, name: str, files: MeshFiles) -> bytes:
    """The file, which names meshes by their path from its folder."""
    robot = ET.Element("robot", name=name)
    note = {"category": obj.category, "source": obj.source}
    note["pieces_error"] = numbers([obj.pieces_error])
    ET.SubElement(robot, NOTE, note)
    mujoco = ET.SubElement(robot, "mujoco")
    keep = ("strippath", "fusestatic", "discardvisual", "balanceinertia")
    ET.SubElement(mujoco, "compiler", {key: "false" for key in keep})
    link = ET.SubElement(robot, "link", name=name)
    _inertial(link, obj)
    for i, visual in enumerate(files.visuals):
        element = _geometry(link, "visual", visual.file)
        material = ET.SubElement(element, "material", name=f"{name}_part_{i}")
        ET.SubElement(material, "color", rgba=numbers([*visual.color, 1.0]))
    for file in files.collisions:
        _geometry(link, "collision", file)
    contact = ET.SubElement(link, "contact")
    ET.SubElement(contact, "lateral_friction", value=numbers([obj.friction]))
    return pretty(robot)


def numbers(values: Iterable[float]) -> str:
    """Values as text that gives the same doubles back."""
    return " ".join(repr(float(value)) for value in values)


def pretty(root: ET.Element) -> bytes:
    """Indented XML."""
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _inertial(link: ET.Element, obj: ObjectModel) -> None:
    """The tensor is about the CoM in the axes of the link."""
    tensor = np.asarray(obj.inertial.inertia, np.float64)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=numbers(np.asarray(obj.inertial.com)), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=numbers([float(obj.inertial.mass)]))
    upper = {
        f"i{'xyz'[i]}{'xyz'[j]}": numbers([tensor[i, j]]) for i in range(3) for j in range(i, 3)
    }
    ET.SubElement(inertial, "inertia", upper)


def _geometry(link: ET.Element, kind: str, file: str) -> ET.Element:
    element = ET.SubElement(link, kind)
    ET.SubElement(element, "origin", xyz="0 0 0", rpy="0 0 0")
    geometry = ET.SubElement(element, "geometry")
    ET.SubElement(geometry, "mesh", filename=f"{FOLDER}/{file}")
    return element
