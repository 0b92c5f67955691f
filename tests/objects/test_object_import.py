"""Files become objects: ours come back as they were, others as MuJoCo and Pinocchio read them."""

import re
import warnings

import jaxtyping
import manifold3d
import mujoco
import numpy as np
import pinocchio
import pytest
import shapely
import trimesh

from mjx_inertia.objects import (
    ObjectModel,
    cube,
    export_objects,
    import_object,
    load_catalogue,
    mass_properties,
    prism,
    random_objects,
)
from mjx_inertia.objects.composition import main_color
from mjx_inertia.objects.convex import hull_vertices
from mjx_inertia.spatial.representations import to_spatial_inertia

pytestmark = pytest.mark.float64

SAMPLE = ("wedge", "tube", "book", "tensor_object")
BOOT = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.08, 0.1], [0.0, 0.12]])


def assert_same_inertia(found: ObjectModel, mass, com, tensor, rtol):
    ours = found.inertial
    np.testing.assert_allclose(ours.mass, mass, rtol=rtol)
    np.testing.assert_allclose(ours.com, com, rtol=0.0, atol=rtol * found.half_extents.max())
    np.testing.assert_allclose(ours.inertia, tensor, rtol=0.0, atol=rtol * np.abs(tensor).max())


def hull_volume(points):
    """By qhull; 0 for a sliver, which it does not take."""
    if manifold3d.Manifold.hull_points(points).volume() == 0.0:
        return 0.0
    return trimesh.convex.convex_hull(points).volume


def assert_same_object(found, obj, tolerance):
    """Equal but for what the formats do not hold; lengths within `tolerance` of the size."""
    body = obj.inertial
    assert_same_inertia(found, body.mass, body.com, body.inertia, rtol=1e-9)
    size = obj.half_extents.max()
    for a, b in ((found.outline, obj.outline), (found.support[0], obj.support[0])):
        apart = shapely.hausdorff_distance(shapely.LinearRing(a), shapely.LinearRing(b))
        assert apart <= tolerance * size
    assert found.height == pytest.approx(obj.height, abs=tolerance * size)
    solid = [piece for piece in obj.pieces if hull_volume(piece) > 1e-9 * obj.mesh.volume]
    for a, b in zip(found.pieces, solid, strict=True):
        assert hull_volume(a) == pytest.approx(hull_volume(b), rel=1e-9)
        for bound in (np.min, np.max):
            np.testing.assert_allclose(bound(a, axis=0), bound(b, axis=0), rtol=0.0, atol=1e-9)
    assert found.mesh.volume == pytest.approx(obj.mesh.volume, rel=1e-6)
    assert found.friction == obj.friction
    assert found.color == (main_color(obj.parts) if obj.parts else obj.color)
    assert (found.category, found.source) == (obj.category, obj.source)


@pytest.mark.parametrize("form", ["urdf", "mjcf"])
@pytest.mark.parametrize("name", SAMPLE)
def test_the_catalogue_comes_back(name, form, tmp_path):
    obj = load_catalogue(name)[name]
    (path,) = export_objects({name: obj}, tmp_path, form)
    found = import_object(path)
    assert found.name == name
    assert_same_object(found, obj, tolerance=1e-9)
    if form == "mjcf":  # which has a place for the density of a part
        for a, b in zip(found.parts, obj.parts, strict=True):
            assert (a.density, a.color) == (b.density, b.color)
            assert a.mesh.volume == pytest.approx(b.mesh.volume, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["urdf", "mjcf"])
def test_all_of_the_catalogue_comes_back(form, tmp_path):
    for name, obj in load_catalogue().items():
        (path,) = export_objects({name: obj}, tmp_path, form)
        assert_same_object(import_object(path), obj, tolerance=1e-8)


@pytest.mark.parametrize("form", ["urdf", "mjcf"])
def test_an_object_without_parts_comes_back(form, tmp_path):
    obj = prism(BOOT, 0.07, 1.3, inertia_zz=0.004, com=(0.09, 0.04))
    (path,) = export_objects({"boot": obj}, tmp_path, form)
    found = import_object(path)
    assert_same_object(found, obj, tolerance=1e-5)
    assert found.parts == ()  # a uniform prism has another tensor


@pytest.mark.parametrize("form", ["urdf", "mjcf"])
def test_random_shapes_come_back(form, tmp_path):
    objects = {f"shape_{i}": obj for i, obj in enumerate(random_objects(3, seed=5))}
    for path, obj in zip(export_objects(objects, tmp_path, form), objects.values(), strict=True):
        assert_same_object(import_object(path), obj, tolerance=1e-5)


