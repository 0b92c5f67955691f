"""What every object knows: prisms complete themselves, boxes are told from what only looks so."""

import numpy as np
import pytest
import trimesh
from simple_parts import box

from mjx_inertia.objects import ObjectModel, Part, cube, from_parts, load_mcube_objects, prism

BOOT = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.08, 0.1], [0.0, 0.12]])


def test_a_prism_completes_itself():
    model = prism(BOOT, 0.07, 1.0)
    assert model.mesh.is_watertight
    assert model.mesh.volume == pytest.approx(0.07 * model.footprint.area)
    np.testing.assert_allclose(model.mesh.bounds[:, 2], [0.0, 0.07])
    assert len(model.support) == 1 and model.support[0] is model.outline
    (piece,) = model.pieces
    np.testing.assert_allclose(piece[: len(BOOT), :2], model.outline)
    np.testing.assert_allclose(piece[: len(BOOT), 2], 0.0)
    np.testing.assert_allclose(piece[len(BOOT) :, 2], 0.07)
    assert model.pieces_error < 1e-9
    assert model.stability > 0.0


def test_pieces_of_a_smooth_outline_state_their_error():
    butter = load_mcube_objects()["butter"]
    assert len(butter.pieces) > 1 and 0.0 < butter.pieces_error < 0.01


def test_a_wedge_on_a_rectangle_is_no_box():
    corners = [[x, y, z] for x, z in ((0, 0), (0.1, 0), (0, 0.1)) for y in (0, 0.1)]
    wedge = from_parts("wedge", [Part(trimesh.convex.convex_hull(corners), 1.0)])
    assert len(wedge.outline) == 4 and wedge.is_convex and not wedge.is_box
    assert cube(0.1, 1.0).is_box
    assert from_parts("box", [box((0.1, 0.2, 0.3), density=1.0)]).is_box


def test_stability_is_the_distance_to_the_edge():
    assert cube(0.1, 1.0).stability == pytest.approx(0.05)
    assert prism(BOOT, 0.05, 1.0, com=(0.3, 0.02)).stability == pytest.approx(-0.1)


def test_friction_is_checked():
    good = cube(0.1, 1.0)
    with pytest.raises(ValueError, match=r"cube: friction -0\.1"):
        ObjectModel("cube", good.outline, 0.1, good.inertial, friction=-0.1)
