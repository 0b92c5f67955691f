"""How far a point is from an object and where the object's surface faces it.

In: a point in the axes of the object; half the edges of a box, or convex polygons. Out: signed
distance and inward normal.
"""

import functools
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.pushing.small_linalg import inner_product
from mjx_inertia.spatial import AnyArray


def nearest_on_box(point: Sequence[Array], half: Sequence[Array]) -> tuple[Array, list[Array]]:
    """Signed distance of a point from a box (or rectangle) and the inward normal nearest to it.

    Args:
      point: from the box's centre, along its edges, m.
      half: half its edges, m.

    Returns:
      Distance (m, negative inside) and the components of the normal.
    """
    beyond = [jnp.abs(x) - h for x, h in zip(point, half, strict=True)]
    inward = [jnp.where(x < 0, 1.0, -1.0) for x in point]
    deepest = functools.reduce(jnp.maximum, beyond)
    outside = deepest > 0
    over = [jnp.maximum(b, 0.0) for b in beyond]
    radius = jnp.sqrt(jnp.where(outside, inner_product(over, over), 1.0))
    face = [jnp.where(b == deepest, 1.0, 0.0) for b in beyond]
    normal = [
        side * jnp.where(outside, o / radius, f)
        for side, o, f in zip(inward, over, face, strict=True)
    ]
    return jnp.where(outside, radius, deepest), normal


def nearest_on_polygons(
    point: tuple[Array, Array], polygons: Float[AnyArray, "m k 2"]
) -> tuple[Float[Array, " m"], list[Array]]:
    """Signed distances of a point from convex polygons and their inward normals nearest to it.

    Args:
      point: in the axes of the polygons, m.
      polygons: vertices, counter-clockwise, m; the last one may be repeated.

    Returns:
      Distances (m, negative inside) and the two components of the normals.
    """
    xp = np if isinstance(polygons, np.ndarray) else jnp  # what is known is not computed again
    start, edge = polygons, xp.roll(polygons, -1, axis=1) - polygons
    length = xp.hypot(edge[..., 0], edge[..., 1])
    real = length > 0
    along_x, along_y = (edge[..., i] / xp.where(real, length, 1.0) for i in (0, 1))
    x, y = point[0] - start[..., 0], point[1] - start[..., 1]
    beyond = jnp.where(real, along_y * x - along_x * y, -jnp.inf)
    deepest = beyond.max(1, keepdims=True)
    way = jnp.clip(along_x * x + along_y * y, 0.0, length)
    gap_x, gap_y = x - way * along_x, y - way * along_y
    squared = gap_x * gap_x + gap_y * gap_y
    closest = jnp.argmin(squared, 1)[:, None] == np.arange(length.shape[1])
    facing = jnp.argmax(beyond, 1)[:, None] == np.arange(length.shape[1])

    def at(which: Array, values: Array | np.ndarray) -> Array:
        return jnp.where(which, values, 0.0).sum(1)

    outside = deepest[:, 0] > 0
    radius = jnp.sqrt(jnp.where(outside, at(closest, squared), 1.0))
    normal_x = jnp.where(outside, -at(closest, gap_x) / radius, -at(facing, along_y))
    normal_y = jnp.where(outside, -at(closest, gap_y) / radius, at(facing, along_x))
    return jnp.where(outside, radius, deepest[:, 0]), [normal_x, normal_y]
