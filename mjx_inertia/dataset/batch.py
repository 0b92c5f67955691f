"""Stacked pushes with their truth in a field of its own, and splits for training and test.

In: records and what is known about them. Out: `PushBatch`; `Split`s: folds of disjoint row numbers.
Only `fit` on the training split and `evaluation` read the truth.
"""

from dataclasses import dataclass

import numpy as np
from flax import struct
from jaxtyping import Float, Int

from mjx_inertia.pushing import PushRecord, PushSetup
from mjx_inertia.spatial import AnyArray

EXTREME_SHARE = 0.2  # of the pushes of each of the three lightest and three heaviest masses
TEST_SHARE = 0.1  # of all pushes


@struct.dataclass
class PushTruth:
    """True planar inertial parameters."""

    mass: Float[AnyArray, "*n"]  # kg
    inertia: Float[AnyArray, "*n"]  # I_zz about the CoM, kg m²
    # CoM from the first contact point, m: x along the inward contact normal, y to its left
    com: Float[AnyArray, "*n 2"]


@struct.dataclass
class PushConditions:
    """How a push was made: what errors are broken down by, never an input of an estimator."""

    # pushes of one object share it; a grouped split keeps it on one side
    object_id: Int[AnyArray, "*n"]
    friction: Float[AnyArray, "*n"]  # between object and table (NaN where unknown)
    size: Float[AnyArray, "*n"]  # edge length or diameter, m
    speed: Float[AnyArray, "*n"]  # of the tip, m/s
    # of the first contact from the middle of the face, fraction of half the edge
    contact_offset: Float[AnyArray, "*n"]
    angle: Float[AnyArray, "*n"]  # of the tip's path from the inward normal, rad


@struct.dataclass
class PushBatch:
    """Records, truth and conditions with one leading axis, and what was known before the push."""

    records: PushRecord
    truth: PushTruth
    conditions: PushConditions
    setup: PushSetup | None = None


@dataclass(frozen=True)
class Split:
    """A way to part a dataset."""

    name: str  # `thesis`, `grouped` or `leave_one_object_out`
    phrase: str  # ends a sentence about results, such as "on objects never pushed in training"
    description: str  # one sentence for a reader of the results
    # (training rows, test rows); the tests of several folds are pooled
    folds: tuple[tuple[Int[np.ndarray, " a"], Int[np.ndarray, " b"]], ...]


def _fold(test: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.flatnonzero(~test), np.flatnonzero(test)


def thesis_split(mass: Float[np.ndarray, " n"], seed: int) -> Split:
    """A tenth of the pushes, a fifth of them of each extreme mass (errata 2).

    Of 48,000 pushes that is 480 of each of the three lightest and three heaviest masses and 1,920
    of the others. Training and test share the same cubes and differ in the push alone.

    Raises:
      ValueError: with fewer than seven masses there is no middle.
    """
    rng = np.random.default_rng(seed)
    masses = np.unique(mass)
    if len(masses) < 7:
        raise ValueError(f"the thesis split needs seven masses or more; there are {len(masses)}")
    extreme = np.concatenate([masses[:3], masses[-3:]])
    test = np.zeros(len(mass), bool)
    for m in extreme:
        rows = np.flatnonzero(mass == m)
        test[rng.permutation(rows)[: round(EXTREME_SHARE * len(rows))]] = True
    middle = rng.permutation(np.flatnonzero(~np.isin(mass, extreme)))
    test[middle[: max(0, round(TEST_SHARE * len(mass)) - int(test.sum()))]] = True
    return Split(
        "thesis",
        "on new pushes of the same cubes",
        "a tenth of the pushes, the lightest and heaviest cubes over-represented; "
        "the same cubes are pushed in training and test",
        (_fold(test),),
    )


def grouped_split(object_id: Int[np.ndarray, " n"], seed: int, share: float = TEST_SHARE) -> Split:
    """All pushes of a share of the objects: none of the test objects is seen in training."""
    rng = np.random.default_rng(seed)
    objects = rng.permutation(np.unique(object_id))
    chosen = objects[: max(1, round(share * len(objects)))]
    return Split(
        "grouped",
        "on cubes never pushed in training",
        f"all pushes of {len(chosen)} of {len(objects)} cubes; a cube is a mass, a size and a "
        "friction, and this combination is absent from training",
        (_fold(np.isin(object_id, chosen)),),
    )


def bodies_split(
    mass: Float[np.ndarray, " n"],
    size: Float[np.ndarray, " n"],
    seed: int,
    share: float = TEST_SHARE,
) -> Split:
    """All pushes of a share of the bodies, whatever they slide on: no test mass and size is seen.

    The cubes of the `grouped` split are (mass, friction, size), so their mass and size occur in
    training on other tables; here they do not.
    """
    pairs = np.stack([mass, size], 1)
    body = np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1)
    (fold,) = grouped_split(body, seed, share).folds
    return Split(
        "bodies",
        "on masses and sizes never pushed in training, on any table",
        f"all pushes of {share:.0%} of the {body.max() + 1} pairs of mass and size",
        (fold,),
    )


def leave_one_object_out(object_id: Int[np.ndarray, " n"]) -> Split:
    """Each object is predicted from pushes of the others alone.

    Raises:
      ValueError: with fewer than two objects nothing is left to learn from.
    """
    objects = np.unique(object_id)
    if len(objects) < 2:
        raise ValueError(f"leave-one-object-out needs two objects; there are {len(objects)}")
    return Split(
        "leave_one_object_out",
        "on objects never pushed in training",
        f"each of {len(objects)} objects is predicted from pushes of the others alone",
        tuple(_fold(object_id == o) for o in objects),
    )
