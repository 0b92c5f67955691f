"""Each defect by its name, no defect in sound meshes, and what repair makes of them."""

import re

import jaxtyping
import numpy as np
import pytest
import trimesh

from mjx_inertia.objects import mass_properties
from mjx_inertia.objects.mesh_defects import MeshDefect, find_defects
from mjx_inertia.objects.mesh_repair import repair_mesh

pytestmark = pytest.mark.float64


def cube(edge=1.0, at=(0.0, 0.0, 0.0)):
    return trimesh.creation.box((edge, edge, edge)).apply_translation(at)


def inverted(mesh):
    mesh = mesh.copy()
    mesh.invert()
    return mesh


def together(*meshes):
    return trimesh.util.concatenate(list(meshes))


def without_face():
    mesh = cube()
    mesh.update_faces(np.arange(12) != 3)
    return mesh


def with_turned_face():
    mesh = cube()
    faces = np.array(mesh.faces)
    faces[4] = faces[4][::-1]
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def with_nan():
    vertices = np.array(cube().vertices)
    vertices[3] = np.nan
    return trimesh.Trimesh(vertices, cube().faces, process=False)


def flat():
    mesh = trimesh.Trimesh(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]],
        process=False,
    )
    return mesh.apply_transform(trimesh.transformations.random_rotation_matrix(np.full(3, 0.3)))


def figure_of_eight():
    """A tube along a figure of eight, thicker than the gap where it passes over itself."""
    mesh = trimesh.creation.torus(1.0, 0.2, 96, 24)
    vertices = np.array(mesh.vertices)
    t = np.arctan2(vertices[:, 1], vertices[:, 0])
    across, up = np.hypot(vertices[:, 0], vertices[:, 1]) - 1.0, vertices[:, 2]
    along = np.stack([-np.sin(t), np.cos(2 * t)], axis=1)
    normal = along[:, ::-1] * [1.0, -1.0] / np.linalg.norm(along, axis=1, keepdims=True)
    center = np.stack([np.cos(t), 0.5 * np.sin(2 * t)], axis=1)
    vertices[:, :2] = center + across[:, None] * normal
    vertices[:, 2] = up + 0.1 * np.sin(t)
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def hole_in_a_ball():
    mesh = trimesh.creation.icosphere(3)
    mesh.update_faces(mesh.triangles_center[:, 2] < 0.95)
    return mesh


BAD = {
    "empty": (lambda: trimesh.Trimesh(np.zeros((0, 3)), np.zeros((0, 3), int)), MeshDefect.EMPTY),
    "nan": (with_nan, MeshDefect.NOT_FINITE),
    "face missing": (without_face, MeshDefect.NOT_WATERTIGHT),
    "hole": (hole_in_a_ball, MeshDefect.NOT_WATERTIGHT),
    "face turned": (with_turned_face, MeshDefect.INCONSISTENT_WINDING),
    "flat": (flat, MeshDefect.NO_VOLUME),
    "inverted": (lambda: inverted(cube()), MeshDefect.INVERTED),
    "part inverted": (
        lambda: together(cube(), inverted(cube(0.5, (2.0, 0.0, 0.0)))),
        MeshDefect.INVERTED_PART,
    ),
    "crossing cubes": (
        lambda: together(cube(), cube(1.0, (0.4, 0.3, 0.2))),
        MeshDefect.SELF_INTERSECTING,
    ),
    "crossing bars": (
        lambda: together(
            trimesh.creation.box((3.0, 0.5, 0.5)), trimesh.creation.box((0.4, 3.0, 0.4))
        ),
        MeshDefect.SELF_INTERSECTING,
    ),
    "edges on diagonals": (
        lambda: together(cube(), cube(1.0, (0.5, 0.5, 0.5))),
        MeshDefect.OVERLAPPING,
    ),
    "nested": (lambda: together(cube(), cube(0.5)), MeshDefect.OVERLAPPING),
    "twice": (lambda: together(cube(), cube()), MeshDefect.OVERLAPPING),
    "through itself": (figure_of_eight, MeshDefect.SELF_INTERSECTING),
}

