"""Identification of pushes: starts, two fits, and new starts for what does not fit.

Each push is fitted twice: over its first moments, where the search is cheap and its cost smooth,
then over the whole. Pushes whose residuals stay too large are fitted again from starts nearby.
In: observations, setups, starts. Out: `Fit`.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Bool, Float, Int

from mjx_inertia.estimators.sysid.identifiability import Identifiability, identifiability
from mjx_inertia.estimators.sysid.normal_equations import wall_hessian
from mjx_inertia.estimators.sysid.observation import Observation
from mjx_inertia.estimators.sysid.search import Search, fits, misfit, search
from mjx_inertia.estimators.sysid.settings import SysidSettings
from mjx_inertia.estimators.sysid.unknowns import draw
from mjx_inertia.pushing import PushSetup, Scene
from mjx_inertia.spatial import AnyArray


@struct.dataclass
class Fit:
    """Identified pushes, with a leading axis.

    Attributes:
      start: coordinates where the search began.
      search: where it ended and how it went, on the whole push.
      misfit: mean squared residual, in standard deviations of the noise model.
      fits: whether that is no more than noise can make it.
      known: what the push can tell, where the search ended.
    """

    start: Float[AnyArray, "n p"]
    search: Search
    misfit: Float[AnyArray, " n"]
    fits: Bool[AnyArray, " n"]
    known: Identifiability


def _better(a: Search, b: Search) -> Search:
    """Push by push the search that ended lower."""
    wins = np.nan_to_num(b.cost, nan=np.inf) < np.nan_to_num(a.cost, nan=np.inf)

    def choose(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.where(wins.reshape(-1, *[1] * (x.ndim - 1)), y, x)

    return jax.tree.map(choose, a, b)


def fit(
    scene: Scene,
    start: Float[AnyArray, "n p"],
    observation: Observation,
    setup: PushSetup,
    centroid: Float[AnyArray, "2"],
    settings: SysidSettings,
    *,
    key: jax.Array,
    body: Int[AnyArray, " n"] | None = None,
    report: Callable[[str], None] | None = None,
) -> Fit:
    """Identifies each push on its own, or the pushes of each body together.

    Args:
      scene: of the object.
      start: where to begin, coordinates, one for each body.
      observation: of each push.
      setup: of each push.
      centroid: of the outline, object frame, m.
      settings: of the identification.
      key: of the further starts.
      body: which body each push is of; by default each push stands for itself.
      report: called after each iteration with a line on how far the search is.
    """
    body = np.arange(len(start)) if body is None else np.asarray(body)
    usable = np.bincount(body[np.asarray(observation.length) > 0], minlength=len(start)) > 0

    def run(z: np.ndarray, bodies: np.ndarray, seconds: float = np.inf) -> Search:
        pushes = np.flatnonzero(np.isin(body, bodies))
        seen, setups = jax.tree.map(lambda x: np.asarray(x)[pushes], (observation, setup))
        place = np.searchsorted(bodies, body[pushes])
        window = {"body": place, "seconds": seconds, "report": report}
        return search(scene, z, seen, setups, centroid, settings, **window)

    def again(found: Search, number: int, seconds: float, whole_push: bool) -> Search:
        """Searches anew, from another start, what does not fit yet or, at last, stalled."""
        settled = fits(found, observation, body, settings, seconds)
        if whole_push:
            settled &= found.converged
        bad = np.flatnonzero(usable & ~settled)
        if not len(bad):
            return found
        own = functools.partial(jax.random.fold_in, jax.random.fold_in(key, number))
        keys = jax.vmap(own)(jnp.asarray(bad))
        near = functools.partial(draw, settings=settings)
        drawn = np.asarray(jax.vmap(near)(keys, jnp.asarray(start)[bad]))
        other = run(drawn, bad, settings.coarse)
        other = run(np.asarray(other.z), bad) if whole_push else other
        better = _better(jax.tree.map(lambda x: x[bad], found), other)
        for whole, new in zip(jax.tree.leaves(found), jax.tree.leaves(better), strict=True):
            whole[bad] = new
        return found

    everything = np.arange(len(start))
    first = run(np.asarray(start), everything, settings.coarse)
    for number in range(settings.draws):
        first = again(first, number, settings.coarse, whole_push=False)
    best = again(run(np.asarray(first.z), everything), settings.draws, np.inf, whole_push=True)
    walls = jax.vmap(functools.partial(wall_hessian, settings=settings))(jnp.asarray(best.z))
    fisher = best.hessian - np.eye(best.z.shape[1]) - np.asarray(walls)
    return Fit(
        start=np.asarray(start),
        search=best,
        misfit=misfit(best, observation, body),
        fits=fits(best, observation, body, settings),
        known=jax.tree.map(np.asarray, jax.vmap(identifiability)(jnp.asarray(fisher))),
    )