def test_uniform_solids_take_their_tensor_from_the_mesh_alone(tmp_path):
    obj = load_catalogue("wedge")["wedge"]
    (path,) = export_objects({"wedge": obj}, tmp_path, "urdf")
    text = path.read_text()
    path.write_text(re.sub(r"<inertial>.*</inertial>", "", text, flags=re.DOTALL))
    body = obj.inertial
    for given in ({"mass": float(body.mass)}, {"density": float(body.mass) / obj.mesh.volume}):
        found = import_object(path, **given)
        assert_same_inertia(found, body.mass, body.com, body.inertia, rtol=1e-6)


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply", ".off"])
def test_mesh_files(suffix, tmp_path):
    mesh = trimesh.creation.icosphere(3)
    mesh.apply_transform(np.diag([0.3, 0.2, 0.1, 1.0])).apply_translation([0.4, -0.2, 0.7])
    exact = mass_properties(mesh.vertices, mesh.faces, 800.0)
    mesh.apply_scale(1e3)
    mesh.export(tmp_path / f"egg{suffix}")
    found = import_object(tmp_path / f"egg{suffix}", density=800.0, unit=1e-3)
    low = 1e-3 * mesh.bounds[0, 2]
    com = np.asarray(exact.com) - [0.0, 0.0, low]
    assert_same_inertia(found, exact.mass, com, exact.inertia, rtol=1e-6)
    np.testing.assert_allclose(found.mesh.bounds[0], [0.1, -0.4, 0.0], rtol=0.0, atol=1e-7)
    assert found.name == "egg" and found.is_convex and found.height == pytest.approx(0.2)
    heavy = import_object(tmp_path / f"egg{suffix}", mass=5.0, unit=1e-3)
    assert_same_inertia(heavy, 5.0, com, exact.inertia * 5.0 / exact.mass, rtol=1e-6)


LINKS = """<robot name="cart">
  <material name="wood"><color rgba="0.5 0.3 0.1 1"/></material>
  <link name="world"/>
  <link name="bed">
    <inertial>
      <origin xyz="0.01 0.02 0.05" rpy="0.4 -0.7 1.1"/>
      <mass value="2"/>
      <inertia ixx="0.02" ixy="0.001" ixz="-0.002" iyy="0.03" iyz="0.0015" izz="0.025"/>
    </inertial>
    <visual>
      <origin xyz="0 0 0.3"/><geometry><box size="0.4 0.2 0.1"/></geometry>
      <material name="wood"/>
    </visual>
  </link>
  <link name="post">
    <inertial>
      <origin xyz="0 0 0.1" rpy="0 0.3 0"/><mass value="0.5"/>
      <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.0006"/>
    </inertial>
    <visual>
      <origin xyz="0 0 0.1"/><geometry><cylinder radius="0.03" length="0.2"/></geometry>
    </visual>
  </link>
  <link name="tip"/>
  <joint name="place" type="floating"><parent link="world"/><child link="bed"/></joint>
  <joint name="stand" type="fixed">
    <origin xyz="0.1 0 0.35" rpy="0.1 0.2 0.3"/><parent link="bed"/><child link="post"/>
  </joint>
  <joint name="end" type="fixed"><parent link="post"/><child link="tip"/></joint>
</robot>"""


def test_links_that_are_fixed_are_one_body(tmp_path):
    (tmp_path / "cart.urdf").write_text(LINKS)
    found = import_object(tmp_path / "cart.urdf")
    single = LINKS.replace('type="floating"', 'type="fixed"')
    (tmp_path / "single.urdf").write_text(single)
    model = pinocchio.buildModelFromUrdf(
        str(tmp_path / "single.urdf"), pinocchio.JointModelFreeFlyer()
    )
    body = model.inertias[1]
    up = [0.0, 0.0, -0.25]  # the underside of the bed comes to z = 0
    assert_same_inertia(found, body.mass, body.lever + up, body.inertia, rtol=1e-12)
    assert found.height > 0.25 and found.color == (0.5, 0.3, 0.1) and len(found.pieces) == 2
    fixed = import_object(tmp_path / "single.urdf")
    assert_same_inertia(fixed, body.mass, body.lever + up, body.inertia, rtol=1e-12)


