"""`sysid`: the parameters whose simulation gives the measured signals.

In: the signals of pushes (`Examples.records`) and what was known before them (`setup`, `shapes`).
The latter includes the outline of the object, which the learned estimators do not get. Out:
`Estimate`.
"""

import dataclasses
import functools
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int
from tqdm import tqdm

from mjx_inertia.estimators.boosted_trees import BoostedSettings, FittedBoosted, boosted
from mjx_inertia.estimators.estimate import Estimate, EstimateStatus, Estimator, KeyArray
from mjx_inertia.estimators.sysid.normal_equations import DIVERGED
from mjx_inertia.estimators.sysid.observation import SysidProblem, observed
from mjx_inertia.estimators.sysid.two_stage_fit import Fit, fit
from mjx_inertia.estimators.sysid.unknowns import (
    SysidSettings,
    bounds,
    from_planar_values,
    planar_values,
)
from mjx_inertia.features import Examples, take_examples
from mjx_inertia.objects import ObjectModel, prism
from mjx_inertia.pushing import PushRecord, PushSetup, PushStatus, build_scene
from mjx_inertia.spatial import AnyArray

_DEFAULT = SysidSettings()
_AT_BOUND = 0.05  # closer to a bound than this, in standard deviations of the belief


@struct.dataclass
class FittedSysid:
    """The estimator of the start of the search; None if the search starts at the prior mean."""

    start: FittedBoosted | None  # fitted `boosted`


class Identified(NamedTuple):
    """The pushes of one object."""

    rows: Int[np.ndarray, " m"]  # of the examples
    examples: Examples  # these rows, in double precision
    centroid: Float[np.ndarray, "2"]  # of the outline, object frame, m
    problem: SysidProblem
    fit: Fit  # what was found


def _starts(
    fitted: FittedSysid, examples: Examples, settings: SysidSettings, centroids: np.ndarray
) -> Float[Array, "n p"]:
    n, p = np.asarray(examples.status).size, len(settings.estimated)
    middle = jnp.zeros((n, p))
    if fitted.start is None:
        return middle
    assert examples.records is not None and examples.setup is not None
    with jax.enable_x64(False):
        guess = np.asarray(boosted().predict(fitted.start, examples).mean, float)
    record = examples.records
    return jax.vmap(partial(from_planar_values, settings=settings))(
        jnp.asarray(guess),
        middle,
        examples.setup,
        jnp.asarray(centroids),
        jnp.asarray(record.contact_point, float),
        jnp.asarray(record.contact_normal, float),
    )


def _status(found: Fit, settings: SysidSettings, relative_mass: np.ndarray) -> np.ndarray:
    """What became of each fit, the gravest last."""
    search = found.search
    low, high = (np.asarray(b) for b in bounds(settings))
    body = [n in ("mass", "inertia", "com_x", "com_y") for n in settings.estimated]
    z = np.asarray(search.z)
    near = np.any(((z < low + _AT_BOUND) | (z > high - _AT_BOUND))[:, body], axis=1)
    status = np.full(len(z), int(EstimateStatus.OK), np.int32)
    status[near] = EstimateStatus.AT_BOUND
    status[~np.asarray(found.fits)] = EstimateStatus.NOT_CONVERGED
    status[~(relative_mass < settings.identifiable)] = EstimateStatus.NOT_IDENTIFIABLE
    status[~(search.cost < DIVERGED)] = EstimateStatus.DIVERGED
    return status


