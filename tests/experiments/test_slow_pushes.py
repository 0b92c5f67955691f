"""CoM of real objects from many slow pushes; the measurements are a subset of what there is."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.estimators import WrenchTwistGuess, com_from_wrench_twist
from mjx_inertia.objects import load_mcube_objects
from parts.quasistatic_files import load_block, load_quasistatic

pytestmark = pytest.mark.long

ROWS = 400  # of each set: a hundred would do


def com_of(sets):
    guess = WrenchTwistGuess(jnp.zeros(2))
    fit = jax.jit(jax.vmap(com_from_wrench_twist, in_axes=(0, 0, 0, None)))
    loads, twists = (
        jnp.asarray([getattr(s, name)[:ROWS] for s in sets], jnp.float32)
        for name in ("load", "twist")
    )
    return np.asarray(fit(loads, twists, jnp.ones(loads.shape[:2]), guess).com)


def test_quasistatic_sets(measurements):
    file = measurements / "mcube_quasistatic.npz"
    if not file.is_file():
        pytest.skip("no mcube_quasistatic.npz among the measurements")
    objects = load_mcube_objects()
    sets = load_quasistatic(file, objects)
    # Where the sensor is dead, force and motion point in unrelated directions.
    for pushes in sets:
        force, velocity = pushes.load[:, :2], pushes.twist[:, :2]
        along = np.sum(force * velocity, axis=1) > 0.0
        assert (along.mean() > 0.9) == pushes.live
    slow = [s for s in sets if s.live and s.speed <= 0.01 and len(s.load) >= ROWS]
    assert len(slow) >= 15
    truth = np.array([np.asarray(objects[s.shape].inertial.com)[:2] for s in slow])
    error = np.linalg.norm(com_of(slow) - truth, axis=1)
    assert np.median(error) < 4e-3
    assert np.mean(error < 6e-3) > 0.7


def test_three_point_block(measurements):
    files = sorted((measurements / "three_point_block").glob("*.npz"))
    if not files:
        pytest.skip("no three_point_block among the measurements")
    outline = np.array([[0.0, 0.0], [0.15, 0.0], [0.0, 0.15]])
    blocks = [load_block(file, outline) for file in files]
    least = min(len(b.load) for b in blocks)
    assert least >= 40
    for block in blocks:
        assert np.median(np.hypot(*block.load[:, :2].T)) == pytest.approx(3.6, abs=1.2)
    cut = [type(b)(b.surface, b.shape, b.speed, b.load[:least], b.twist[:least]) for b in blocks]
    error = np.linalg.norm(com_of(cut) - 0.05, axis=1)
    assert error.max() < 0.012
