"""Exported objects mean the same to MuJoCo, Pinocchio and yourdfpy as to us."""

import dataclasses
from xml.etree import ElementTree as ET

import jax
import jaxtyping
import manifold3d
import mujoco
import numpy as np
import pinocchio
import pytest
import trimesh
import yourdfpy

from mjx_inertia.objects import cube, export_objects, load_catalogue, prism
from mjx_inertia.objects.__main__ import main

pytestmark = pytest.mark.float64

SAMPLE = ("wedge", "tube", "book", "hammer", "tensor_object")
SUFFIX = {"urdf": ".urdf", "mjcf": ".xml"}


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """Objects by name and the folder that they are exported into."""
    with jax.enable_x64(True):
        objects = load_catalogue(SAMPLE)
        folder = tmp_path_factory.mktemp("export")
        export_objects(objects, folder)
        return objects, folder


def file_of(folder, name, form):
    return folder / name / f"{name}{SUFFIX[form]}"


def compiled(path, from_geometry=False):
    """MuJoCo's model, and mass, CoM and tensor of its body in the frame of the body."""
    spec = mujoco.MjSpec.from_file(str(path))
    if from_geometry:
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    model = spec.compile()
    assert model.nbody == 2
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[1])
    axes = rotation.reshape(3, 3)
    tensor = axes @ np.diag(model.body_inertia[1]) @ axes.T
    return model, (model.body_mass[1], model.body_ipos[1], tensor)


def assert_same_inertia(obj, mass, com, tensor, rtol):
    ours = obj.inertial
    np.testing.assert_allclose(mass, ours.mass, rtol=rtol)
    np.testing.assert_allclose(com, ours.com, rtol=0.0, atol=rtol * obj.half_extents.max())
    np.testing.assert_allclose(
        tensor, ours.inertia, rtol=0.0, atol=rtol * np.abs(ours.inertia).max()
    )


@pytest.mark.parametrize("form", SUFFIX)
@pytest.mark.parametrize("name", SAMPLE)
def test_mujoco_compiles_the_same_body(sample, name, form):
    objects, folder = sample
    obj = objects[name]
    model, body = compiled(file_of(folder, name, form))
    assert_same_inertia(obj, *body, rtol=1e-12)
    touches = (model.geom_contype | model.geom_conaffinity) > 0
    assert np.sum(touches) == len(obj.pieces) and np.sum(~touches) == len(obj.parts)
    np.testing.assert_allclose(
        model.geom_rgba[~touches][:, :3], [part.color for part in obj.parts], atol=1e-6
    )
    if form == "mjcf":
        np.testing.assert_allclose(model.geom_friction[touches, 0], obj.friction)
        assert model.jnt_type.tolist() == [mujoco.mjtJoint.mjJNT_FREE]


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    """As `sample`, of the whole catalogue."""
    with jax.enable_x64(True):
        objects = load_catalogue()
        folder = tmp_path_factory.mktemp("everything")
        export_objects(objects, folder)
        return objects, folder


@pytest.mark.slow
@pytest.mark.parametrize("form", SUFFIX)
def test_mujoco_compiles_every_object(everything, form):
    objects, folder = everything
    assert len(objects) >= 57
    for name, obj in objects.items():
        _, body = compiled(file_of(folder, name, form))
        assert_same_inertia(obj, *body, rtol=1e-6)


@pytest.mark.parametrize("name", SAMPLE)
def test_mujoco_integrates_the_parts_to_the_same_body(sample, name):
    objects, folder = sample
    _, body = compiled(file_of(folder, name, "mjcf"), from_geometry=True)
    assert_same_inertia(objects[name], *body, rtol=1e-6)  # meshes in single precision