def test_a_mesh_is_found_in_its_package(tmp_path):
    folder = tmp_path / "things" / "urdf"
    folder.mkdir(parents=True)
    (tmp_path / "things" / "meshes").mkdir()
    trimesh.creation.box((100.0, 200.0, 300.0)).export(tmp_path / "things" / "meshes" / "box.stl")
    text = (
        '<robot name="box"><link name="base"><visual><geometry>'
        '<mesh filename="package://things/meshes/box.stl" scale="0.001 0.001 -0.001"/>'
        "</geometry></visual></link></robot>"
    )
    (folder / "box.urdf").write_text(text)
    found = import_object(folder / "box.urdf", mass=2.0)
    np.testing.assert_allclose(2.0 * found.half_extents, [0.1, 0.2, 0.3])
    assert found.is_box and found.mesh.volume > 0.0
    (folder / "box.urdf").write_text(text.replace("things/meshes", "others/nothing"))
    with pytest.raises(
        FileNotFoundError, match=r"box\.urdf: link 'base', visual 0: expected the m"
    ):
        import_object(folder / "box.urdf", mass=2.0)


MODEL = """<mujoco model="lamp">
  <compiler angle="degree"/>
  <default>
    <geom density="500" friction="0.7 0.01 0.001"/>
    <default class="look">
      <geom rgba="0.2 0.4 0.6 1" contype="0" conaffinity="0" mass="0"/>
    </default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="foot" pos="0.3 0.1 0.05">
      <freejoint/>
      <geom type="cylinder" size="0.1 0.02" pos="0 0 0.02"/>
      <geom class="look" type="cylinder" size="0.1 0.02" pos="0 0 0.02"/>
      <frame pos="0 0 0.3" euler="0 20 0">
        <body name="arm" euler="10 0 30">
          <geom type="capsule" fromto="0 0 -0.3 0 0 0.1" size="0.02"/>
          <geom class="look" type="capsule" fromto="0 0 -0.3 0 0 0.1" size="0.02"/>
          <geom type="ellipsoid" size="0.06 0.05 0.04" pos="0 0 0.12" mass="0.2"/>
          <geom class="look" type="ellipsoid" size="0.06 0.05 0.04" pos="0 0 0.12"/>
        </body>
      </frame>
    </body>
  </worldbody>
</mujoco>"""


def test_bodies_without_joints_are_one_body(tmp_path):
    (tmp_path / "lamp.xml").write_text(MODEL)
    found = import_object(tmp_path / "lamp.xml")
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((6, 6))
    mujoco.mj_fullM(model, data, matrix)
    np.testing.assert_allclose(
        to_spatial_inertia(found.inertial), matrix, rtol=0.0, atol=1e-12 * matrix.max()
    )
    assert found.name == "lamp" and found.friction == 0.7 and found.color == (0.2, 0.4, 0.6)
    assert len(found.pieces) == 3 and found.mesh.is_watertight


def test_inertia_from_geometries_keeps_their_densities(tmp_path):
    text = (
        '<mujoco><worldbody><body name="b"><geom type="box" size="0.1 0.1 0.05" density="700"/>'
        '<geom type="box" size="0.1 0.1 0.02" pos="0 0 0.07" mass="3"/></body></worldbody></mujoco>'
    )
    (tmp_path / "two.xml").write_text(text)
    found = import_object(tmp_path / "two.xml")
    assert [part.density for part in found.parts] == pytest.approx([700.0, 3.0 / 0.0016])
    assert found.height == pytest.approx(0.14) and found.name == "two"
    np.testing.assert_allclose(found.inertial.mass, 700.0 * 0.004 + 3.0)


def test_a_collision_mesh_with_a_notch_is_cut_into_convex_pieces(tmp_path):
    notch = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.05, 0.05], [0.05, 0.2], [0.0, 0.2]])
    trimesh.creation.extrude_polygon(shapely.Polygon(notch), 0.1).export(tmp_path / "l.stl")
    shape = '<geometry><mesh filename="l.stl"/></geometry>'
    body = f"<visual>{shape}</visual><collision>{shape}</collision>"
    (tmp_path / "l.urdf").write_text(f'<robot name="l"><link name="l">{body}</link></robot>')
    found = import_object(tmp_path / "l.urdf", mass=1.0)
    assert len(found.pieces) == 2 and found.pieces_error < 1e-3
    for piece in found.pieces:
        assert len(hull_vertices(piece)) == len(piece)


def open_mesh(path):
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    mesh.update_faces(np.arange(12) != 3)
    mesh.export(path)


