"""Configurations that hold the object where it shall be, and what cannot be planned."""

import dataclasses

import jax
import jax.numpy as jnp
import jaxlie
import numpy as np
import planned
import pytest

from mjx_inertia.space import (
    ManoeuvreSettings,
    PlanarSettings,
    end_configuration,
    plan_manoeuvre,
    planar_manoeuvre,
    planar_robot,
)
from mjx_inertia.space.default_manoeuvres import ELBOWS, START, TARGET, planar_pose
from mjx_inertia.space.planar_model import planar_capture
from mjx_inertia.spatial import InertialParameters, Pose

pytestmark = pytest.mark.long

ANGLES = np.linspace(-0.2, 0.2, 9)  # much further it is out of reach


@pytest.fixture(scope="module")
def ends():
    """Joint positions for attitudes of the base, what is left of the way, and their derivatives."""
    m = planned.consistent()

    def end(angle):
        return end_configuration(m, jaxlie.SO3.from_z_radians(angle).as_matrix())

    with jax.enable_x64(True):
        both = jax.jit(jax.vmap(lambda a: (end(a), jax.jvp(end, (a,), (jnp.ones(()),))[1][0])))
        step = np.array([[-1e-5], [0.0], [1e-5]])
        (q, off), slope = both(jnp.asarray((ANGLES + step).ravel()))
    shape = (3, len(ANGLES))
    return np.asarray(q).reshape(*shape, 6), np.asarray(off), np.asarray(slope).reshape(*shape, 6)


def test_the_object_is_at_its_target(ends):
    """By the closed form, the base where the centre of mass at rest leaves it (errata 30)."""
    m, (q, off, _) = planned.consistent(), ends
    assert np.max(off) < 1e-12

    def center(q, theta):
        H = planned.planar_matrices(q, theta, with_object=True).H
        return np.stack([H[..., 1, 2], -H[..., 0, 2]], -1) / H[..., :1, 0]

    base = center(np.asarray(m.q_start), np.zeros(())) - center(q[1], ANGLES)
    held = planned.held_by_hands(planned.planar_matrices(q[1], ANGLES, with_object=False))
    place = base[:, None] + held[..., :2]
    np.testing.assert_allclose(place, np.tile(TARGET[:2], (9, 2, 1)), rtol=0, atol=1e-11)
    turn = planned.wrapped(held[..., 2])
    np.testing.assert_allclose(turn, np.full((9, 2), TARGET[2]), rtol=0, atol=1e-11)
    # the manoeuvre's own end is that of an attitude that has not changed
    np.testing.assert_allclose(q[1, 4], np.asarray(m.q_end), rtol=0, atol=1e-11)


def test_the_start_holds_the_object():
    m = planned.consistent()
    terms = planned.planar_matrices(np.asarray(m.q_start), np.zeros(()), with_object=False)
    held = planned.held_by_hands(terms)
    np.testing.assert_allclose(held[:, :2], np.tile(START[:2], (2, 1)), rtol=0, atol=1e-12)
    assert np.max(np.abs(planned.wrapped(held[:, 2] - START[2]))) < 1e-12


def test_derivative_against_differences(ends):
    q, _, slope = ends
    difference = (q[2] - q[0]) / 2e-5
    scale = np.max(np.abs(difference), 1, keepdims=True)
    assert np.min(scale) > 0.1
    np.testing.assert_allclose(slope[1] / scale, difference / scale, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ((0.0, 6.0, 0.0), r"`T_world_obj` at \[0.0, 6.0, 0.0\] m is out of reach.*\d \(m, rad\)"),
        # half a turn off, the sine of the hands' error vanishes: that is not there yet
        ((*START[:2], np.pi), r"`T_world_obj` at \[0.0, 2.2, 0.0\] m needs 2l at 5.9, outside"),
    ],
)
def test_targets_out_of_reach(target, words):
    with pytest.raises(ValueError, match=words):
        planar_manoeuvre(target=target)


def test_a_start_outside_the_limits():
    tight = PlanarSettings(upper=(1.4, 3.0, 3.0))
    words = r"`T_world_start` at \[0.0, 2.2, 0.0\] m needs 1r at 1.454, outside .* -3 to 1.4"
    with pytest.raises(ValueError, match=words):
        planar_manoeuvre(robot=tight)


