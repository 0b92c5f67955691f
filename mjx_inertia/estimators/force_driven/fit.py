"""Gauss-Newton on the prediction errors: pushes of one body share the parameters of the body.

In: `PushSamples` of n pushes and which body each belongs to. Out: `ForceDrivenFit`.
"""

from dataclasses import dataclass, fields

import jax
import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from mjx_inertia.estimators.force_driven.prediction_errors import (
    NormalTerms,
    PushSamples,
    normal_terms,
)
from mjx_inertia.estimators.force_driven.settings import SHARED, UNKNOWNS, ForceDrivenSettings

_CONVERGED = 1e-3  # squared length of the next step, in standard deviations
_OWN = len(UNKNOWNS) - SHARED


@dataclass(frozen=True)
class ForceDrivenFit:
    """Parameters of b bodies from their pushes, in units of the priors' standard deviations."""

    mean: Float[ndarray, "b s"]  # of the shared unknowns
    covariance: Float[ndarray, "b s s"]  # counts the errors' correlation in time
    own: Float[ndarray, "n o"]  # unknowns of each push
    white_covariance: Float[ndarray, "b s s"]  # as if the errors were white
    converged: Bool[ndarray, " b"]
    evaluations: int


def fit_bodies(
    samples: PushSamples,
    body: Int[ndarray, " n"],
    settings: ForceDrivenSettings,
    start: Float[ndarray, "n u"] | None = None,
) -> ForceDrivenFit:
    """The parameters that predict best, with their priors.

    Args:
      samples: of n pushes.
      body: of each push, from 0 without gaps.
      settings: noise and disturbances.
      start: of the search, in units of the priors; their centres if None.
    """
    bodies = int(body.max()) + 1
    z = np.zeros((len(body), len(UNKNOWNS))) if start is None else start
    at = _linearised(z, samples, body, settings)
    evaluations, scale = 1, np.ones(bodies)
    converged = at.decrement < _CONVERGED
    while evaluations < settings.iterations and not converged.all():
        trial = z + np.where(converged, 0.0, scale)[body, None] * at.step
        new = _linearised(trial, samples, body, settings)
        evaluations += 1
        # gains change between linearisations, so neither measure alone falls at each good step
        better = (new.cost <= at.cost) | (new.decrement <= at.decrement)
        better &= np.isfinite(new.cost) & ~converged
        z = np.where(better[body, None], trial, z)
        at = _chosen(better, body, new, at)
        scale = np.where(better, np.minimum(1.0, 2.0 * scale), 0.5 * scale)
        converged |= better & (at.decrement < _CONVERGED)
    first = np.array([np.flatnonzero(body == b)[0] for b in range(bodies)])
    return ForceDrivenFit(
        mean=z[first, :SHARED],
        covariance=at.covariance,
        own=z[:, SHARED:],
        white_covariance=at.white_covariance,
        converged=converged,
        evaluations=evaluations,
    )


@dataclass(frozen=True)
class _Linearised:
    cost: Float[ndarray, " b"]  # negative log likelihood and log prior
    decrement: Float[ndarray, " b"]  # squared length of the step in standard deviations
    step: Float[ndarray, "n u"]  # of Gauss-Newton
    white_covariance: Float[ndarray, "b s s"]
    covariance: Float[ndarray, "b s s"]


def _chosen(better: ndarray, body: ndarray, new: _Linearised, old: _Linearised) -> _Linearised:
    """The new one for the bodies that got better."""

    def pick(name: str) -> ndarray:
        a, b = getattr(new, name), getattr(old, name)
        rows = better[body] if name == "step" else better
        return np.where(rows.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return _Linearised(**{f.name: pick(f.name) for f in fields(_Linearised)})


def _terms(z: ndarray, samples: PushSamples, settings: ForceDrivenSettings) -> NormalTerms:
    """`normal_terms`, compiled for numbers of pushes that are powers of two."""
    count = len(z)
    rows = np.minimum(np.arange(1 << (count - 1).bit_length()), count - 1)
    padded = jax.tree.map(lambda x: np.asarray(x)[rows], (z, samples))
    return jax.tree.map(lambda x: np.asarray(x)[:count], normal_terms(*padded, settings))


def _linearised(
    z: ndarray, samples: PushSamples, body: ndarray, settings: ForceDrivenSettings
) -> _Linearised:
    """Cost, Gauss-Newton step and covariances about `z`; own unknowns of a push are its alone."""
    terms = _terms(z, samples, settings)
    bodies = int(body.max()) + 1
    step = np.zeros_like(z)
    cost, decrement = np.zeros(bodies), np.zeros(bodies)
    white, scattered = np.zeros((2, bodies, SHARED, SHARED))
    for b in range(bodies):
        rows = np.flatnonzero(body == b)
        size = SHARED + _OWN * len(rows)
        places = [np.r_[0:SHARED, SHARED + _OWN * k + np.arange(_OWN)] for k in range(len(rows))]
        # prior, then the pushes
        hessian, scatter = np.eye(size), np.eye(size)
        values = np.concatenate([z[rows[0], :SHARED], z[rows, SHARED:].ravel()])
        gradient = values.copy()
        for row, at in zip(rows, places, strict=True):
            hessian[np.ix_(at, at)] += terms.information[row]
            scatter[np.ix_(at, at)] += terms.scatter[row]
            gradient[at] += terms.score[row]
        free = np.asarray(samples.deviations)[rows] > 0
        inside = np.flatnonzero(np.concatenate([free[0, :SHARED], free[:, SHARED:].ravel()]))
        inverse = np.zeros((size, size))
        inverse[np.ix_(inside, inside)] = np.linalg.inv(hessian[np.ix_(inside, inside)])
        full = -inverse @ gradient
        cost[b] = terms.misfit[rows].sum() + 0.5 * values @ values
        decrement[b] = -gradient @ full
        white[b] = inverse[:SHARED, :SHARED]
        scattered[b] = (inverse @ scatter @ inverse)[:SHARED, :SHARED]
        for row, at in zip(rows, places, strict=True):
            step[row] = full[at]
    return _Linearised(cost, decrement, step, white, scattered)