SOUND = {
    "cube": cube,
    "soup": lambda: trimesh.Trimesh(
        cube().triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False
    ),
    "cavity": lambda: together(cube(), inverted(cube(0.5))),
    "ball in a cavity": lambda: together(cube(), inverted(cube(0.5)), cube(0.2)),
    "apart": lambda: together(cube(), cube(1.0, (3.0, 0.0, 0.0))),
    "stacked": lambda: together(cube(), cube(1.0, (0.0, 0.0, 1.0))),
    "stacked with overhang": lambda: together(cube(), cube(1.0, (0.3, 0.2, 1.0))),
    "edge on edge": lambda: together(cube(), cube(1.0, (1.0, 1.0, 0.0))),
    "corner on corner": lambda: together(cube(), cube(1.0, (1.0, 1.0, 1.0))),
    "thin plate": lambda: trimesh.creation.box((1.0, 1.0, 1e-5)),
    "torus": lambda: trimesh.creation.torus(1.0, 0.3),
    "slivers": lambda: trimesh.creation.cylinder(0.1, 1.0, sections=96),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_meshes_are_named_and_refused(name):
    make, defect = BAD[name]
    mesh = make()
    findings = find_defects(mesh.vertices, mesh.faces)
    assert [f.defect for f in findings if f.fatal][:1] == [defect]
    with pytest.raises(ValueError, match=f"the mesh is not a solid: {re.escape(defect.value)}: "):
        mass_properties(mesh.vertices, mesh.faces)


@pytest.mark.parametrize("scale", [1e-3, 1.0])
@pytest.mark.parametrize("name", SOUND)
def test_sound_meshes_have_no_defects(name, scale):
    mesh = SOUND[name]()
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.8, 0.4]))
    for matrix in (np.eye(4), turn):
        moved = mesh.copy().apply_transform(matrix).apply_scale(scale)
        assert find_defects(moved.vertices, moved.faces) == ()
        np.testing.assert_allclose(
            mass_properties(moved.vertices, moved.faces).mass, scale**3 * mesh.volume, rtol=1e-9
        )


@pytest.mark.parametrize("name", SOUND)
def test_rounding_of_a_file_in_single_precision_is_no_defect(name):
    mesh = SOUND[name]()
    mesh.apply_transform(trimesh.transformations.random_rotation_matrix(np.full(3, 0.3)))
    vertices = np.asarray(mesh.vertices, np.float32)
    assert not any(f.fatal for f in find_defects(vertices, mesh.faces))


@pytest.mark.parametrize(
    ("name", "volume"),
    [
        ("face missing", 1.0),
        ("face turned", 1.0),
        ("inverted", 1.0),
        ("part inverted", 1.125),
        ("crossing cubes", 2.0 - 0.6 * 0.7 * 0.8),
        ("crossing bars", 3.0 * 0.25 + 2.5 * 0.16),
        ("edges on diagonals", 1.875),
        ("nested", 1.0),
        ("twice", 1.0),
    ],
)
def test_repair(name, volume):
    make, defect = BAD[name]
    mesh = make()
    repaired = repair_mesh(mesh.vertices, mesh.faces)
    assert repaired.remedied[0].defect is defect
    assert find_defects(repaired.vertices, repaired.faces) == ()
    np.testing.assert_allclose(
        mass_properties(repaired.vertices, repaired.faces).mass, volume, rtol=1e-9
    )


def test_repair_closes_a_hole_and_says_so():
    mesh = hole_in_a_ball()
    repaired = repair_mesh(mesh.vertices, mesh.faces)
    assert [f.defect for f in repaired.remedied] == [MeshDefect.NOT_WATERTIGHT]
    whole = trimesh.creation.icosphere(3).volume
    assert 0.98 * whole < mass_properties(repaired.vertices, repaired.faces).mass < whole


def test_repair_keeps_a_cavity_while_it_turns_another_body():
    mesh = together(cube(), inverted(cube(0.5)), inverted(cube(0.5, (3.0, 0.0, 0.0))))
    repaired = repair_mesh(mesh.vertices, mesh.faces)
    np.testing.assert_allclose(mass_properties(repaired.vertices, repaired.faces).mass, 1.0)


@pytest.mark.parametrize("name", ["flat", "through itself", "empty"])
def test_repair_admits_defeat(name):
    make, defect = BAD[name]
    mesh = make()
    with pytest.raises(ValueError, match=f"cannot be repaired: {defect.value}"):
        repair_mesh(mesh.vertices, mesh.faces)


def test_a_small_defect_is_a_warning_and_a_degenerate_face_a_note():
    mesh = together(cube(), cube(0.01))
    with pytest.warns(UserWarning, match="overlapping"):
        mass_properties(mesh.vertices, mesh.faces)
    faces = np.concatenate([cube().faces, [[0, 0, 1], [2, 2, 2]]])
    (finding,) = find_defects(cube().vertices, faces)
    assert finding.defect is MeshDefect.DEGENERATE_FACE and not finding.fatal
    np.testing.assert_allclose(mass_properties(cube().vertices, faces).mass, 1.0)


@pytest.fixture
def without_type_checks():
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.mark.usefixtures("without_type_checks")
@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((8, 2)), cube().faces, "`vertices` has shape"),
        (cube().vertices, np.zeros((6, 4), int), "divide polygons into triangles"),
        (cube().vertices, np.asarray(cube().faces, float), "expected integers"),
        (cube().vertices, np.asarray(cube().faces) + 1, "missing vertex: faces name vertices 1"),
    ],
)
def test_misuse(vertices, faces, message):
    with pytest.raises(ValueError, match=message):
        mass_properties(vertices, faces)
