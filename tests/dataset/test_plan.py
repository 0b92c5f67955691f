"""The protocols: numbers of pushes, ranges, and what a plan says about its pushes."""

import numpy as np
import pytest

from mjx_inertia.dataset import Cubes30Protocol, CubesProtocol, cubes_plan
from mjx_inertia.dataset.plan import cubes30_plan
from mjx_inertia.objects import cube, friction_radius

FULL = cubes_plan(CubesProtocol(), seed=0)


def test_the_full_protocol_is_that_of_errata_1():
    truth, conditions = FULL.truth, FULL.conditions
    assert len(FULL) == 48_000
    assert len(np.unique(conditions.object_id)) == 480
    assert np.unique(conditions.speed).tolist() == [0.01, 0.02, 0.04, 0.06]
    np.testing.assert_allclose(np.unique(truth.mass)[[0, 1, -1]], [0.5, 0.73684, 5.0], atol=1e-5)
    assert [x.min() for x in (conditions.friction, conditions.size)] == [0.2, 0.1]
    assert [x.max() for x in (conditions.friction, conditions.size)] == [0.6, 0.2]
    np.testing.assert_allclose(truth.inertia, truth.mass * conditions.size**2 / 6)
    path = FULL.motion.speed * FULL.motion.duration
    np.testing.assert_allclose(path, 0.15)
    np.testing.assert_allclose(np.linalg.norm(FULL.motion.direction, axis=1), 1.0)
    assert (np.diff(FULL.motion.duration) >= 0).all()


def test_thinned_plan_covers_every_cube_and_shares_out_speeds():
    plan = cubes_plan(CubesProtocol(pushes_per_cube=10), seed=3)
    assert len(plan) == 4800
    _, per_cube = np.unique(plan.conditions.object_id, return_counts=True)
    assert (per_cube == 10).all()
    _, per_speed = np.unique(plan.conditions.speed, return_counts=True)
    assert per_speed.tolist() == [1200] * 4
    rows = np.stack([plan.conditions.object_id, plan.conditions.contact_offset,
                     plan.conditions.angle, plan.conditions.speed], 1)  # fmt: skip
    assert len(np.unique(rows.round(9), axis=0)) == 4800


def test_plan_is_consistent_with_the_object_it_pushes():
    """CoM, contact point and c are those of the cube's own geometry."""
    i = 12_345
    edge = FULL.conditions.size[i]
    obj = cube(edge, FULL.truth.mass[i])
    c = friction_radius(obj.outline, np.zeros(2))
    assert FULL.parameters.friction_radius[i] == pytest.approx(c, rel=1e-5)
    np.testing.assert_allclose(np.diag(obj.inertial.inertia), FULL.parameters.inertia[i], rtol=1e-5)
    np.testing.assert_allclose(FULL.truth.com[i], -FULL.contact_point[i])
    assert FULL.contact_point[i, 0] == -edge / 2
    assert abs(FULL.contact_point[i, 1]) < edge / 2


def test_table_3_1():
    plan = cubes30_plan(Cubes30Protocol(), seed=0)
    assert len(plan) == 300
    assert plan.truth.mass[270] == 1.5
    assert plan.truth.inertia[270] == pytest.approx(1.5 * 0.183**2 / 6)  # errata 3
    run_up = 0.25**2 / (2 * 0.2)
    np.testing.assert_allclose(plan.motion.duration, 1.25 + (0.5 - run_up) / 0.25)


def test_same_seed_same_plan_and_another_seed_another():
    a, b, c = (cubes_plan(CubesProtocol(pushes_per_cube=4), seed=s) for s in (1, 1, 2))
    np.testing.assert_array_equal(a.parameters.tip_friction, b.parameters.tip_friction)
    assert not np.array_equal(a.parameters.tip_friction, c.parameters.tip_friction)


def test_impossible_protocols_are_named():
    with pytest.raises(ValueError, match=r"length=0\.1"):
        cubes_plan(CubesProtocol(length=0.1), seed=0)
    with pytest.raises(ValueError, match="pushes_per_cube=101"):
        cubes_plan(CubesProtocol(pushes_per_cube=101), seed=0)
