"""Inertial parameters in double precision, whatever precision JAX works in.

In: figures of files, bodies of parts. Out: `InertialParameters` of NumPy arrays, which JAX takes as
it takes its own. For what is read or summed once, outside any compiled function.
"""

from collections.abc import Sequence
from typing import cast

import jax
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.spatial.arrays import AnyArray
from mjx_inertia.spatial.inertia import InertialParameters, combine

_ROWS = 16  # numbers of bodies are filled up to a multiple, so that few sizes are compiled
_combine = jax.jit(combine)


def inertial_float64(
    mass: AnyArray | float, com: AnyArray | Sequence[float], inertia: AnyArray
) -> InertialParameters:
    """Mass (kg), CoM (m) and tensor about the CoM (kg m²) as float64 arrays."""
    leaves = [np.asarray(x, np.float64) for x in (mass, com, inertia)]
    return InertialParameters(*cast(list[jax.Array], leaves))


def change_frame_float64(
    params: InertialParameters, T_new_old: Float[ndarray, "4 4"]
) -> InertialParameters:
    """`change_frame` by a homogeneous matrix; the tensor comes out symmetric to the last digit."""
    R = T_new_old[:3, :3]
    turned = R @ np.asarray(params.inertia, np.float64) @ R.T
    com = R @ np.asarray(params.com, np.float64) + T_new_old[:3, 3]
    return inertial_float64(params.mass, com, 0.5 * (turned + turned.T))


def combine_float64(bodies: Sequence[InertialParameters]) -> InertialParameters:
    """`combine` of bodies in one frame; none at all weigh nothing."""
    zero = inertial_float64(0.0, np.zeros(3), np.zeros((3, 3)))
    rows = _ROWS * max(1, -(-len(bodies) // _ROWS))
    padded = [*bodies, *[zero] * (rows - len(bodies))]
    with jax.enable_x64(True):
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves, dtype=np.float64), *padded)
        return jax.tree.map(np.asarray, _combine(stacked))