def plan(capture=None, settings=None, guess=ELBOWS):
    poses = planar_pose(*START), planar_pose(*TARGET)
    capture = capture or planar_capture()
    return plan_manoeuvre(planar_robot(), capture, *poses, settings, np.array(guess))


def body(mass, moments):
    inertial = InertialParameters(np.asarray(mass), np.zeros(3), np.diag(moments))
    return planar_capture().replace(inertial=inertial)


@pytest.mark.parametrize(
    ("capture", "words"),
    [
        (body(0.0, (1.0, 1.0, 1.0)), "`capture` has a mass of 0.0 kg"),
        (body(np.nan, (1.0, 1.0, 1.0)), "`capture` has a mass of nan kg"),
        (body(3.0, (0.1, 0.1, 1.0)), "`capture` is no body that can be"),
    ],
)
def test_objects_that_cannot_be(capture, words):
    with pytest.raises(ValueError, match=words):
        plan(capture)


def test_leading_joints_and_guesses_that_do_not_fit():
    with pytest.raises(ValueError, match=r"`leading` \(0, 1\) leaves 4 of 6"):
        plan(settings=ManoeuvreSettings(leading=(0, 1)))
    with pytest.raises(ValueError, match=r"`guess` has shape \(3,\)"):
        plan(guess=ELBOWS[:3])


def tilted(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (Pose(np.eye(3), np.array([0.0, 2.2, 0.5])), "not in the plane z = 0"),
        (Pose(tilted(0.5), np.array([0.0, 2.2, 0.0])), "or turned out of it"),
        (Pose(np.diag([1.0, -1.0, 1.0]), np.array([0.0, 2.2, 0.0])), "no rotation"),
        (Pose(np.eye(3), np.array([np.nan, 2.2, 0.0])), "expected finite numbers"),
    ],
)
def test_targets_that_are_no_poses_of_the_plane(target, words):
    with pytest.raises(ValueError, match=words):
        plan_manoeuvre(planar_robot(), planar_capture(), planar_pose(*START), target)


def test_robots_that_cannot_be_planned_for():
    robot, capture, pose = planar_robot(), planar_capture(), planar_pose(*START)
    endless = robot.replace(upper=np.array([3.0, np.inf, 3.0, 3.0, 3.0, 3.0]))
    with pytest.raises(ValueError, match="`robot` has no limits at 2r"):
        plan_manoeuvre(endless, capture, pose, pose)
    light = robot.replace(base=robot.base.replace(mass=np.asarray(-1.0)))
    with pytest.raises(ValueError, match=r"`robot` has masses \[-1\.0"):
        plan_manoeuvre(light, capture, pose, pose)
    for wrong in ((5.0, 4.0), (5.0, 4.0, np.inf)):
        with pytest.raises(ValueError, match="`link_mass` is"):
            PlanarSettings(link_mass=wrong)


def test_single_precision_is_refused():
    with jax.enable_x64(False), pytest.raises(ValueError, match="float64, not float32"):
        plan()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"motion": "free"}, "`motion` is 'free': expected one of consistent, independent"),
        ({"momentum": "none"}, "`momentum` is 'none': expected system or robot"),
        ({"duration": 0.0}, "`duration` is 0.0 s"),
        ({"duration": np.inf}, "`duration` is inf s"),
        ({"nodes": 4}, "`nodes` is 4: expected 8 or more"),
        ({"motion": "independent", "leading": (0, 1, 2)}, "every joint leads"),
    ],
)
def test_settings_that_no_manoeuvre_has(settings, words):
    with pytest.raises(ValueError, match=words):
        ManoeuvreSettings(**settings)


def test_settings_reach_the_manoeuvre():
    m = planned.consistent()
    assert (m.leading, m.following, m.size) == ((0, 1, 2), (3, 4, 5), 6)
    assert m.consistent and m.closure_limit == 1e-6
    free = planned.printed()
    assert (free.leading, free.following, free.size) == (tuple(range(6)), (), 12)
    assert not free.consistent and free.closure_limit is None
    assert dataclasses.astuple(ManoeuvreSettings())[0] == m.duration == free.duration == 50.0
