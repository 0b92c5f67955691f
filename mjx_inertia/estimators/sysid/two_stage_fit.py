"""Identification of pushes: starts, two fits, new starts, and what the pushes determine.

Each push is fitted twice. The first fit covers the beginning of the push, where the search is cheap
and the cost is smooth. The second one covers the whole push. Pushes with large residuals are fitted
again from starts nearby. Fisher information at the end is counted in standard deviations of what is
believed beforehand. In: a `SysidProblem` and starts. Out: `Fit` with its `Identifiability`.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Bool, Float

from mjx_inertia.estimators.sysid.levenberg_marquardt import Search, fits, misfit, search
from mjx_inertia.estimators.sysid.normal_equations import wall_hessian
from mjx_inertia.estimators.sysid.observation import SysidProblem
from mjx_inertia.estimators.sysid.unknowns import random_restart
from mjx_inertia.spatial import AnyArray

_SPREAD_OF_DIRECTION = 0.35  # share of an unknown in a direction from which it is named


@struct.dataclass
class Identifiability:
    """Fisher information of one push (or, with a leading axis, of many)."""

    covariance: Float[AnyArray, "*n p p"]  # of the coordinates, the beliefs included
    # ratio of the largest to the smallest eigenvalue of the information
    condition: Float[AnyArray, "*n"]
    weakest: Float[AnyArray, "*n p"]  # unit vector of the coordinates that the data determine least
    # fraction by which the data reduce the prior variance along it (0: not at all)
    told: Float[AnyArray, "*n"]
    # projection on all directions whose prior variance the data reduce by less than half
    untold: Float[AnyArray, "*n p p"]


def identifiability(fisher: Float[AnyArray, "p p"]) -> Identifiability:
    """Judges the information of the data, JᵀJ in coordinates of the beliefs."""
    p = fisher.shape[0]
    finite = jnp.all(jnp.isfinite(fisher))
    fisher = jnp.where(finite, fisher, 0.0)
    eigenvalues, vectors = jnp.linalg.eigh(fisher)
    least = jnp.maximum(eigenvalues[0], 0.0)
    return Identifiability(
        covariance=jnp.linalg.inv(fisher + jnp.eye(p, dtype=fisher.dtype)),
        condition=eigenvalues[-1] / jnp.maximum(least, 1e-12),
        weakest=vectors[:, 0],
        told=least / (1.0 + least),
        untold=(vectors * (eigenvalues < 1.0)) @ vectors.T,
    )


_WORDS = {
    "mass": "mass",
    "inertia": "I_zz",
    "com_x": "CoM x",
    "com_y": "CoM y",
    "friction": "table friction",
    "tip_friction": "tip friction",
    "tip_time_constant": "contact stiffness",
    "friction_radius": "the limit surface's c",
    "probe_mass": "probe mass",
}


def explain_identifiability(
    result: Identifiability, names: tuple[str, ...], *, pushes: int = 1
) -> str:
    """One sentence that names what the pushes do not determine; empty if there is nothing.

    `names` are those of the coordinates, `pushes` how many of the body there were.
    """
    untold = np.asarray(result.untold)
    directions = round(float(np.trace(untold)))
    if not directions:
        return ""
    share = np.sqrt(np.maximum(np.diagonal(untold), 0.0))
    order = np.argsort(-share)
    involved = [names[i] for i in order if share[i] > _SPREAD_OF_DIRECTION]
    words = [_WORDS.get(name) or name.replace("_", " ") for name in involved]
    listed = words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
    apart = " apart" if len(involved) > directions else ""
    source = " from this push" if pushes == 1 else " from these pushes"
    alone = "" if apart else source
    return f"{listed} cannot be told{apart}{alone}{_why(involved, pushes)}"


def _why(involved: list[str], pushes: int) -> str:
    one = pushes == 1
    if {"mass", "friction"} <= set(involved):
        what = "the push hardly accelerates" if one else "the pushes hardly accelerate"
        return f": {what}, and a steady force shows their product only"
    if "inertia" in involved or involved[0] in ("com_x", "com_y"):
        return f": {'the push hardly turns' if one else 'the pushes hardly turn'} the object"
    if "tip_friction" in involved:
        return ": the tip does not slide along the object"
    return ""


@struct.dataclass
class Fit:
    """Identified pushes, with a leading axis."""

    start: Float[AnyArray, "n p"]  # coordinates where the search began
    search: Search  # where it ended and how it went, on the whole push
    # mean squared residual, in standard deviations of the noise model
    misfit: Float[AnyArray, " n"]
    fits: Bool[AnyArray, " n"]  # whether sensor noise alone explains the misfit
    known: Identifiability  # Fisher information of the push where the search ended


def _with_better(found: Search, rows: np.ndarray, other: Search) -> Search:
    """`found`, with the rows of `other` where `other` has the lower cost."""
    cost = np.nan_to_num(np.asarray(found.cost)[rows], nan=np.inf)
    wins = np.nan_to_num(other.cost, nan=np.inf) < cost

    def replaced(whole: np.ndarray, new: np.ndarray) -> np.ndarray:
        whole = np.array(whole)
        whole[rows[wins]] = np.asarray(new)[wins]
        return whole

    return jax.tree.map(replaced, found, other)


def fit(
    problem: SysidProblem,
    start: Float[AnyArray, "b p"],
    *,
    key: jax.Array,
    report: Callable[[str], None] | None = None,
) -> Fit:
    """Identifies each body from all its pushes.

    `start` are coordinates where the search of each body begins, `key` draws further starts.
    `report` is called after each iteration with a line on how far the search is.
    """
    settings, body = problem.settings, np.asarray(problem.body)
    measured = body[np.asarray(problem.observation.length) > 0]
    usable = np.bincount(measured, minlength=len(start)) > 0

    def run(z: np.ndarray, bodies: np.ndarray, seconds: float = np.inf) -> Search:
        """A search from each start `z`; a body may occur more than once."""
        pushes = [np.flatnonzero(body == b) for b in bodies]
        place = np.repeat(np.arange(len(bodies)), [len(p) for p in pushes])
        part = problem.take(np.concatenate(pushes)).replace(body=place)
        return search(part, z, seconds=seconds, report=report)

    def drawn(bodies: np.ndarray, number: int) -> np.ndarray:
        """Start `number` of each body, near its first one."""
        own = functools.partial(jax.random.fold_in, jax.random.fold_in(key, number))
        near = functools.partial(random_restart, settings=settings)
        return np.asarray(jax.vmap(near)(jax.vmap(own)(bodies), jnp.asarray(start)[bodies]))

    # 1. the first moments of all pushes
    first = run(np.asarray(start), np.arange(len(start)), settings.coarse)
    # 2. the same from further starts, all of them side by side, where these do not fit
    bad = np.flatnonzero(usable & ~fits(first, problem, settings.coarse))
    if len(bad) and settings.draws:
        starts = np.concatenate([drawn(bad, number) for number in range(settings.draws)])
        tries = run(starts, np.tile(bad, settings.draws), settings.coarse)
        for part in np.split(np.arange(len(starts)), settings.draws):
            first = _with_better(first, bad, jax.tree.map(lambda x, part=part: x[part], tries))
    # 3. whole pushes, from where that ended
    best = run(np.asarray(first.z), np.arange(len(start)))
    # 4. both once more, from one further start, where a fit is bad or stands at a kink
    settled = fits(best, problem) & best.converged
    bad = np.flatnonzero(usable & ~settled)
    if len(bad):
        first = run(drawn(bad, settings.draws), bad, settings.coarse)
        best = _with_better(best, bad, run(np.asarray(first.z), bad))
    walls = jax.vmap(functools.partial(wall_hessian, settings=settings))(jnp.asarray(best.z))
    fisher = best.hessian - np.eye(best.z.shape[1]) - np.asarray(walls)
    return Fit(
        start=np.asarray(start),
        search=best,
        misfit=misfit(best, problem),
        fits=fits(best, problem),
        known=jax.tree.map(np.asarray, jax.vmap(identifiability)(jnp.asarray(fisher))),
    )