@pytest.mark.parametrize("name", SAMPLE)
def test_pieces_in_mujoco_fill_what_ours_fill(sample, name):
    objects, folder = sample
    model, _ = compiled(file_of(folder, name, "mjcf"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    corners = []
    for geom in np.flatnonzero(model.geom_contype):
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
        corners.append(vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    for found, piece in zip(corners, objects[name].pieces, strict=True):
        hull = trimesh.convex.convex_hull(piece).volume
        assert trimesh.convex.convex_hull(found).volume == pytest.approx(hull, rel=1e-4)
        np.testing.assert_allclose(found.mean(axis=0), piece.mean(axis=0), atol=1e-3)
        np.testing.assert_allclose(found.max(axis=0), piece.max(axis=0), atol=1e-6)


@pytest.mark.parametrize("name", SAMPLE)
def test_an_object_let_go_stays_where_it_stands(sample, name):
    objects, folder = sample
    spec = mujoco.MjSpec.from_file(str(file_of(folder, name, "mjcf")))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 200)
    assert np.linalg.norm(data.qpos[:3]) < 0.01 * objects[name].half_extents.max() + 1e-3
    assert 2.0 * np.arccos(min(1.0, abs(data.qpos[3]))) < np.radians(2.0)


def solid_pieces(obj):
    """Without the slivers that rounding left, which are not written."""
    least = 1e-9 * obj.mesh.volume
    hull = manifold3d.Manifold.hull_points
    return [piece for piece in obj.pieces if hull(piece).volume() > least]


def assert_pinocchio_reads(obj, folder):
    path = str(folder / f"{obj.name}.urdf")
    model = pinocchio.buildModelFromUrdf(path, pinocchio.JointModelFreeFlyer())
    body = model.inertias[1]
    assert_same_inertia(obj, body.mass, body.lever, body.inertia, rtol=1e-12)
    shapes = pinocchio.buildGeomFromUrdf(
        model, path, pinocchio.GeometryType.COLLISION, package_dirs=[str(folder)]
    ).geometryObjects
    pieces = solid_pieces(obj)
    assert len(shapes) == len(pieces)
    for shape in shapes:
        shape.geometry.computeLocalAABB()
    low = np.min([shape.geometry.aabb_local.min_ for shape in shapes], axis=0)
    np.testing.assert_allclose(low, np.concatenate(pieces).min(axis=0), rtol=0.0, atol=1e-6)


def assert_yourdfpy_reads(obj, folder):
    urdf = yourdfpy.URDF.load(
        str(folder / f"{obj.name}.urdf"),
        load_collision_meshes=True,
        build_collision_scene_graph=True,
    )
    assert urdf.validate() and not urdf.errors
    (link,) = urdf.robot.links
    body = link.inertial
    assert_same_inertia(obj, body.mass, body.origin[:3, 3], body.inertia, rtol=1e-12)
    pieces = solid_pieces(obj)
    assert len(link.visuals) == len(obj.parts) and len(link.collisions) == len(pieces)
    np.testing.assert_allclose(urdf.scene.bounds, obj.mesh.bounds, rtol=0.0, atol=1e-8)
    corners = np.concatenate(pieces)
    np.testing.assert_allclose(
        urdf.collision_scene.bounds, [corners.min(axis=0), corners.max(axis=0)], rtol=0.0, atol=1e-8
    )


READERS = [assert_pinocchio_reads, assert_yourdfpy_reads]


@pytest.mark.filterwarnings("ignore:You passed package dir")
@pytest.mark.parametrize("reads", READERS)
@pytest.mark.parametrize("name", SAMPLE)
def test_libraries_read_the_same_body(sample, name, reads):
    objects, folder = sample
    reads(objects[name], folder / name)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:You passed package dir")
@pytest.mark.parametrize("reads", READERS)
def test_libraries_read_every_object(everything, reads):
    objects, folder = everything
    for name, obj in objects.items():
        reads(obj, folder / name)


def test_files_say_how_far_the_pieces_are_off(sample):
    objects, folder = sample
    error = objects["tube"].pieces_error
    assert error > 0.0
    note = ET.parse(file_of(folder, "tube", "urdf")).getroot().find("mjx_inertia")
    assert note is not None and float(note.attrib["pieces_error"]) == error
    model, _ = compiled(file_of(folder, "tube", "mjcf"))
    assert model.numeric("tube_pieces_error").data == pytest.approx(error)


def test_meshes_on_disk_give_the_tensor(sample):
    objects, folder = sample
    for i, part in enumerate(objects["hammer"].parts):
        mesh = trimesh.load_mesh(folder / "hammer" / "meshes" / f"part_{i}.obj")
        assert mesh.is_watertight
        scale = np.abs(part.mesh.moment_inertia).max()
        np.testing.assert_allclose(mesh.volume, part.mesh.volume, rtol=1e-9)
        np.testing.assert_allclose(
            mesh.moment_inertia, part.mesh.moment_inertia, rtol=0.0, atol=1e-9 * scale
        )


def test_a_second_export_replaces_the_first(tmp_path):
    boot = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.08, 0.1], [0.07, 0.02], [0.0, 0.12]])
    (first,) = export_objects({"it": prism(boot, 0.1, 1.0)}, tmp_path, "mjcf")
    (tmp_path / "it" / "notes.txt").write_text("mine")
    assert len(list((tmp_path / "it" / "meshes").iterdir())) > 2
    (second,) = export_objects({"it": cube(0.1, 2.0)}, tmp_path, "mjcf")
    assert first == second
    assert {p.name for p in (tmp_path / "it" / "meshes").iterdir()} == {"part_0.obj", "piece_0.obj"}
    assert (tmp_path / "it" / "notes.txt").read_text() == "mine"
    assert compiled(second)[1][0] == pytest.approx(2.0)


