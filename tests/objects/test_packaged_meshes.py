"""Meshes from elsewhere, against trimesh and MeshLab: integrals, and which faces cross."""

import jax
import numpy as np
import pytest
from packaged_meshes import CLEAN, CROSSED, SCRATCHED, packaged_mesh
from solids_of_known_mass import integrals_in_extended_precision, worst_difference

from mjx_inertia.objects import mass_properties
from mjx_inertia.objects.mesh_defects import MeshDefect, crossing_faces, find_defects

pytestmark = pytest.mark.float64

pymeshlab = pytest.importorskip("pymeshlab")


def meshlab(mesh):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.array(mesh.vertices), np.array(mesh.faces)))
    return meshes


@pytest.mark.parametrize("name", CLEAN)
def test_against_trimesh_and_meshlab(name):
    mesh = packaged_mesh(name)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    body = mass_properties(mesh.vertices, mesh.faces)
    by_trimesh = (mesh.volume, mesh.center_mass, mesh.moment_inertia)
    measures = meshlab(mesh).get_geometric_measures()
    by_meshlab = (measures["mesh_volume"], measures["center_of_mass"], measures["inertia_tensor"])
    assert worst_difference(body, *by_trimesh, size) < 1e-10
    assert worst_difference(body, *by_meshlab, size) < 1e-10


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("name", CLEAN[1::6])
def test_scaled_and_far_away(name, scale):
    mesh = packaged_mesh(name)
    size = scale * float(np.ptp(mesh.vertices, axis=0).max())
    vertices = scale * np.asarray(mesh.vertices) + size * np.array([3e3, -1e4, 2e3])
    body = jax.jit(lambda v: mass_properties(v, mesh.faces))(vertices)
    expected = integrals_in_extended_precision(vertices, mesh.faces)
    assert worst_difference(body, *expected, size) < 1e-10


@pytest.mark.parametrize("name", [*CLEAN[:3], *SCRATCHED, *CROSSED])
def test_crossing_faces_are_those_that_meshlab_selects(name):
    """But for a few that touch within the tolerance, of which either takes some for crossing."""
    mesh = packaged_mesh(name)
    local = np.asarray(mesh.vertices - mesh.vertices.mean(axis=0))
    faces = np.asarray(mesh.faces, dtype=np.int64)
    ours = np.unique(crossing_faces(local[faces], faces, 2e-7 * np.abs(local).max()))
    meshes = meshlab(mesh)
    meshes.compute_selection_by_self_intersections_per_face()
    theirs = np.flatnonzero(meshes.current_mesh().face_selection_array())
    assert np.isin(ours, theirs).mean() >= 0.98 if len(ours) else len(theirs) == 0
    assert len(theirs) - len(ours) <= 0.18 * len(theirs)


@pytest.mark.parametrize("name", SCRATCHED)
def test_a_self_intersection_too_small_to_matter_is_a_warning(name):
    mesh = packaged_mesh(name)
    with pytest.warns(UserWarning, match="self-intersecting: .* faces pass through each other"):
        body = mass_properties(mesh.vertices, mesh.faces)
    np.testing.assert_allclose(body.mass, mesh.volume, rtol=1e-12)


@pytest.mark.parametrize("name", CROSSED)
def test_a_larger_one_is_an_error(name):
    mesh = packaged_mesh(name)
    findings = find_defects(mesh.vertices, mesh.faces)
    assert [(f.defect, f.fatal) for f in findings] == [(MeshDefect.SELF_INTERSECTING, True)]
    with pytest.raises(ValueError, match="self-intersecting"):
        mass_properties(mesh.vertices, mesh.faces)
