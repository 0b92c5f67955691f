"""The grasp wrench space as a hull of points: an independent, slower way to its measures."""

import itertools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from mjx_inertia.grasping.contact_model import grasp_map


class WrenchHull(NamedTuple):
    """The wrench space with linearised friction cones."""

    epsilon: float  # radius of the largest ball around 0 in it; 0 where 0 is not inside
    volume: float  # six-dimensional, in (N/N)⁶


def wrench_hull(contacts, pad, reference, length, *, norm="l1", edges=8):
    """ε and volume of any number of contacts by Qhull, with friction cones of few edges.

    Cones are replaced by the hull of points on them, so both figures are too low, by an amount that
    falls with the square of `edges`. Qhull's input is joggled, because points of a cone are
    cospherical. "linf" takes seconds, because its points are all sums.
    """
    matrix = np.asarray(grasp_map(contacts, jnp.asarray(reference), length), dtype=np.float64)
    unit = _cone_points(float(pad.friction), float(pad.torsion), edges)
    blocks = np.split(matrix, matrix.shape[1] // 4, axis=1)
    each = [np.concatenate([unit @ block.T, np.zeros((1, 6))]) for block in blocks]
    if norm == "l1":
        points = np.concatenate(each)
    else:
        points = np.array([sum(combination) for combination in itertools.product(*each)])
    try:
        hull = ConvexHull(points, qhull_options="QJ Pp")
    except QhullError:  # flat: some wrench cannot be exerted at all
        return WrenchHull(0.0, 0.0)
    return WrenchHull(max(float(np.min(-hull.equations[:, -1])), 0.0), float(hull.volume))


def _cone_points(friction, torsion, edges):
    """(normal, two tangential, torsion) on the boundary of what a normal force of 1 allows."""
    latitude = np.linspace(-0.5 * np.pi, 0.5 * np.pi, edges // 2 + 1)
    longitude = 2.0 * np.pi * np.arange(edges) / edges
    lat, lon = (x.ravel() for x in np.meshgrid(latitude, longitude))
    points = np.stack(
        [
            np.ones_like(lat),
            friction * np.cos(lat) * np.cos(lon),
            friction * np.cos(lat) * np.sin(lon),
            torsion * np.sin(lat),
        ],
        axis=1,
    )
    return np.unique(points.round(14), axis=0)
