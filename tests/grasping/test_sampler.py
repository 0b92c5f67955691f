"""Sampled grasps touch the object as they should, and their hands overlap it nowhere."""

import dataclasses
import functools

import jax
import numpy as np
import pytest
import trimesh

from mjx_inertia.grasping import (
    BAXTER_GRIPPER,
    PARALLEL_JAW_80MM,
    SamplerSettings,
    SoftFinger,
    sample_grasps,
)
from mjx_inertia.grasping.contact_model import antipodal_margin
from mjx_inertia.grasping.grasp import grasps_at, hand_frames_from_points
from mjx_inertia.grasping.hand_clearance import above_plane, collides
from mjx_inertia.objects import cuboid, load_catalogue

JAW = PARALLEL_JAW_80MM
FRICTION = 0.5


@functools.cache
def mug():
    return load_catalogue("mug")["mug"]


@functools.cache
def mug_grasps():
    return sample_grasps(mug(), JAW, 300, seed=3, friction=FRICTION)


def overlap(obj, gripper, grasps, row, clearance):
    """Volume (m³) that the hand of one grasp shares with the object, by exact booleans."""
    width = float(grasps.width[row])
    opening = np.array([max(width, min(width + 2.0 * clearance, gripper.open_width))])
    pose = np.asarray(grasps.T_obj_hand.as_matrix()[row])
    shared = 0.0
    for center, half in zip(gripper.box_centers(opening)[0], gripper.half_extents, strict=True):
        place = pose @ trimesh.transformations.translation_matrix(center)
        box = trimesh.creation.box(2.0 * half, transform=place)
        shared += trimesh.boolean.intersection([obj.mesh, box], engine="manifold").volume
    return shared


def test_contacts_are_on_the_surface_and_antipodal():
    sample = mug_grasps()
    assert sample.complete and sample.requested == 300
    grasps = sample.grasps
    points = np.asarray(grasps.contacts.points).reshape(-1, 3)
    _, distance, face = mug().mesh.nearest.on_surface(points)
    assert distance.max() < 1e-6
    normals = np.asarray(grasps.contacts.normals).reshape(-1, 3)
    inward = np.sum(mug().mesh.face_normals[face] * normals, axis=1)
    assert np.mean(inward < -0.999) > 0.95  # the rest are at edges, where two faces are nearest
    margin = jax.vmap(lambda pair: antipodal_margin(pair, SoftFinger(FRICTION)))(grasps.contacts)
    assert np.all(np.asarray(margin) > -1e-6)
    width = np.asarray(grasps.width)
    assert np.all((width > 0.0) & (width <= JAW.open_width))


def test_hand_frames_follow_the_convention():
    grasps = mug_grasps().grasps
    points = np.asarray(grasps.contacts.points)
    across = (points[:, 1] - points[:, 0]) / np.asarray(grasps.width)[:, None]
    np.testing.assert_allclose(grasps.closing, across, atol=1e-6)
    np.testing.assert_allclose(grasps.T_obj_hand.translation(), points.mean(axis=1), atol=1e-7)
    matrix = np.asarray(grasps.T_obj_hand.rotation().as_matrix())
    np.testing.assert_allclose(np.linalg.det(matrix), 1.0, atol=1e-6)
    again = grasps_at(points, np.asarray(grasps.contacts.normals), np.asarray(grasps.approach))
    np.testing.assert_allclose(again.approach, grasps.approach, atol=1e-6)


@pytest.mark.long
def test_same_seed_same_grasps():
    again = sample_grasps(mug(), JAW, 300, seed=3, friction=FRICTION).grasps
    other = sample_grasps(mug(), JAW, 300, seed=4, friction=FRICTION).grasps
    np.testing.assert_array_equal(again.contacts.points, mug_grasps().grasps.contacts.points)
    assert not np.array_equal(other.width, again.width)


def test_sampled_hands_share_no_volume_with_the_object():
    shared = [overlap(mug(), JAW, mug_grasps().grasps, row, 0.003) for row in range(40)]
    assert max(shared) < 1e-12


