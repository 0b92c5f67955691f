"""A body as a grid of small cubes, each with its own mass (thesis §8.2).

In: a closed mesh and the edge of a cube, or masses from anywhere else. Out: `VoxelGrid`, and its
`InertialParameters`, which are differentiable in the masses.
"""

import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Integer
from numpy import ndarray

from mjx_inertia.objects.columns import ColumnCrossings, Grid2, grid_crossings
from mjx_inertia.objects.mesh_defects import checked_mesh
from mjx_inertia.objects.mesh_integrals import Density, check_density, nowhere_negative
from mjx_inertia.spatial import AnyArray, InertialParameters, inertia_from_second_moment

_MOST_VOXELS = 50_000_000


@struct.dataclass
class VoxelGrid:
    """Cubes of uniform density in a box along the axes of the frame."""

    masses: Float[Array, "x y z"]  # kg, of the cube at each index along x, y, z
    corner: Float[Array, "3"]  # of the cube (0, 0, 0) with the least coordinates, m
    edge: Float[Array, ""]  # of a cube, m

    def centers(self) -> Float[Array, "x y z 3"]:
        """Centres of the cubes, m."""
        return self.corner + self.edge * (jnp.moveaxis(jnp.indices(self.masses.shape), 0, -1) + 0.5)


def voxelize(
    vertices: Float[AnyArray, "v 3"],
    faces: Integer[AnyArray, "f 3"],
    density: Density = 1.0,
    *,
    edge: float,
    columns: int = 3,
) -> VoxelGrid:
    """The solid inside a closed mesh as cubes, each with the mass of the solid in it.

    Vertical lines are intersected with the mesh; their length inside each cube is exact, and
    `columns`² of them stand in each. Mass, CoM and tensor converge with the square of the edge,
    because the mass of a cube at the surface is taken to be spread over all of it.

    For a density by voxel, multiply: `grid.replace(masses=grid.masses * density_of_voxel)`, with
    `centers()` to compute it from.

    Args:
      vertices: (v, 3), m.
      faces: (f, 3), outward.
      density: kg/m³; with 1, the masses are volumes.
      edge: of a cube, m.
      columns: in each cube, along x and along y.

    Raises:
      ValueError: a defect of the mesh by its name; an edge, a density or a number of columns that
        is not positive; more than 50 million cubes.
    """
    check_density(density)
    if not (np.isfinite(edge) and edge > 0.0):
        raise ValueError(f"`edge` must be positive, but is {edge} m")
    if columns < 1:
        raise ValueError(f"`columns` must be 1 or more, but is {columns}")
    points, triangles = checked_mesh(vertices, faces)
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    cells = np.maximum(1, np.ceil(extent / edge - 1e-9)).astype(int)
    if cells.prod(dtype=np.float64) > _MOST_VOXELS:
        raise ValueError(
            f"`edge` {edge} m cuts the mesh of {extent.tolist()} m into {cells.tolist()} cubes, "
            f"more than {_MOST_VOXELS}; give a larger edge"
        )
    corner = low - 0.5 * (cells * edge - extent)  # the mesh stands amid the grid
    local = points - corner
    grid = Grid2(
        np.zeros(2), np.full(2, edge / columns), (int(cells[0]) * columns, int(cells[1]) * columns)
    )
    crossings = grid_crossings(local[triangles], triangles, grid)
    lengths = _lengths_in_cells(crossings, (*grid.shape, int(cells[2])), edge)
    shares = lengths.reshape(cells[0], columns, cells[1], columns, cells[2]).mean(axis=(1, 3))
    masses = jnp.asarray(density * edge**3) * jnp.asarray(shares)
    return VoxelGrid(masses, jnp.asarray(corner), jnp.asarray(edge, masses.dtype))


def voxel_properties(grid: VoxelGrid) -> InertialParameters:
    """Inertial parameters of a grid: points at the centres, and the own inertia of each cube.

    A cube of mass m and edge h has m h²/6 about each axis through its centre. A grid whose mass is
    not positive, or with a cube of negative mass (beyond rounding), has NaN in every field.
    """
    total = jnp.sum(grid.masses)
    known = (total > 0.0) & nowhere_negative(grid.masses)
    mass = jnp.where(known, total, jnp.nan)
    middle = 0.5 * jnp.array(grid.masses.shape) * grid.edge
    x, y, z = (
        grid.edge * (jnp.arange(n) + 0.5) - m
        for n, m in zip(grid.masses.shape, middle, strict=True)
    )
    along = (grid.masses.sum((1, 2)), grid.masses.sum((0, 2)), grid.masses.sum((0, 1)))
    com = jnp.stack([jnp.sum(m * r) for m, r in zip(along, (x, y, z), strict=True)]) / mass
    x, y, z = x - com[0], y - com[1], z - com[2]
    xx, yy, zz = (
        jnp.sum(m * (r * r + grid.edge**2 / 12.0)) for m, r in zip(along, (x, y, z), strict=True)
    )
    xy = jnp.einsum("ab,a,b->", grid.masses.sum(2), x, y, precision="highest")
    xz = jnp.einsum("ac,a,c->", grid.masses.sum(1), x, z, precision="highest")
    yz = jnp.einsum("bc,b,c->", grid.masses.sum(0), y, z, precision="highest")
    second = jnp.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz]).reshape(3, 3)
    return InertialParameters(
        mass=mass,
        com=grid.corner + middle + com,
        inertia=inertia_from_second_moment(jnp.where(known, second, jnp.nan)),
    )


def _lengths_in_cells(
    crossings: ColumnCrossings, shape: tuple[int, int, int], edge: float
) -> Float[ndarray, "x y z"]:
    """Share of each cell of each column that lies inside the solid.

    A crossing that leaves the solid at height z adds all that is below z, one that enters takes it
    away: whole cells below and a part of the cell that holds z.
    """
    count = shape[2]
    cell = np.clip(np.floor(crossings.height / edge).astype(np.int64), 0, count - 1)
    part = np.zeros((shape[0] * shape[1], count + 1))
    np.add.at(part, (crossings.column, cell), crossings.leaves * (crossings.height / edge - cell))
    below = np.zeros_like(part)
    np.add.at(below, (crossings.column, cell), crossings.leaves.astype(np.float64))
    whole = np.cumsum(below[:, ::-1], axis=1)[:, ::-1]  # from this cell up
    return (part[:, :count] + whole[:, 1:]).reshape(shape)
