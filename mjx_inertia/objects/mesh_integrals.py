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
import trimesh
from jaxtyping import Array, Bool, Float, Integer
from numpy import ndarray

from mjx_inertia.objects.mesh_defects import check_closed, checked_mesh
from mjx_inertia.spatial import AnyArray, InertialParameters, inertia_from_second_moment

_ROWS = 32
_ROUNDING = 1e-5  # of the largest value: sums of single precision miss 0 by less
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
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
      intersect or overlap itself. This takes 50 ms for a small mesh and a few hundred for tens of
      thousands of faces; `polyhedron_properties` does without.
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
      taken about the middle of the bounding box, so a frame far away costs no more than the
      rounding of the vertices.

    Warns:
      UserWarning: a self-intersection or overlap, named, that falsifies less than 0.1 % of the
        volume.

    Raises:
      ValueError: a defect of the mesh by its name, with what to do; or a density that is not
        positive.
    """
    check_density(density)
    points, triangles = _checked_solid(vertices, faces)
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
    middle = _middle(vertices)
    local = vertices - middle
    missing = (1 << max(6, (len(faces) - 1).bit_length())) - len(faces)
    a, b, c = (jnp.asarray(np.pad(local[faces[:, k]], ((0, missing), (0, 0)))) for k in range(3))
    about_middle = _solid_of_triangles((a, b, c), jnp.asarray(density, float))
    return about_middle.replace(com=about_middle.com + middle)


def solid_properties_float64(mesh: trimesh.Trimesh, density: float) -> InertialParameters:
    """`known_solid_properties` in double precision, as NumPy arrays."""
    with jax.enable_x64(True):
        body = known_solid_properties(mesh.vertices, mesh.faces, density)
        return jax.tree.map(np.asarray, body)


def _checked_solid(
    vertices: Float[AnyArray, "v 3"], faces: Integer[AnyArray, "f 3"]
) -> tuple[Float[AnyArray, "v 3"], Integer[AnyArray, "f 3"]]:
    """The mesh after the checks that its values allow, as `mass_properties` describes.

    As float64 and int64 NumPy arrays where both are concrete, else as JAX arrays.
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
    if not isinstance(density, jax.core.Tracer) and not is_positive(density):
        raise ValueError(f"`density` must be positive and finite, but is {density!r} kg/m³")


def is_positive(value: object) -> bool:
    """Whether a value is one real number, finite and positive."""
    number = np.asarray(value)
    return number.shape == () and number.dtype.kind in "iuf" and bool(0.0 < number < np.inf)


def polyhedron_properties(
    vertices: Float[Array, "v 3"],
    faces: Integer[AnyArray, "f 3"],
    density: Density = 1.0,
) -> InertialParameters:
    """`mass_properties` without any check of the mesh, for loops over meshes known to be good.

    A solid whose volume or density is not positive has NaN in every field.
    """
    # The integrals over a closed surface do not depend on the reference point, nor do their slopes.
    middle = jax.lax.stop_gradient(_middle(vertices))
    local = vertices - middle
    filled = jnp.pad(jnp.asarray(faces), ((0, -len(faces) % _ROWS), (0, 0)))
    corners = local[filled[:, 0]], local[filled[:, 1]], local[filled[:, 2]]
    about_middle = _solid_of_triangles(corners, jnp.asarray(density, vertices.dtype))
    return about_middle.replace(com=about_middle.com + middle)


@jax.jit
def _solid_of_triangles(
    corners: tuple[Float[Array, "f 3"], Float[Array, "f 3"], Float[Array, "f 3"]],
    density: Float[Array, ""],
) -> InertialParameters:
    """Solid between the origin and the triangles, each counted with its sign; f in whole `_ROWS`.

    Tonon 2004: a tetrahedron (0, a, b, c) has 6 V = det(a, b, c), the first moment V (a + b + c)/4
    and the second moment V/20 (s sᵀ + a aᵀ + b bᵀ + c cᵀ) with s = a + b + c.
    """
    a, b, c = ([x[:, i].reshape(_ROWS, -1) for i in range(3)] for x in corners)
    s = [a[i] + b[i] + c[i] for i in range(3)]
    terms = [a[i] * (b[j] * c[k] - b[k] * c[j]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    six_volumes = terms[0] + terms[1] + terms[2]
    sums = _sums(
        six_volumes,
        jnp.abs(terms[0]) + jnp.abs(terms[1]) + jnp.abs(terms[2]),
        *(six_volumes * s[i] for i in range(3)),
        *(six_volumes * (s[i] * s[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]) for i, j in _PAIRS),
    )
    rounding = 6.0 * jnp.finfo(sums.dtype).eps * sums[1]
    known = (sums[0] > rounding) & (density > 0.0)  # False where a value is NaN
    volume = jnp.where(known, sums[0], jnp.nan) / 6.0
    centroid = sums[2:5] / (24.0 * volume)
    xx, xy, xz, yy, yz, zz = (
        total / 120.0 - volume * centroid[i] * centroid[j]
        for total, (i, j) in zip(sums[5:], _PAIRS, strict=True)
    )
    second = jnp.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz]).reshape(3, 3)
    return InertialParameters(
        mass=density * volume, com=centroid, inertia=inertia_from_second_moment(density * second)
    )


@jax.custom_jvp
def _sums(*terms: Float[Array, "r n"]) -> Float[Array, " k"]:
    """The sum of each of k arrays.

    One reduction of all arrays together reads the mesh once, twenty times faster on a CPU than one
    after the other; its derivative, which JAX does not know, is the sum of the derivatives. Rows
    are summed apart so that single precision keeps its digits over many faces.
    """
    zeros = [np.zeros((), x.dtype) for x in terms]
    by_row = jax.lax.reduce(
        list(terms), zeros, lambda x, y: [p + q for p, q in zip(x, y, strict=True)], [1]
    )
    return jnp.sum(jnp.stack(by_row), axis=1)


@_sums.defjvp
def _sums_jvp(
    primals: tuple[Float[Array, "r n"], ...], tangents: tuple[Float[Array, "r n"], ...]
) -> tuple[Float[Array, " k"], Float[Array, " k"]]:
    return _sums(*primals), jnp.stack([jnp.sum(x) for x in tangents])


def nowhere_negative(values: Float[Array, "..."]) -> Bool[Array, ""]:
    """Whether masses or densities are all at least 0 but for rounding; False where one is NaN."""
    return jnp.min(values) >= -_ROUNDING * jnp.max(values)


def _middle(vertices: Float[AnyArray, "v 3"]) -> Float[AnyArray, "3"]:
    """Middle of the bounding box: the reference point, from which nothing is far."""
    return 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
