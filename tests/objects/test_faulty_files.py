"""Files with faults as users bring them: refused or remarked on by name, never read wrongly."""

import struct
import warnings

import numpy as np
import pytest
import shapely
import trimesh

from mjx_inertia.objects import cube, import_object
from mjx_inertia.objects.gallery import gallery
from mjx_inertia.objects.manifolds import silhouette, simple_polygons, union

pytestmark = pytest.mark.float64

BOX = '<visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual>'
STATED = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="0.005" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.005"/></inertial>'
)


def of_mesh(name, inertial="", kind="visual"):
    shape = f'<{kind}><geometry><mesh filename="{name}"/></geometry></{kind}>'
    return f'<robot name="r"><link name="a">{inertial}{shape}</link></robot>'


def u_channel():
    """0.2 m cubed less a groove as wide as half of it: 4 kg at 1000 kg/m³."""
    rings = np.array(
        [[0, 0], [0.2, 0], [0.2, 0.2], [0.15, 0.2], [0.15, 0.1], [0.05, 0.1], [0.05, 0.2], [0, 0.2]]
    )
    return trimesh.creation.extrude_polygon(shapely.Polygon(rings), 0.2)


def without_a_face(mesh):
    mesh.update_faces(np.arange(len(mesh.faces)) != 3)
    return mesh


def test_a_package_is_never_another_package(tmp_path, monkeypatch):
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    for package, edge in (("first/meshes", 0.1), ("vendor/second/meshes", 0.2)):
        (tmp_path / package).mkdir(parents=True)
        trimesh.creation.box((edge,) * 3).export(tmp_path / package / "base.stl")
    (tmp_path / "first" / "urdf").mkdir()
    file = tmp_path / "first" / "urdf" / "b.urdf"
    file.write_text(of_mesh("package://second/meshes/base.stl"))
    with pytest.raises(
        FileNotFoundError, match=r"in the package 'second'.* or in ROS_PACKAGE_PATH"
    ):
        import_object(file, density=1000.0)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "vendor"))
    assert import_object(file, density=1000.0).inertial.mass == pytest.approx(8.0, rel=1e-6)
    # a folder may have another name than the package in it
    file.write_text(of_mesh("package://primary/meshes/base.stl"))
    (tmp_path / "first" / "package.xml").write_text("<package><name>primary</name></package>")
    assert import_object(file, density=1000.0).inertial.mass == pytest.approx(1.0, rel=1e-6)


def test_a_link_with_a_shape_alone_is_massless(tmp_path):
    small = BOX.replace("0.2", "0.1")
    (tmp_path / "two.urdf").write_text(
        f'<robot name="r"><link name="a">{STATED}{BOX}</link><link name="b">{small}</link>'
        '<joint name="f" type="fixed"><parent link="a"/><child link="b"/></joint></robot>'
    )
    with pytest.warns(UserWarning, match=r"links without <inertial> are massless: \['b'\]"):
        found = import_object(tmp_path / "two.urdf")
    assert found.inertial.mass == pytest.approx(1.0)
    np.testing.assert_allclose(found.inertial.inertia, 0.005 * np.eye(3), atol=1e-12)


def test_links_of_no_mass_at_all_ask_for_one(tmp_path):
    nothing = STATED.replace("0.005", "0").replace('mass value="1"', 'mass value="0"')
    (tmp_path / "plane.urdf").write_text(
        f'<robot name="r"><link name="a">{nothing}{BOX}</link></robot>'
    )
    with pytest.raises(ValueError, match="its links have 0 kg; give `density`"):
        import_object(tmp_path / "plane.urdf")
    assert import_object(tmp_path / "plane.urdf", mass=2.0).inertial.mass == pytest.approx(2.0)