def test_collisions_are_those_of_exact_booleans():
    """Hands at random about the mug, most of which overlap it."""
    rng = np.random.default_rng(0)
    middle = rng.normal(size=(80, 1, 3)) * 0.08
    points = mug().center + middle + rng.normal(size=(80, 2, 3)) * 0.02
    approach = rng.normal(size=(80, 3))
    fitting = np.linalg.norm(points[:, 1] - points[:, 0], axis=1) <= JAW.open_width
    points, approach = points[fitting], approach[fitting]
    grasps = grasps_at(points, np.zeros((len(points), 2, 3)), approach)
    frames = hand_frames_from_points(points, approach)
    hit = collides(mug().mesh, JAW, frames, 0.003)
    shared = np.array([overlap(mug(), JAW, grasps, row, 0.003) for row in range(len(points))])
    assert 5 < np.sum(hit) < len(points) - 3
    np.testing.assert_array_equal(hit, shared > 1e-12)


def test_hand_within_the_solid_and_solid_within_the_hand():
    big, small = cuboid((1.0, 1.0, 1.0), 1.0), cuboid((0.004, 0.004, 0.004), 1.0)
    gripper = dataclasses.replace(JAW, pad_to_tip=0.03)
    points = np.array([[[0.0, -0.02, 0.5], [0.0, 0.02, 0.5]]])
    up = np.array([[0.0, 0.0, 1.0]])
    assert collides(big.mesh, gripper, hand_frames_from_points(points, up), 0.003)[0]
    # a grain in the middle of finger 1, then one between the pads
    aside = hand_frames_from_points(points - [0.0, 0.03, 0.5], up)
    assert collides(small.mesh, gripper, aside, 0.003)[0]
    between = hand_frames_from_points(points - [0.0, 0.0, 0.5], up)
    assert not collides(small.mesh, gripper, between, 0.003)[0]


def frames_of(grasps):
    return hand_frames_from_points(np.asarray(grasps.contacts.points), np.asarray(grasps.approach))


def test_above_the_table():
    settings = SamplerSettings(above_table=True)
    grasps = sample_grasps(mug(), JAW, 100, seed=0, settings=settings).grasps
    frames = frames_of(grasps)
    assert np.all(above_plane(JAW, frames, 0.003))
    assert not np.any(collides(mug().mesh, JAW, frames, 0.003))
    assert np.all((frames.width >= JAW.closed_width) & (frames.width <= JAW.open_width))
    upwards = np.asarray(grasps.approach)[:, 2]
    assert upwards.max() < 0.5  # nothing comes from below
    below = ~above_plane(JAW, frames_of(mug_grasps().grasps), 0.003)
    assert 0 < np.sum(below) < 300


def test_rays_along_the_normal_of_a_sphere_meet_its_far_side():
    ball = load_catalogue("sphere", parameters={"sphere": {"radius": 0.03}})["sphere"]
    settings = SamplerSettings(tilt=0.0)
    grasps = sample_grasps(ball, JAW, 200, seed=0, settings=settings).grasps
    # facets of the mesh lie up to 0.3 % inside the sphere
    np.testing.assert_allclose(grasps.width, 0.06, rtol=0.01)
    middle = np.asarray(grasps.T_obj_hand.translation()) - [0.0, 0.0, 0.03]
    assert np.abs(middle).max() < 0.003


def test_none_or_too_few():
    with pytest.raises(ValueError, match=r"0\.0000 to 0\.0417 m; opposite contacts are 0\.100"):
        sample_grasps(cuboid((0.1, 0.12, 0.14), 1.0), BAXTER_GRIPPER, 10, seed=0)
    settings = SamplerSettings(rays_per_grasp=0)
    with pytest.warns(UserWarning, match="of 200000 grasps"):
        few = sample_grasps(cuboid((0.02, 0.1, 0.1), 1.0), JAW, 200_000, seed=0, settings=settings)
    assert not few.complete
    with pytest.raises(ValueError, match="`count` 0"):
        sample_grasps(mug(), JAW, 0, seed=0)


def test_directions_that_make_no_hand():
    points = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 0.015]]])
    with pytest.raises(ValueError, match="`approach` of grasp 0"):
        hand_frames_from_points(points, np.array([[0.0, 0.0, 2.0]]))


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"finger_width": 0.0}, "finger_width"),
        ({"closed_width": 0.1}, "closed_width"),
        ({"pad_to_tip": 0.2}, "pad_to_tip"),
        ({"palm_size": (0.1, -0.1, 0.1)}, "palm_size"),
    ],
)
def test_impossible_grippers(change, field):
    with pytest.raises(ValueError, match=field):
        dataclasses.replace(JAW, **change)
    with pytest.raises(ValueError, match="`tilt`"):
        SamplerSettings(tilt=2.0)
