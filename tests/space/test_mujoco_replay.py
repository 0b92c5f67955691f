"""Predictions against a simulation in C MuJoCo that gets joint torques only."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from PIL import Image
from planned import consistent, printed

from mjx_inertia.space import disagreement, path, replay, save_animation, servicer_manoeuvre
from mjx_inertia.space.mujoco_replay import ReplaySettings

pytestmark = pytest.mark.long

QUICK = ReplaySettings(step=0.004, samples=100, knots=300)


@functools.cache
def replayed(momentum):
    m = consistent().replace(duration=10.0, momentum=momentum)
    return replay(m, np.array([0.3, -0.2, 0.1, 0.4, -0.3, 0.2]), QUICK)


def test_the_planar_robot_does_what_was_predicted():
    found = replayed("system")
    apart = disagreement(found)
    assert apart.base_place_share < 1e-5
    assert apart.base_turn_share < 1e-5
    assert max(apart.force, apart.moment, *apart.hand_forces, *apart.hand_moments) < 1e-2
    assert max(apart.force, apart.moment) < 1e-3
    assert abs(found.joint_error).max() < 1e-6
    went = np.ptp(found.simulated.T_world_base.translation, 0)
    assert went.max() > 0.01


def test_base_and_object_follow_their_paths():
    found = replayed("system")
    for name in ("T_world_base", "T_world_obj"):
        a, b = (getattr(signals, name) for signals in (found.predicted, found.simulated))
        np.testing.assert_allclose(a.translation, b.translation, rtol=0, atol=1e-6)
        np.testing.assert_allclose(a.rotation, b.rotation, rtol=0, atol=1e-6)


def test_the_simulation_conserves_momentum_and_ends_at_rest():
    found = replayed("system")
    assert abs(found.momentum).max() < 1e-7
    assert found.energy[[0, -1]].max() < 1e-6 * found.energy.max()


def test_a_model_without_the_objects_momentum_is_seen_to_be_wrong():
    apart = disagreement(replayed("robot"))
    assert apart.base_turn_share > 0.05
    assert apart.force > 0.05


def test_a_servicer_in_space_does_what_was_predicted():
    m = servicer_manoeuvre()
    found = replay(m, np.zeros(m.size), dataclasses.replace(QUICK, step=0.01))
    apart = disagreement(found)
    assert max(apart.base_place_share, apart.base_turn_share) < 1e-4
    assert max(apart.force, apart.moment, *apart.hand_forces, *apart.hand_moments) < 1e-2
    assert abs(found.momentum).max() < 1e-5


def test_what_cannot_be_replayed_is_refused():
    with pytest.raises(ValueError, match="hands drift apart"):
        replay(printed(), np.zeros(12), QUICK)
    with pytest.raises(ValueError, match="status is NOT_HELD"):
        replay(consistent(), np.full(6, 9.0), QUICK)
    with pytest.raises(ValueError, match=r"`tau` must ascend .* from 0\.0 to 2\.0"):
        path(consistent(), np.zeros(6), np.array([0.0, 2.0]))
    with pytest.raises(ValueError, match="not all finite"):
        path(consistent(), np.full(6, np.nan), np.array([0.0, 1.0]))
    with pytest.raises(ValueError, match=r"`weld_time` is 1\.0"):
        ReplaySettings(weld_time=1.0)
    with pytest.raises(ValueError, match="`stiffness` is -1"):
        ReplaySettings(stiffness=-1.0)


def test_the_animation_has_its_pictures(tmp_path):
    file = tmp_path / "planar.gif"
    m = consistent()
    drawn = path(m, np.zeros(m.size), np.linspace(0.0, 1.0, 5), total=False)
    save_animation(file, m, drawn)
    with Image.open(file) as film:
        assert film.n_frames == 5
        shown = [np.asarray(film.convert("RGB")) for k in range(5) if film.seek(k) is None]
    assert all((a != b).any() for a, b in itertools.pairwise(shown))
    with pytest.raises(ValueError, match=r"ends in \.gif"):
        save_animation(tmp_path / "planar.mp4", m, drawn)
    with pytest.raises(ValueError, match="`drawn` has 1 times"):
        save_animation(file, m, drawn[:1])
