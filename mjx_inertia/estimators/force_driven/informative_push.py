"""The push of an object that is expected to tell most about it, given what is known.

In: an estimate and the outline. Out: `NextPush`. Candidates go along the inward normal at points
around the outline. Each is simulated with the estimated parameters, and the filter's Fisher
information of the simulated signals is added to what is known.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.dataset.push import simulate_push
from mjx_inertia.estimators.force_driven.estimate import BodyEstimate
from mjx_inertia.estimators.force_driven.prediction_errors import normal_terms
from mjx_inertia.estimators.force_driven.samples import BodyPrior, push_samples, stack_samples
from mjx_inertia.estimators.force_driven.settings import SHARED, UNKNOWNS, ForceDrivenSettings
from mjx_inertia.objects import ObjectModel, closest_on_outline, prism, turn_vectors
from mjx_inertia.pushing import PushRecord

_CANDIDATES = 16  # points around the outline
_SPEED = 0.1  # m/s: a slow push tells nothing of the mass
_DURATION = 0.6  # s
_GRAVITY = 9.81  # m/s²
_FRICTION = (0.05, 1.0)  # of the simulated table


@dataclass(frozen=True)
class NextPush:
    """Where to push next, and how well the mass is expected to be known then."""

    contact_point: Float[ndarray, "2"]  # m, object frame
    direction: Float[ndarray, "2"]  # unit vector, object frame
    speed: float  # m/s, from rest at once
    mass_sd: float  # expected relative standard deviation of the mass after it


def most_informative_push(
    found: BodyEstimate, obj: ObjectModel, settings: ForceDrivenSettings, spread: float
) -> NextPush:
    """The best of the candidates: least expected variance of log mass, log c and CoM.

    Raises:
      ValueError: the estimate has no mass.
    """
    if not np.isfinite(found.mean).all():
        raise ValueError("next push: there is no estimate to plan with; push faster, for longer")
    mass, inertia, *com = (float(x) for x in found.mean)
    body = prism(obj.outline, obj.height, mass, inertia_zz=inertia, com=(com[0], com[1]))
    friction = float(np.clip(np.median(found.friction_force) / (mass * _GRAVITY), *_FRICTION))
    points = _around(obj.outline)
    contact = closest_on_outline(obj.outline, points)
    prior = BodyPrior.of(obj, np.array(com))
    kept, samples = [], []
    for i, point in enumerate(contact.point):
        try:
            push = simulate_push(
                body, point.tolist(), speed=_SPEED, duration=_DURATION, friction=friction
            )
        except ValueError:
            continue  # the tip cannot get there
        # the record follows the centroid of the outline: back to the object's frame
        record = _tracked(push.record, obj.footprint.centroid)
        one = push_samples(record, prior, settings)
        if one is not None:
            kept.append(i)
            samples.append(one.replace(deviations=found.samples.deviations[0]))
    if not kept:
        raise ValueError("next push: no candidate around the outline moves the object")
    terms = normal_terms(np.zeros((len(kept), len(UNKNOWNS))), stack_samples(samples), settings)
    deviations = np.asarray(found.samples.deviations[0])[:SHARED]
    inside = np.flatnonzero(deviations > 0)
    score, mass_sd = [], []
    for information in np.asarray(terms.information):
        own = information[SHARED:, SHARED:] + np.eye(len(UNKNOWNS) - SHARED)
        cross = information[:SHARED, SHARED:]
        gained = (information[:SHARED, :SHARED] - cross @ np.linalg.solve(own, cross.T)) / spread**2
        total = (found.information + gained)[np.ix_(inside, inside)]
        variance = np.diagonal(np.linalg.inv(total)) * deviations[inside] ** 2
        scale = np.array([1.0, 1.0, *(2.0 / obj.half_extents[:2]) ** 2, 0.0])[inside]
        score.append(float(scale @ variance))
        mass_sd.append(float(np.sqrt(variance[0])))
    best = int(np.argmin(score))
    i = kept[best]
    return NextPush(contact.point[i], contact.normal[i], _SPEED, mass_sd[best])


def _around(outline: Float[ndarray, "k 2"]) -> Float[ndarray, "n 2"]:
    """Points evenly spaced along the outline, none at a corner."""
    closed = np.concatenate([outline, outline[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    at = (np.arange(_CANDIDATES) + 0.37) / _CANDIDATES * along[-1]
    return np.stack([np.interp(at, along, column) for column in closed.T], 1)


def _tracked(record: PushRecord, centroid: Float[ndarray, "2"]) -> PushRecord:
    """The record of the frame whose origin is that of the outline."""
    pose = np.asarray(record.pose, float)
    origin = pose[:, :2] - turn_vectors(pose[:, 2], np.broadcast_to(centroid, (len(pose), 2)))
    return record.replace(pose=np.concatenate([origin, pose[:, 2:]], 1))
