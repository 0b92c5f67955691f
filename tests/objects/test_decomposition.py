"""Convex pieces of any object: what their union adds, and how many they are."""

import itertools

import manifold3d
import numpy as np
import pytest
import shapely
import trimesh
from simple_parts import cylinder, extrusion, revolution, tube

from mjx_inertia.objects import Part
from mjx_inertia.objects.convex import pieces_error
from mjx_inertia.objects.decomposition import object_pieces
from mjx_inertia.objects.manifolds import from_manifold, union
from mjx_inertia.objects.model import moved, turned


def bare(part):
    """The part without what its construction knows."""
    return Part(part.mesh, part.density)


def decomposed(*parts):
    whole = union(part.mesh for part in parts)
    pieces = object_pieces(parts, whole)
    return pieces, pieces_error(from_manifold(whole), pieces)


def test_a_convex_part_is_one_piece():
    pieces, error = decomposed(
        bare(turned(cylinder(0.05, 0.2, density=1.0), 30.0, (1.0, 1.0, 0.0)))
    )
    assert len(pieces) == 1 and error < 0.02


def test_a_prism_in_any_pose_is_cut_in_the_plane():
    ell = np.array([[0, 0], [0.2, 0], [0.2, 0.05], [0.06, 0.05], [0.06, 0.15], [0, 0.15]])
    part = turned(extrusion(ell, 0.03, density=1.0), 70.0, (1.0, 0.3, 0.2))
    pieces, error = decomposed(bare(part))
    assert len(pieces) == 2 and error < 1e-6


def test_a_turned_vessel_in_any_pose_is_cut_into_sectors():
    profile = np.array([[0, 0], [0.04, 0], [0.04, 0.09], [0.034, 0.09], [0.034, 0.008], [0, 0.008]])
    part = turned(revolution(profile, density=1.0), 50.0, (0.3, 1.0, 0.2))
    pieces, error = decomposed(bare(part))
    assert len(pieces) == 17 and error < 0.15  # 16 sectors of the wall, and the bottom


def test_what_fills_a_part_counts_as_solid():
    """A sleeve around a shaft is no hollow: two bodies are enough."""
    sleeve = moved(tube(0.02, 0.01, 0.1, density=1.0), (0.0, 0.0, 0.05))
    pieces, error = decomposed(cylinder(0.01, 0.2, density=1.0), bare(sleeve))
    assert len(pieces) == 2 and error < 0.01


def test_a_closed_hollow_is_no_hollow():
    outer, inner = trimesh.creation.icosphere(3, 0.05), trimesh.creation.icosphere(3, 0.04)
    shell = Part(trimesh.boolean.difference([outer, inner]), 1.0)
    pieces, error = decomposed(shell)
    assert len(pieces) == 1 and error < 0.02


@pytest.mark.parametrize("seed", range(3))
def test_planes_cut_a_limb_to_two_percent(seed):
    rng = np.random.default_rng(seed)
    steps = rng.uniform([0.02, -0.02, -0.02], [0.04, 0.02, 0.02], (5, 3))
    path = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    balls = [manifold3d.Manifold.sphere(0.012, 24).translate(tuple(p)) for p in path]
    links = [manifold3d.Manifold.batch_hull(list(b)) for b in itertools.pairwise(balls)]
    limb = manifold3d.Manifold.batch_boolean(links, manifold3d.OpType.Add)
    part = Part(from_manifold(limb), 1.0)
    pieces, error = decomposed(part)
    assert len(pieces) <= 48 and error < 0.03
    again, _ = decomposed(part)
    assert all(np.array_equal(a, b) for a, b in zip(pieces, again, strict=True))


def test_pieces_of_a_plate_with_holes():
    plan = shapely.box(0.0, 0.0, 0.3, 0.1)
    for x in (0.08, 0.2):
        plan = plan.difference(shapely.Point(x, 0.05).buffer(0.03, quad_segs=6))
    _, error = decomposed(bare(extrusion(plan, 0.02, density=1.0)))
    assert error < 0.02
