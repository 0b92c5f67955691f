"""Splits: sizes as printed, and no leakage."""

import numpy as np
import pytest

from mjx_inertia.dataset import CubesProtocol, cubes_plan
from mjx_inertia.dataset.batch import (
    bodies_split,
    grouped_split,
    leave_one_object_out,
    thesis_split,
)

PLAN = cubes_plan(CubesProtocol(), seed=0)


def test_thesis_split_has_the_sizes_of_errata_2():
    (train, test) = thesis_split(PLAN.truth.mass, seed=0).folds[0]
    assert len(test) == 4800
    assert len(np.intersect1d(train, test)) == 0
    assert len(train) + len(test) == 48_000
    masses, counts = np.unique(PLAN.truth.mass[test].round(3), return_counts=True)
    of = dict(zip(masses.tolist(), counts.tolist(), strict=True))
    assert [of[m] for m in (0.5, 0.737, 0.974, 4.526, 4.763, 5.0)] == [480] * 6
    assert sum(counts) - 6 * 480 == 1920


def test_grouped_split_keeps_each_cube_on_one_side():
    for seed in range(5):
        (train, test) = grouped_split(PLAN.conditions.object_id, seed=seed).folds[0]
        cubes = PLAN.conditions.object_id
        assert not set(cubes[train]) & set(cubes[test])
        assert len(test) == 4800


def test_bodies_split_shares_no_mass_and_size():
    (train, test) = bodies_split(PLAN.truth.mass, PLAN.conditions.size, seed=0).folds[0]
    bodies = np.stack([PLAN.truth.mass, PLAN.conditions.size], 1)
    assert not {*map(tuple, bodies[train])} & {*map(tuple, bodies[test])}
    assert len(test) == 4800


def test_leave_one_object_out_tests_each_push_once_without_its_object():
    objects = np.array([3, 3, 7, 9, 7, 3])
    split = leave_one_object_out(objects)
    tests = np.concatenate([test for _, test in split.folds])
    assert sorted(tests) == list(range(6))
    for train, test in split.folds:
        assert not set(objects[train]) & set(objects[test])


def test_too_little_to_split_is_named():
    with pytest.raises(ValueError, match="seven masses"):
        thesis_split(np.ones(10), seed=0)
    with pytest.raises(ValueError, match="two objects"):
        leave_one_object_out(np.ones(4, int))
