"""Mass, centre of mass and inertia tensor of the solid inside a closed triangle mesh.

In: vertices (m), faces (outward, counter-clockwise seen from outside) and a density (kg/m³). Out:
`InertialParameters` in the frame of the vertices. Exact for the polyhedron: the volume integrals of
Mirtich 1996 ("Fast and accurate computation of polyhedral mass properties", Journal of Graphics
Tools 1(2)), written as signed sums over the tetrahedra between a reference point and the faces
(Tonon 2004, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", Journal of
Mathematics and Statistics 1(1)), which are the same polynomials without a choice of projection.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Integer
from numpy import ndarray

from mjx_inertia.objects.mesh_defects import check_closed, checked_mesh
from mjx_inertia.spatial import AnyArray, InertialParameters, inertia_from_second_moment

Density = Float[AnyArray, ""] | float | int


def mass_properties(
    vertices: Float[AnyArray, "v 3"],
    faces: Integer[AnyArray, "f 3"],
    density: Density = 1.0,
) -> InertialParameters:
    """Inertial parameters of the solid of uniform `density` inside a closed mesh.

    Works under `jit`, `vmap` and `grad` with respect to `vertices` and `density`. What can be
    checked depends on what is known when it is called:

    - `faces` concrete (always, unless they are an argument of a jitted or mapped function): the
      mesh must be watertight with consistent winding.
    - `vertices` concrete too: the mesh must also be finite, face outwards, enclose a volume and not
      intersect itself.
    - `vertices` traced: their values are unknown, so self-intersection is not seen; a solid
      whose volume is not positive beyond rounding (inverted, flat, NaN), or whose density is not
      positive, has NaN in every field, which `check_consistency` reports as `NOT_FINITE`.
      Padding a batch with faces such as (0, 0, 0) adds nothing.

    Args:
      vertices: (v, 3), m.
      faces: (f, 3) indices of vertices, counter-clockwise seen from outside.
      density: kg/m³.

    Returns:
      Parameters in the frame of the vertices, in the precision that JAX works in. The integrals are
      taken about the middle of the bounding box, so a frame far away costs only the rounding of
      the vertices themselves.

    Raises:
      ValueError: a defect of the mesh by its name, with what to do; or a density that is not
        positive.
    """
    check_density(density)
    points, triangles = checked_solid(vertices, faces)
    if not (isinstance(points, ndarray) and isinstance(triangles, ndarray)):
        return polyhedron_properties(jnp.asarray(points), triangles, density)
    return known_solid_properties(points, triangles, density)


def known_solid_properties(
    vertices: Float[ndarray, "v 3"],
    faces: Integer[ndarray, "f 3"],
    density: Density = 1.0,
) -> InertialParameters:
    """`mass_properties` of arrays on the host, without any check.

    Triangles without area are added up to a power of two, so that few sizes are compiled.
    """
    middle = middle_of(vertices)
    local = vertices - middle
    missing = (1 << max(6, (len(faces) - 1).bit_length())) - len(faces)
    a, b, c = (jnp.asarray(np.pad(local[faces[:, k]], ((0, missing), (0, 0)))) for k in range(3))
    about_middle = _solid_of_triangles((a, b, c), jnp.asarray(density, float))
    return about_middle.replace(com=about_middle.com + middle)


def checked_solid(
    vertices: Float[AnyArray, "v 3"], faces: Integer[AnyArray, "f 3"]
) -> tuple[Float[AnyArray, "v 3"], Integer[AnyArray, "f 3"]]:
    """The mesh after the checks that its values allow, as `mass_properties` describes.

    Returns:
      float64 and int64 NumPy arrays where both are concrete, else JAX arrays.

    Raises:
      ValueError: a defect of the mesh by its name.
    """
    known = [not isinstance(x, jax.core.Tracer) for x in (vertices, faces)]
    if all(known):
        return checked_mesh(vertices, faces)
    for name, value in (("vertices", vertices), ("faces", faces)):
        if value.ndim != 2 or value.shape[1] != 3:
            raise ValueError(
                f"`{name}` has shape {value.shape}, expected (n, 3); vmap over further axes"
            )
    if known[1]:
        check_closed(np.asarray(faces), len(vertices))
    return jnp.asarray(vertices), jnp.asarray(faces)


def check_density(density: Density) -> None:
    """Raises `ValueError` for a density (kg/m³) that is known and not one positive number."""
    if np.shape(density) != ():
        raise ValueError(f"`density` has shape {np.shape(density)}, expected one number; vmap")
    if not isinstance(density, jax.core.Tracer) and not (np.isfinite(density) and density > 0.0):
        raise ValueError(f"`density` must be positive and finite, but is {density} kg/m³")


def polyhedron_properties(
    vertices: Float[Array, "v 3"],
    faces: Integer[AnyArray, "f 3"],
    density: Density = 1.0,
) -> InertialParameters:
    """`mass_properties` without any check of the mesh, for loops over meshes known to be good.

    A solid whose volume or density is not positive has NaN in every field.
    """
    # The integrals over a closed surface do not depend on the reference point, nor do their slopes.
    middle = jax.lax.stop_gradient(middle_of(vertices))
    local = vertices - middle
    corners = local[faces[:, 0]], local[faces[:, 1]], local[faces[:, 2]]
    about_middle = _solid_of_triangles(corners, jnp.asarray(density, vertices.dtype))
    return about_middle.replace(com=about_middle.com + middle)


@jax.jit
def _solid_of_triangles(
    corners: tuple[Float[Array, "f 3"], Float[Array, "f 3"], Float[Array, "f 3"]],
    density: Float[Array, ""],
) -> InertialParameters:
    """Solid between the origin and the triangles, each counted with its sign.

    Tonon 2004: a tetrahedron (0, a, b, c) has 6 V = det(a, b, c), the first moment V (a + b + c)/4
    and the second moment V/20 (s sᵀ + a aᵀ + b bᵀ + c cᵀ) with s = a + b + c. Written out by
    coordinates, which XLA turns into sums over contiguous rows.
    """
    a, b, c = ([x[:, i] for i in range(3)] for x in corners)
    terms = [a[i] * (b[j] * c[k] - b[k] * c[j]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    six_volumes = terms[0] + terms[1] + terms[2]
    total = jnp.sum(six_volumes)
    size = jnp.sum(jnp.abs(terms[0]) + jnp.abs(terms[1]) + jnp.abs(terms[2]))
    known = (total > 6.0 * jnp.finfo(total.dtype).eps * size) & (density > 0.0)  # not NaN either
    volume = jnp.where(known, total, jnp.nan) / 6.0
    s = [a[i] + b[i] + c[i] for i in range(3)]
    centroid = jnp.stack([jnp.sum(six_volumes * s[i]) for i in range(3)]) / (24.0 * volume)

    def moment(i: int, j: int) -> Float[Array, ""]:
        squares = s[i] * s[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]
        return jnp.sum(six_volumes * squares) / 120.0 - volume * centroid[i] * centroid[j]

    xx, yy, zz, xy, yz, xz = (
        moment(i, j) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
    )
    second = jnp.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz]).reshape(3, 3)
    return InertialParameters(
        mass=density * volume, com=centroid, inertia=inertia_from_second_moment(density * second)
    )


def middle_of(vertices: Float[AnyArray, "v 3"]) -> Float[AnyArray, "3"]:
    """Middle of the bounding box: the reference point, from which nothing is far."""
    return 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