def test_a_stated_inertia_needs_no_solid(tmp_path):
    without_a_face(trimesh.creation.box((0.2,) * 3)).export(tmp_path / "open.stl")
    (tmp_path / "a.urdf").write_text(of_mesh("open.stl", STATED))
    with pytest.warns(UserWarning, match="visual 0: .*not watertight.*; the convex hulls stand in"):
        found = import_object(tmp_path / "a.urdf")
    assert found.is_box and found.inertial.mass == pytest.approx(1.0)
    collision = '<collision><geometry><box size="0.2 0.2 0.3"/></geometry></collision>'
    text = of_mesh("open.stl", STATED + collision)
    (tmp_path / "b.urdf").write_text(text)
    with pytest.warns(UserWarning, match="the collision shapes stand in"):
        assert import_object(tmp_path / "b.urdf").height == pytest.approx(0.3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert import_object(tmp_path / "b.urdf", shape="hull").height == pytest.approx(0.2)
    with pytest.raises(ValueError, match=r"not watertight.* or the convex hull \(`shape='hull'`\)"):
        import_object(tmp_path / "a.urdf", density=1000.0)
    filled = import_object(tmp_path / "a.urdf", density=1000.0, shape="hull")
    assert filled.inertial.mass == pytest.approx(8.0, rel=1e-6)


def test_legacy_inertia_of_mujoco_is_remarked_on(tmp_path):
    u_channel().export(tmp_path / "u.stl")
    model = (
        '<mujoco><asset><mesh name="m" file="u.stl"{}/></asset><worldbody><body name="b">'
        '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    )
    (tmp_path / "u.xml").write_text(model.format(""))
    with pytest.warns(UserWarning, match=r"`legacy` mesh inertia gives .*, the meshes 6 kg with"):
        assert import_object(tmp_path / "u.xml").inertial.mass > 6.1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (tmp_path / "exact.xml").write_text(model.format(' inertia="exact"'))
        found = import_object(tmp_path / "exact.xml")
        assert found.inertial.mass == pytest.approx(6.0, rel=1e-5)
        # a convex mesh has the same inertia in either way
        trimesh.creation.box((0.2,) * 3).export(tmp_path / "box.stl")
        (tmp_path / "box.xml").write_text(model.format("").replace("u.stl", "box.stl"))
        import_object(tmp_path / "box.xml")


def test_geoms_of_unlike_friction_are_remarked_on(tmp_path):
    (tmp_path / "f.xml").write_text(
        '<mujoco><worldbody><body><geom type="box" size=".1 .1 .1" friction="0.3"/>'
        '<geom type="sphere" size=".1" friction="0.9"/></body></worldbody></mujoco>'
    )
    with pytest.warns(UserWarning, match=r"friction 0\.3 to 0\.9; the object has that of the firs"):
        assert import_object(tmp_path / "f.xml").friction == 0.3


def test_a_unit_that_makes_a_giant_is_remarked_on(tmp_path):
    trimesh.creation.box((80.0, 60.0, 90.0)).export(tmp_path / "box.stl")
    with pytest.warns(UserWarning, match=r"90 m long and has 4.32e\+08 kg.*millimetres .* 0.09 m"):
        import_object(tmp_path / "box.stl", density=1000.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        import_object(tmp_path / "box.stl", density=1000.0, unit=1e-3)


def test_an_outline_that_simplifying_makes_cross_itself():
    # a hole of a finger's link, mm, as `simplify` leaves it
    hole = [[6.5706, 22.4038], [6.5191, 23.0467], [6.5018, 23.6911], [6.5422, 22.7557],
            [6.6121, 22.1487], [6.6249, 22.0197]]  # fmt: skip
    crossing = shapely.Polygon(hole)
    assert not crossing.is_valid
    area = simple_polygons(crossing)
    assert area.is_valid and 0.0 < area.area < crossing.convex_hull.area
    assert shapely.box(6.0, 22.0, 7.0, 24.0).difference(shapely.union_all([area])).is_valid


@pytest.mark.parametrize("size", [1e-2, 0.1, 1.0])
def test_how_far_apart_bodies_may_lie_follows_their_size(size):
    def apart(gap):
        boxes = [trimesh.creation.box((size,) * 3) for _ in range(2)]
        boxes[1].apply_translation([size * (1.0 + gap), 0.0, 0.0])
        return union(boxes)

    outline = silhouette(apart(5e-4), "pair")
    np.testing.assert_allclose(np.ptp(outline, axis=0), size * np.array([2.0005, 1.0]), rtol=1e-6)
    with pytest.raises(ValueError, match="pair: it is 2 bodies that lie"):
        silhouette(apart(5e-3), "pair")


def test_a_name_that_looks_like_mathematics_is_drawn(tmp_path):
    name = r"$\frac{1$ <b>"
    gallery({name: cube(0.1, 1.0, name=name)}, tmp_path / "sheet.png", progress=False)
    gallery({name: cube(0.1, 1.0, name=name)}, tmp_path / "sheet.html", progress=False)
    assert "$ &lt;b&gt;</b>" in (tmp_path / "sheet.html").read_text()


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n{}\n0 0.1 0\n0 0 0.1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 {}\n"
)
STL = b"\0" * 80 + struct.pack("<I", 10**9) + b"\0" * 120
GLB = trimesh.creation.box((0.1,) * 3).export(file_type="glb")
BOX_STL = trimesh.creation.box((0.1,) * 3).export(file_type="stl")
OBJ = b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4"
LAUGHS = "".join(f'<!ENTITY a{i + 1} "{f"&a{i};" * 10}">' for i in range(9))
BAD = {
    "beyond.ply": (PLY.format("0.1 0 0", 9).encode(), "faces of vertices 0 to 3, found 0 to 9"),
    "before.ply": (PLY.format("0.1 0 0", -2).encode(), "faces of vertices 0 to 3, found -2 to 3"),
    "nan.ply": (PLY.format("nan 0 0", 3).encode(), "not finite: 1 of 4 vertices"),
    "count.stl": (STL, "expected a mesh of triangles, found 0 points"),
    "truncated.stl": (BOX_STL[:-30], "expected a mesh"),
    "truncated.obj": (OBJ, "expected a mesh, found a file that has none|not watertight"),
    "truncated.glb": (GLB[: len(GLB) // 2], "expected a mesh, found a file that has none"),
    "empty.stl": (b"", "expected a mesh"),
    "laughs.urdf": (
        f'<!DOCTYPE r [<!ENTITY a0 "ha">{LAUGHS}]><robot name="r">&a9;</robot>'.encode(),
        "not an XML file",
    ),
    "outside.urdf": (
        b'<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="r">&x;</robot>',
        "not an XML file",
    ),
    "deep.urdf": (
        b'<robot name="r">' + b"<link>" * 10**5 + b"</link>" * 10**5 + b"</robot>",
        "<link> has no attribute 'name'",
    ),
    "deep.xml": (
        b"<mujoco><worldbody>" + b"<body>" * 10**4 + b"</body>" * 10**4 + b"</worldbody></mujoco>",
        "MuJoCo cannot compile it",
    ),
    "two.urdf": (
        f'<robot name="r"><link name="a">{BOX}</link></robot>'.replace(
            "</geometry>", '<sphere radius="1"/></geometry>'
        ).encode(),
        "link 'a', visual 0: expected a <geometry> with one shape, found 2",
    ),
    "encoding.urdf": (b'<?xml version="1.0" encoding="no-such"?><robot/>', "not an XML file"),
    "flex.xml": (
        b'<mujoco><worldbody><body name="b"><geom size="0.1"/><flexcomp name="cloth" type="grid" '
        b'count="3 3 1" spacing="0.1 0.1 0.1" radius="0.01" rigid="true"/></body></worldbody>'
        b"</mujoco>",
        "flex 'cloth': an object is rigid",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_damaged_and_hostile_files_are_named(name, tmp_path):
    content, message = BAD[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message) as caught:
        import_object(tmp_path / name, mass=1.0)
    assert str(caught.value).count(str(tmp_path / name)) == 1


@pytest.mark.parametrize("content", [PLY.format("nan 0 0", 3), PLY.format("0 inf 0", 3)])
def test_values_that_are_not_finite_are_named_in_collision_shapes_too(content, tmp_path):
    (tmp_path / "nan.ply").write_text(content)
    collision = of_mesh("nan.ply", BOX, "collision")
    (tmp_path / "r.urdf").write_text(collision)
    with pytest.raises(ValueError, match=r"link 'a', collision 0: .*(not finite|flat)"):
        import_object(tmp_path / "r.urdf", mass=1.0)


def test_xml_as_it_is_found(tmp_path):
    text = f'\n\n<?xml version="1.0"?><robot name="r" xmlns="http://ros.org"><link name="a">{BOX}'
    text += "<drake:properties/></link><!-- \xe9 --></robot>"
    (tmp_path / "r.urdf").write_bytes(text.encode("latin-1"))
    assert import_object(tmp_path / "r.urdf", mass=2.0).is_box
