"""A solid whose density is a function of position.

In: a closed mesh and the function. Out: `InertialParameters`. Objects of parts that are each of one
material are in `from_parts`, densities by voxel in `voxels`.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Integer
from numpy import ndarray

from mjx_inertia.objects.mesh_integrals import checked_solid, middle_of, nowhere_negative
from mjx_inertia.spatial import (
    AnyArray,
    InertialParameters,
    inertia_from_second_moment,
)


def properties_of_field(
    vertices: Float[AnyArray, "v 3"],
    faces: Integer[AnyArray, "f 3"],
    density: Callable[[Float[Array, "3"]], Float[Array, ""]],
    *,
    points: int = 4,
) -> InertialParameters:
    """Inertial parameters of a solid whose density is a smooth function of position.

    Gauss's rule on the signed tetrahedra between the middle of the bounding box and the faces:
    exact for a polynomial density of degree `2 points - 5`, and quickly convergent for a smooth
    one. The function must be smooth in the whole of these tetrahedra, which for a solid that is not
    convex reach outside; for a density that jumps use parts or voxels.

    Differentiable in the vertices and in whatever `density` closes over. Checks as
    `mass_properties`; a total mass that is not positive, or a density that is negative at any point
    where it is asked for (also those outside a solid that is not convex), gives NaN in every field.

    Args:
      vertices: (v, 3), m.
      faces: (f, 3), outward.
      density: kg/m³ at a position (m) in the frame of the vertices, written for one position.
      points: of the rule in each of three directions; `points`³ for each face.

    Raises:
      ValueError: a defect of the mesh by its name; fewer than 3 points, which would not be exact
        for a constant.
    """
    if points < 3:
        raise ValueError(f"`points` is {points}, but a constant density needs 3 or more")
    places, triangles = checked_solid(vertices, faces)
    middle = jax.lax.stop_gradient(jnp.asarray(middle_of(places)))
    corners = jnp.asarray(places - middle)[triangles]
    nodes, weights = _tetrahedron_rule(points)
    six_volumes = jnp.linalg.det(corners)
    local = jnp.einsum("nk,fki->fni", jnp.asarray(nodes), corners, precision="highest")
    values = jax.vmap(jax.vmap(density))(local + middle)
    masses = six_volumes[:, None] * jnp.asarray(weights) * values
    total = jnp.sum(masses)
    mass = jnp.where((total > 0.0) & nowhere_negative(values), total, jnp.nan)
    com = jnp.einsum("fn,fni->i", masses, local, precision="highest") / mass
    offset = local - com
    second = jnp.einsum("fn,fni,fnj->ij", masses, offset, offset, precision="highest")
    return InertialParameters(mass, com + middle, inertia_from_second_moment(second))


def _tetrahedron_rule(points: int) -> tuple[Float[ndarray, "n 3"], Float[ndarray, " n"]]:
    """Nodes as weights of the corners a, b, c, and weights, on the tetrahedron (0, a, b, c).

    Gauss-Legendre on the unit cube, collapsed onto the tetrahedron (Stroud 1971, "Approximate
    calculation of multiple integrals", ch. 2): r³ from the tip, (1 - s) from an edge.
    """
    node, weight = np.polynomial.legendre.leggauss(points)
    node, weight = 0.5 * (node + 1.0), 0.5 * weight
    r, s, t = (x.reshape(-1) for x in np.meshgrid(node, node, node, indexing="ij"))
    wr, ws, wt = (x.reshape(-1) for x in np.meshgrid(weight, weight, weight, indexing="ij"))
    nodes = np.stack([r * (1.0 - s), r * s * (1.0 - t), r * s * t], axis=1)
    return nodes, wr * ws * wt * r**2 * s
