"""Batching: compiled once, order kept, bad pushes contained."""

import jax
import numpy as np
import pytest
from cube_pushes import cubes, push, straight

from mjx_inertia.objects import cuboid, load_mcube_objects
from mjx_inertia.pushing import PushStatus, SceneSettings, build_scene, object_parameters, simulate
from mjx_inertia.pushing.batched_simulation import _programs
from mjx_inertia.pushing.record import SampledMotion


def one_push(parameters, i):
    return jax.tree.map(lambda x: np.asarray(x)[i : i + 1], parameters)


def test_pushes_of_different_duration_share_one_program(scene_of):
    scene = scene_of()
    parameters = cubes(6, seed=11)
    duration = np.array([0.3, 2.0, 0.7, 1.25, 1.26, 0.05])
    motion = straight(parameters, 0.3, 0.04, duration)
    push(scene, parameters, motion)
    run = _programs(scene)[1]
    before = run._cache_size()
    record = push(scene, parameters, motion)
    assert run._cache_size() == before
    np.testing.assert_array_equal(record.length, np.round(duration * 100))
    for i in range(6):  # the batch does not change a push, and results keep their order
        alone = push(scene, one_push(parameters, i), one_push(motion, i))
        n = record.length[i]
        np.testing.assert_allclose(record.force[i, :n], alone.force[0, :n], rtol=1e-3, atol=2e-3)
        np.testing.assert_allclose(record.pose[i, :n], alone.pose[0, :n], atol=2e-5)


def test_each_failure_is_a_status_on_its_push(scene_of):
    scene = scene_of()
    parameters = cubes(5, seed=12)
    motion = straight(parameters, 0.0, 0.04, 2.0)
    start, direction = np.array(motion.start), np.array(motion.direction)
    start[1] += [-0.2, 0.0]  # never reaches the object
    half = np.asarray(parameters.half_extents)[2, 0]
    start[2, 1] = 0.9 * half  # slides off the corner
    direction[2] = [np.cos(0.7), np.sin(0.7)]
    mass = np.array(parameters.mass)
    mass[3] = np.nan
    record = push(
        scene, parameters.replace(mass=mass), motion.replace(start=start, direction=direction)
    )
    expected = [
        PushStatus.OK, PushStatus.NEVER_MOVED, PushStatus.LOST_CONTACT, PushStatus.DIVERGED,
        PushStatus.OK,
    ]  # fmt: skip
    np.testing.assert_array_equal(record.status, expected)
    assert record.length[2] < 200
    clean = push(scene, parameters, motion)
    np.testing.assert_array_equal(record.force[[0, 4]], clean.force[[0, 4]])


def test_signals_are_consistent(scene_of):
    """Velocities are the derivatives of poses; the moment is that of the force at the tip."""
    parameters = cubes(4, seed=13, com_offset=0.1)
    record = push(scene_of(), parameters, straight(parameters, [-0.5, -0.2, 0.2, 0.5], 0.04, 2.0))
    for pose, rate in ((record.pose, record.twist), (record.tip_position, record.tip_velocity)):
        central = (pose[:, 2:] - pose[:, :-2]) * 50
        np.testing.assert_allclose(central[:, 20:], rate[:, 21:-1], atol=2e-3)
    lever = record.tip_position - record.pose[..., :2]
    x, y = np.moveaxis(lever, -1, 0)
    about_origin = x * record.force[..., 1] - y * record.force[..., 0]
    # the tip's centre lies one radius behind the contact, along the force but for friction
    bound = 0.005 * np.linalg.norm(record.force, axis=-1) + 1e-3
    assert (np.abs(about_origin - record.moment) < bound).mean() > 0.99


def test_a_sampled_path_equals_the_straight_one_it_samples(scene_of):
    parameters = cubes(3, seed=14)
    straight_motion = straight(parameters, 0.2, 0.04, 1.0, 0.1)
    knots = np.arange(251) * 0.004
    way = np.asarray(straight_motion.direction)[:, None] * 0.04 * knots[:, None]
    sampled = SampledMotion(
        start=straight_motion.start,
        offsets=way,
        interval=np.full(3, 0.004),
        duration=np.full(3, 1.0),
    )
    a, b = push(scene_of(), parameters, straight_motion), push(scene_of(), parameters, sampled)
    np.testing.assert_allclose(a.pose, b.pose, atol=1e-4)
    np.testing.assert_allclose(a.force[:, 10:], b.force[:, 10:], rtol=0.01, atol=0.02)


@pytest.mark.parametrize("name", ["butter"])
def test_published_outlines_can_be_pushed(name):
    """A prism of any outline, the butterfly by its convex pieces, moves ahead of the tip."""
    obj = load_mcube_objects()[name]
    scene = build_scene(obj, SceneSettings(tip_radius=0.00475))
    parameters = jax.tree.map(lambda x: np.asarray(x)[None], object_parameters(obj, friction=0.2))
    left = obj.outline[:, 0].min()
    motion = straight(parameters, 0.0, 0.05, 1.6).replace(
        start=np.array([[left - 0.00475 - 0.01, 0.001]])
    )
    record = push(scene, parameters, motion)
    assert record.status[0] in (PushStatus.OK, PushStatus.LOST_CONTACT), record.pose[0, ::10]
    steady = record.force[0, 130:160, 0].mean()
    assert 0.5 < steady / (0.2 * float(obj.inertial.mass) * 9.81) < 1.1


