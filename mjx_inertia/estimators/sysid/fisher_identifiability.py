"""Which parameters a push determines: covariance from its Fisher information, and a sentence.

In: the Gauss-Newton Hessian of the data in coordinates of the beliefs (so that every unknown counts
in standard deviations of what is believed beforehand). Out: `Identifiability` and sentences.
"""

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Float

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

    Args:
      result: of one body.
      names: of the coordinates.
      pushes: how many of the body there were.
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