def with_nan(**names):
    return {"it": dataclasses.replace(cube(0.1, 1.0), **names)}


def nan_mesh():
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    vertices = np.array(mesh.vertices)
    vertices[3] = np.nan
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def test_objects_without_names(tmp_path):
    jaxtyping.config.update("jaxtyping_disable", True)
    try:
        with pytest.raises(ValueError, match="objects: list; give a mapping from name to object"):
            export_objects([cube(0.1, 1.0)], tmp_path)  # pyright: ignore[reportArgumentType]
    finally:
        jaxtyping.config.update("jaxtyping_disable", False)


@pytest.mark.parametrize(
    ("objects", "formats", "message"),
    [
        (lambda: {}, "urdf", "there are none to export"),
        (lambda: {"it": cube(0.1, 1.0)}, "sdf", r"unknown format 'sdf'; choose from \['urdf', 'mj"),
        (lambda: {"../it": cube(0.1, 1.0)}, "urdf", r"'\.\./it' cannot name a folder"),
        (lambda: with_nan(mesh=nan_mesh()), "urdf", "cube: the mesh of part 0 has vertices that"),
        (lambda: with_nan(pieces=(np.full((8, 3), np.nan),)), "mjcf", "piece 0 has vertices that"),
        (lambda: with_nan(pieces=(np.eye(3),)), "mjcf", "cube: none of its 1 pieces has volume"),
    ],
)
def test_misuse(objects, formats, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        export_objects(objects(), tmp_path / "new", formats)
    assert not list(tmp_path.rglob("*.urdf")) and not list(tmp_path.rglob("*.xml"))


def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OSError, match=r"file: expected a folder to write into, cannot make it"):
        export_objects({"cube": cube(0.1, 1.0)}, tmp_path / "file")
    assert (tmp_path / "file").read_text() == "in the way"


@pytest.fixture
def as_it_was(monkeypatch):
    """The command line sets how JAX runs; a test must not."""
    monkeypatch.setattr("mjx_inertia.runtime.configure", lambda *_, **__: None)


@pytest.mark.usefixtures("as_it_was")
def test_command(tmp_path, capsys):
    assert main(["export", str(tmp_path), "--names", "cube", "--format", "urdf"]) == 0
    assert capsys.readouterr().out == f"1 objects in {tmp_path}\n"
    assert sorted(p.name for p in tmp_path.rglob("*.*")) == [
        "cube.urdf",
        "part_0.obj",
        "piece_0.obj",
    ]


@pytest.mark.usefixtures("as_it_was")
def test_options_stand_before_the_command_or_after_it(tmp_path, capsys):
    for arguments in (
        ["--names=cube", "export", str(tmp_path)],
        ["export", str(tmp_path), "--names", "cube"],
        ["--names=cube", "--category=Primitives", "list"],
        ["--category=Primitives", "list", "--names", "cube"],
    ):
        assert main(arguments) == 0
        assert "1 objects" in capsys.readouterr().out


@pytest.mark.usefixtures("as_it_was")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--names", "cub"], "unknown object 'cub'; did you mean 'cube' or "),
        (
            ["--names", "cube", "export", "{}"],
            "'export' is a command; put --names after the command",
        ),
        (["--category", "Tools", "list"], "'list' is a command; put --category after the command"),
        (["--names", "cube", "--category", "Tools"], "none of ['cube'] is in the category ['Tools"),
        (["export", "{}/file", "--names", "cube"], "file: expected a folder to write into, cannot"),
        (["gallery", "{}/none/all.png", "--names", "cube"], "all.png: expected a folder to write"),
        (
            ["gallery", "{}/all.jpg", "--names", "cube"],
            "all.jpg: expected a name that ends in .png",
        ),
        (
            ["export", "{}", "--format", "sdf"],
            "--format: invalid choice: 'sdf' (choose from 'urdf'",
        ),
        (["draw"], "invalid choice: 'draw' (choose from 'list', 'gallery', 'export')"),
    ],
)
def test_the_command_says_what_is_wrong_in_one_line(tmp_path, capsys, arguments, message):
    (tmp_path / "file").write_text("in the way")
    try:
        status = main([argument.format(tmp_path) for argument in arguments])
    except SystemExit as end:
        status = end.code
    (line,) = capsys.readouterr().err.splitlines()
    assert status == 2 and message in line