def test_misuse_is_named():
    with pytest.raises(ValueError, match="table='ice'"):
        SceneSettings(table="ice")
    with pytest.raises(ValueError, match="rate"):
        SceneSettings(rate=0.0)
    assert SceneSettings(rate=80.0).timestep == pytest.approx(1 / 240)
    assert build_scene(cuboid((0.1, 0.2, 0.05), 1.0)).object_model.is_box
    with pytest.raises(ValueError, match="at least one push"):
        scene = build_scene(cuboid((0.1, 0.2, 0.05), 1.0))
        empty = jax.tree.map(lambda x: np.asarray(x)[:0], cubes(1, seed=0))
        simulate(
            scene,
            empty,
            straight(empty, 0.0, 0.04, 1.0),
            contact_point=np.zeros((0, 2)),
            contact_normal=np.zeros((0, 2)),
        )


BAD = {
    "contact_point": ("contact_point", [np.nan, 0.0]),
    "a far contact_point": ("contact_point", [4.0, 0.0]),
    "no contact_normal": ("contact_normal", [0.0, 0.0]),
    "an outward contact_normal": ("contact_normal", [-1.0, 0.0]),
    "mass": ("mass", -1.0),
    "friction_radius": ("friction_radius", -0.05),
    "tip_time_constant": ("tip_time_constant", 0.0),
    "com": ("com", [10.0, 0.0, 0.05]),
    "direction": ("direction", [2.0, 0.0]),
    "speed": ("speed", -0.1),
    "duration": ("duration", 1e5),
    "an endless duration": ("duration", np.inf),
    "start": ("start", [np.nan, 0.0]),
    "pose": ("pose", [0.0, 9.0, 0.0]),
}


def arguments(n, change=None):
    """Of a call with n pushes; the middle one is changed where `change` is given."""
    parameters = cubes(n, seed=14)
    motion = straight(parameters, 0.2, 0.05, 0.4)
    where = {
        "contact_point": np.asarray(motion.start) + np.array([0.005, 0.0]),
        "contact_normal": np.tile([1.0, 0.0], (n, 1)),
        "pose": np.zeros((n, 3)),
    }
    if change:
        name, value = change
        owners = [vars(parameters), vars(motion), where]
        changed = np.array(next(owner[name] for owner in owners if name in owner))
        changed[n // 2] = value
        if name in where:
            where[name] = changed
        elif name in vars(motion):
            motion = motion.replace(**{name: changed})
        else:
            parameters = parameters.replace(**{name: changed})
    return (parameters, motion), where


@pytest.mark.parametrize("change", BAD.values(), ids=BAD.keys())
def test_a_push_that_cannot_be_leaves_the_others_as_they_are(scene_of, change):
    scene = scene_of()
    expected = simulate(scene, *arguments(3)[0], **arguments(3)[1])
    batch, where = arguments(3, change)
    record = simulate(scene, *batch, **where)
    np.testing.assert_array_equal(record.status, [0, PushStatus.DIVERGED, 0])
    assert np.isnan(record.force[1]).all()
    np.testing.assert_array_equal(record.force[[0, 2]], expected.force[[0, 2]])


@pytest.mark.parametrize("change", BAD.values(), ids=BAD.keys())
def test_a_single_push_that_cannot_be_is_refused_by_name(scene_of, change):
    batch, where = arguments(1, change)
    with pytest.raises(ValueError, match=rf"{change[0]}=.* of push 0: expected") as error:
        simulate(scene_of(), *batch, **where)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["mass", "com", "direction", "duration"])
def test_arrays_of_other_lengths_are_refused_by_name(scene_of, name):
    (parameters, motion), where = arguments(3)
    owner = motion if name in vars(motion) else parameters
    short = {name: getattr(owner, name)[:2]}
    if owner is motion:
        motion = motion.replace(**short)
    else:
        parameters = parameters.replace(**short)
    with pytest.raises(ValueError, match=rf"{name} has shape \(2.*contact_point has 3 rows"):
        simulate(scene_of(), parameters, motion, **where)


def test_a_sampled_path_with_a_leap_is_refused(scene_of):
    (parameters, _), where = arguments(1)
    offsets = np.zeros((1, 30, 2))
    offsets[0, 10:, 0] = 3.0
    motion = SampledMotion(
        start=where["contact_point"] - [0.00501, 0.0],
        offsets=offsets,
        interval=np.array([0.01]),
        duration=np.array([0.3]),
    )
    with pytest.raises(ValueError, match=r"motion.offsets=.*knots that the tip passes"):
        simulate(scene_of(), parameters, motion, **where)
