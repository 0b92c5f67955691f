"""Pieces become parts that do not overlap, and come to rest on a face of their hull."""

import numpy as np
import pytest
import trimesh

from mjx_inertia.objects.catalogue.assembly import Piece, assemble, resting_rotation
from mjx_inertia.objects.catalogue.shaping import block, lathe, rod

GREY = (0.5, 0.5, 0.5)


def about(axis, degrees):
    return trimesh.transformations.rotation_matrix(np.radians(degrees), axis)[:3, :3]


def test_the_earlier_piece_keeps_the_place():
    pin, cube = rod((0.0, 0.0, -0.1), (0.0, 0.0, 0.1), 0.01, -1.0, 64), block(0.1, 0.1, 0.05)
    parts = assemble(Piece(pin, 7800.0, GREY), Piece(cube, 700.0, GREY))
    assert parts[0].mesh.volume == pytest.approx(pin.volume(), rel=1e-9)
    assert parts[1].mesh.volume == pytest.approx((cube - pin).volume(), rel=1e-9)
    assert [part.density for part in parts] == [7800.0, 700.0]


def test_pieces_that_touch_are_left_alone():
    lower = block(0.1, 0.1, 0.05)
    parts = assemble(Piece(lower, 700.0, GREY), Piece(lower.translate((0.0, 0.0, 0.05)), 1.0, GREY))
    assert [len(part.mesh.faces) for part in parts] == [12, 12]


def test_a_piece_inside_another_is_refused():
    inner = block(0.02, 0.02, 0.02).translate((0.0, 0.0, 0.02))
    with pytest.raises(ValueError, match="number 1 of 2 has no volume of its own"):
        assemble(Piece(block(0.1, 0.1, 0.1), 1.0, GREY), Piece(inner, 1.0, GREY))


def test_turn_and_scale():
    (part,) = assemble(
        Piece(block(0.1, 0.2, 0.05), 1.0, GREY), turn_deg=(0.0, 0.0, 90.0), scale=2.0
    )
    np.testing.assert_allclose(part.mesh.bounds, [[-0.2, -0.1, 0.0], [0.2, 0.1, 0.1]], atol=1e-12)


@pytest.mark.parametrize("tilt", [0.0, 10.0, 30.0])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0)])
def test_a_tilted_box_falls_back_on_its_face(tilt, axis):
    corners = trimesh.creation.box((0.2, 0.2, 0.1)).vertices
    R_world_box = about(axis, tilt)
    turn = resting_rotation(corners @ R_world_box.T, np.zeros(3))
    np.testing.assert_allclose(turn @ R_world_box @ [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert np.trace(turn) == pytest.approx(1.0 + 2.0 * np.cos(np.radians(tilt)))  # no turn about z


def test_a_body_on_its_tip_falls():
    top = lathe([(0.0, 0.0), (0.03, 0.04), (0.0, 0.05)], 64)
    (part,) = assemble(Piece(top, 700.0, GREY))
    lowest = part.mesh.vertices[part.mesh.vertices[:, 2] < 1e-9]
    assert len(lowest) >= 3
    assert np.ptp(lowest, axis=0).max() == pytest.approx(0.05, rel=0.01)  # the cone's side


def test_a_heavy_side_decides_where_it_rests():
    # a plank that stands on its end stays there with a heavy foot, and falls if its middle is high
    corners = trimesh.creation.box((0.02, 0.1, 0.4)).vertices
    np.testing.assert_allclose(resting_rotation(corners, np.array([0.0, 0.0, -0.15])), np.eye(3))
    fallen = resting_rotation(corners, np.array([0.03, 0.0, 0.0]))  # outside of the foot
    assert abs((fallen @ [0.0, 0.0, 1.0])[2]) < 1e-9