def test_collision_shapes_instead_of_an_open_surface(tmp_path):
    open_mesh(tmp_path / "open.stl")
    text = (
        '<robot name="b"><link name="b">'
        '<visual><geometry><mesh filename="open.stl"/></geometry></visual>'
        '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>'
    )
    (tmp_path / "b.urdf").write_text(text)
    message = (
        r"link 'b', visual 0: the mesh is not a solid: not watertight: .*try `repair=True` or the "
    )
    with pytest.raises(ValueError, match=message):
        import_object(tmp_path / "b.urdf", mass=1.0)
    assert import_object(tmp_path / "b.urdf", mass=1.0, shape="collision").is_box
    with pytest.warns(UserWarning, match="link 'b', visual 0 was repaired: not watertight"):
        assert import_object(tmp_path / "b.urdf", mass=1.0, repair=True).is_box


def urdf(inertial='<inertial><mass value="1"/>{}</inertial>', more="", shape="box"):
    tensor = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    return (
        f'<robot name="r"><link name="base">{inertial.format(tensor)}<visual><geometry>'
        f'<{shape} size="1 1 1"/></geometry></visual></link>{more}</robot>'
    )


def mjcf(body):
    return f"<mujoco><worldbody>{body}</worldbody></mujoco>"


def inertia(**entries):
    values = dict(ixx=1, ixy=0, ixz=0, iyy=1, iyz=0, izz=1) | entries
    text = " ".join(f'{key}="{value}"' for key, value in values.items())
    return f'<inertial><mass value="1"/><inertia {text}/></inertial>'