def planar_estimates(
    found: Fit,
    record: PushRecord,
    setup: PushSetup,
    centroid: Float[AnyArray, "2"],
    settings: SysidSettings,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, covariance and status of fitted bodies, in double precision where that is on.

    A row is a body: its fit, and one of its pushes, from whose contact point the CoM counts.
    `centroid` is that of the outline, object frame, m.
    """

    def one(z: Array, setup: PushSetup, point: Array, normal: Array) -> tuple[Array, Array]:
        args = (setup, jnp.asarray(centroid), point, normal, settings)
        return planar_values(z, *args), jax.jacfwd(planar_values)(z, *args)

    mean, slope = jax.vmap(one)(
        jnp.asarray(found.search.z),
        setup,
        jnp.asarray(record.contact_point, float),
        jnp.asarray(record.contact_normal, float),
    )
    # a model that misses the signals by more than their noise is less certain than its information
    excess = np.maximum(np.where(np.isfinite(found.misfit), found.misfit, 1.0), 1.0)
    inflated = found.known.covariance * excess[:, None, None]
    covariance = np.einsum("nij,njk,nlk->nil", slope, inflated, slope)
    mean = np.asarray(mean)
    relative = np.sqrt(covariance[:, 0, 0]) / mean[:, 0]
    return mean, covariance, _status(found, settings, relative)


# a scene that is kept keeps its compiled programs
_scene = functools.lru_cache(maxsize=64)(build_scene)


def identify_examples(
    fitted: FittedSysid, examples: Examples, settings: SysidSettings, *, key: KeyArray
) -> list[Identified]:
    """Identifies all pushes, object by object.

    Raises:
      ValueError: examples without signals or without what was known before the pushes.
    """
    if examples.records is None or examples.setup is None or not examples.shapes:
        raise ValueError(
            "sysid needs the signals, the setup and the outlines: extract the examples with "
            "keep_records=True and shapes, from batches that have a setup"
        )
    results = []
    shape = np.asarray(examples.setup.shape)
    total = len(shape)
    with (
        jax.enable_x64(True),
        tqdm(total=total, unit="push", desc="sysid", disable=not settings.progress) as bar,
    ):
        for number in np.unique(shape):
            rows = np.flatnonzero(shape == number)
            obj = examples.shapes[int(number)]
            mine = _with_uniform_density(settings, obj) if settings.uniform_density else settings
            part = _double(take_examples(examples, rows))
            assert part.setup is not None and part.records is not None
            centroid = np.asarray(obj.center[:2], float)
            start = _starts(fitted, part, mine, np.tile(centroid, (len(rows), 1)))
            scene, observation = _scene(obj, mine.scene), observed(part.records, mine)
            problem = SysidProblem.of(scene, observation, part.setup, mine, centroid=centroid)
            own = jax.random.fold_in(key, int(number))
            found = fit(problem, np.asarray(start), key=own, report=bar.set_postfix_str)
            bar.update(len(rows))
            results.append(Identified(rows, part, centroid, problem, found))
    return results


def _with_uniform_density(settings: SysidSettings, obj: ObjectModel) -> SysidSettings:
    """Beliefs centred at the I_zz and CoM of a uniform plate of the object's outline."""
    plate = prism(obj.outline, obj.height, 1.0).inertial
    half = np.asarray(obj.half_extents)
    box = (half[0] ** 2 + half[1] ** 2) / 3.0
    com = (np.asarray(plate.com)[:2] - obj.center[:2]) / half[:2]
    beliefs = settings.beliefs
    centers = {
        "inertia": float(plate.inertia[2, 2] / box),
        "com_x": float(com[0]),
        "com_y": float(com[1]),
    }
    changed = {
        name: dataclasses.replace(getattr(beliefs, name), center=center)
        for name, center in centers.items()
    }
    return dataclasses.replace(settings, beliefs=dataclasses.replace(beliefs, **changed))


def _double(examples: Examples) -> Examples:
    """Signals and setup in double precision."""

    def wide(leaf: Array) -> Array:
        x = np.asarray(leaf)
        return jnp.asarray(x, np.float64 if x.dtype.kind == "f" else x.dtype)

    return examples.replace(
        records=jax.tree.map(wide, examples.records), setup=jax.tree.map(wide, examples.setup)
    )


def sysid(settings: SysidSettings = _DEFAULT) -> Estimator:
    """The estimator that simulates, in double precision whatever JAX is set to."""

    def fit_start(examples: Examples, *, key: KeyArray) -> FittedSysid:
        if settings.start_features is None:
            return FittedSysid(None)
        trees = boosted(BoostedSettings(features=settings.start_features))
        return FittedSysid(trees.fit(examples, key=key))

    def predict(fitted: FittedSysid, examples: Examples) -> Estimate:
        n = len(np.asarray(examples.status))
        mean, covariance = np.full((n, 4), np.nan), np.tile(np.diag(np.full(4, np.inf)), (n, 1, 1))
        status = np.full(n, int(EstimateStatus.BAD_INPUT), np.int32)
        for rows, part, centroid, problem, found in identify_examples(
            fitted, examples, settings, key=jax.random.key(0)
        ):
            assert part.records is not None
            known = problem.setup, centroid, problem.settings
            with jax.enable_x64(True):
                values = planar_estimates(found, part.records, *known)
            seen = np.asarray(found.search.iterations) > 0
            seen &= np.asarray(part.status) == PushStatus.OK
            fine = seen & (values[2] == EstimateStatus.OK)
            mean[rows[fine]], covariance[rows[fine]] = values[0][fine], values[1][fine]
            status[rows] = np.where(seen, values[2], EstimateStatus.BAD_INPUT)
        return Estimate(jnp.asarray(mean), jnp.asarray(covariance), jnp.asarray(status))

    return Estimator("sysid", fit_start, predict)