BOX = '<geom type="box" size="1 1 1"/>'
HINGE = (
    '<link name="lid"><inertial><mass value="1"/></inertial></link><joint name="knee" '
    'type="revolute"><parent link="base"/><child link="lid"/></joint>'
)
FAR = (
    f'<link name="far">{inertia()}<visual><geometry><box size="1 1 1"/></geometry></visual></link>'
    '<joint name="rod" type="fixed"><parent link="base"/><child link="far"/>'
    '<origin xyz="5 0 0"/></joint>'
)
BAD_FILES = {
    "text.urdf": ("not a file of shapes", "not an XML file .syntax error"),
    "page.xml": ("<html/>", r"expected the element <robot> \(URDF\) or <mujoco>"),
    "notes.txt": ("abc", r"expected a name that ends in one of \['.urdf'"),
    "broken.stl": ("abc", "expected a mesh"),
    "empty.urdf": ('<robot name="r"/>', "no link with mass or shape among 0 links"),
    "no_inertial.urdf": (urdf(""), r"link 'base' has no <inertial>; give `density` \(kg/m³\)"),
    "no_mass.urdf": (urdf("<inertial>{}</inertial>"), "link 'base': <inertial> needs <mass>"),
    "zero.urdf": (urdf(inertia().replace('"1"', '"0"', 1)), "link 'base': mass must be positive"),
    "negative.urdf": (
        urdf(inertia().replace('"1"', '"-2"', 1)),
        "link 'base': mass must be positive, but is -2 kg",
    ),
    "nan.urdf": (urdf(inertia(iyy="nan")), "<inertia iyy>: expected one finite number, found 'na"),
    "words.urdf": (urdf(inertia(iyy="a b")), "<inertia iyy>: expected one finite number, found"),
    "flat.urdf": (urdf(inertia(izz=3)), "link 'base': no body has principal moments 1, 1, 3"),
    "twice.urdf": (urdf(more='<link name="base"/>'), "two links have the name 'base'"),
    "two_inertials.urdf": (
        urdf(inertia() + inertia()),
        "link 'base' has 2 elements <inertial>, expected one",
    ),
    "far_apart.urdf": (
        urdf(more=FAR),
        "r: it is 2 bodies that lie 4e[+]03 mm apart as seen from above",
    ),
    "cone.urdf": (urdf(shape="cone"), "link 'base', visual 0: unknown shape <cone>"),
    "hinge.urdf": (urdf(more=HINGE), r"joint 'knee' moves \(revolute\)"),
    "apart.urdf": (
        urdf(more=HINGE[: HINGE.index("<joint")]),
        "links 'base' and 'lid' are not joined",
    ),
    "child.urdf": (
        urdf(more=HINGE.replace('link="lid"', 'link="lit"')),
        "joint 'knee': its child 'lit' is none of the links",
    ),
    "hinge.xml": (
        mjcf(f'<body name="a"><joint name="knee"/>{BOX}</body>'),
        r"joint 'knee' moves \(hinge\)",
    ),
    "nothing.xml": (mjcf(BOX), "expected one body in the world, found 0"),
    "two.xml": (
        mjcf(f'<body name="a">{BOX}</body><body name="b">{BOX}</body>'),
        r"expected one body in the world, found 2: \['a', 'b'\]",
    ),
    "flat.xml": (
        mjcf(f'<body><inertial pos="0 0 0" mass="1" diaginertia="1 1 3"/>{BOX}</body>'),
        "MuJoCo cannot compile it: .*A \\+ B >= C",
    ),
    "zero.xml": (
        mjcf(f'<body><inertial pos="0 0 0" mass="0" diaginertia="1 1 1"/>{BOX}</body>'),
        "mass must be positive, but is 0 kg",
    ),
    "plane.xml": (
        mjcf('<body name="a"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
             '<geom type="plane" size="1 1 1"/></body>'),
        "body 'a', geom 0: a plane bounds no solid",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_named(name, tmp_path):
    text, message = BAD_FILES[name]
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        import_object(tmp_path / name)
    assert str(caught.value).count(str(tmp_path / name)) == 1


def test_inertia_that_the_shape_cannot_have_is_warned_of(tmp_path):
    (tmp_path / "b.urdf").write_text(urdf(inertia(ixx=0.17, iyy=0.17, izz=0.17)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        import_object(tmp_path / "b.urdf")
    (tmp_path / "b.urdf").write_text(urdf(inertia()))
    with pytest.warns(UserWarning, match="a radius of gyration of 1.22 m, but no point .* 0.866 m"):
        import_object(tmp_path / "b.urdf")
    beside = inertia().replace("<mass", '<origin xyz="2 0 0"/><mass')
    (tmp_path / "b.urdf").write_text(urdf(beside))
    with pytest.warns(UserWarning, match=r"CoM \[2.0, 0.0, 0.5\] m is 1.5 m outside of the convex"):
        import_object(tmp_path / "b.urdf")


def test_the_unit_that_a_file_states(tmp_path):
    trimesh.creation.box((100.0, 100.0, 100.0)).export(tmp_path / "box.3mf")
    stated = import_object(tmp_path / "box.3mf", density=1000.0)
    assert float(stated.inertial.mass) == pytest.approx(1.0)
    given = import_object(tmp_path / "box.3mf", density=1000.0, unit=0.01)
    assert float(given.inertial.mass) == pytest.approx(1000.0)


@pytest.fixture
def without_type_checks():
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.mark.usefixtures("without_type_checks")
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "a mesh has no mass; give `density`"),
        ({"density": -1.0}, r"density: -1\.0 is not positive"),
        ({"mass": np.nan}, "mass: nan is not positive"),
        ({"mass": 0.0}, r"mass: 0\.0 is not positive"),
        ({"mass": 1.0, "density": 2.0}, "give one of them"),
        ({"mass": 1.0, "unit": 0.0}, r"unit: 0\.0 is not positive"),
        (
            {"mass": 1.0, "shape": "box"},
            r"shape: 'box'; choose one of \['visual', 'collision', 'hull'",
        ),
    ],
)
def test_bad_arguments_are_named(given, message, tmp_path):
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "box.stl")
    with pytest.raises(ValueError, match=message):
        import_object(tmp_path / "box.stl", **given)


def test_parameters_of_no_body_matter_only_where_they_are_used(tmp_path):
    (tmp_path / "still.urdf").write_text(BAD_FILES["zero.urdf"][0])
    np.testing.assert_allclose(import_object(tmp_path / "still.urdf", mass=3.0).inertial.mass, 3.0)


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nowhere\.urdf: expected a URDF, MJCF or mesh fi"):
        import_object(tmp_path / "nowhere.urdf")
    with pytest.raises(FileNotFoundError, match="found a folder"):
        import_object(tmp_path)
    (path,) = export_objects({"cube": cube(0.1, 1.0)}, tmp_path, "urdf")
    (tmp_path / "cube" / "meshes" / "part_0.obj").unlink()
    with pytest.raises(FileNotFoundError, match=r"expected the mesh 'meshes/part_0\.obj' at "):
        import_object(path)


def test_open_and_crossing_meshes_are_named(tmp_path):
    open_mesh(tmp_path / "open.stl")
    with pytest.raises(
        ValueError,
        match=r"open\.stl: the mesh: .*not watertight.*; try `repair=True` or the convex hull .*$",
    ):
        import_object(tmp_path / "open.stl", mass=1.0)
