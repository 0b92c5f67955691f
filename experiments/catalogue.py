"""How exact the objects are: convex pieces, exported files, voxels, and shapes that cameras see.

    python experiments/catalogue.py [draws=12] [cells=56] [seen=[wedge,rock]]

For the whole catalogue: the share of its volume by which an object's convex pieces are off, and
how far MuJoCo's compiled mass, CoM and tensor are from ours in both formats. For the hammer: what
grids of voxels miss. For eight shapes: volume, CoM and moments from eleven depth views with 1 mm of
noise, under uniform density and with a mass known to 1 %, and by how many of the stated standard
deviations they are off. Prints the tables of `docs/objects.md`.
"""

import statistics
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import (
    CameraSettings,
    FusionSettings,
    ObjectModel,
    camera_ring,
    cast_views,
    combine_shape_and_push,
    estimate_shape,
    export_objects,
    join_views,
    load_catalogue,
    mass_properties,
    voxel_properties,
    voxelize,
    with_noise,
)
from mjx_inertia.spatial import InertialParameters, PlanarInertia, combine

SEEN = ("wedge", "capsule", "torus", "l_shape", "clay_brick", "rock", "dog", "mug")
NOISE = 0.001  # m
MASS_ERROR = 0.01  # standard deviation of the mass, relative
VOXELS_MM = (8.0, 4.0, 2.0, 1.0)


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    draws: int = 12  # of the views' noise, for the covariance of a shape
    cells: int = 56  # of the fused grid, along an edge
    seen: tuple[str, ...] = SEEN  # by cameras


def largest_difference(
    found: InertialParameters, true: InertialParameters, size: float
) -> tuple[float, float, float]:
    """Of mass, CoM and tensor, relative to the mass, the size (m) and the largest moment."""
    return (
        abs(float(found.mass / true.mass) - 1.0),
        float(np.abs(np.asarray(found.com - true.com)).max()) / size,
        float(np.abs(found.inertia - true.inertia).max() / np.abs(true.inertia).max()),
    )


def compiled(path: Path) -> InertialParameters:
    """What MuJoCo makes of a file of one body, in the body's frame."""
    model = mujoco.MjSpec.from_file(str(path)).compile()
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[1])
    axes = rotation.reshape(3, 3)
    tensor = axes @ np.diag(model.body_inertia[1]) @ axes.T
    return InertialParameters(*map(jnp.asarray, (model.body_mass[1], model.body_ipos[1], tensor)))


def export_differences(objects: Mapping[str, ObjectModel]) -> dict[str, float]:
    """The largest difference of any object, by format."""
    worst = {}
    with tempfile.TemporaryDirectory() as folder:
        for form in ("urdf", "mjcf"):
            paths = export_objects(objects, folder, form)
            worst[form] = max(
                max(largest_difference(compiled(path), obj.inertial, obj.half_extents.max()))
                for path, obj in zip(paths, objects.values(), strict=True)
            )
    return worst


def voxel_differences(obj: ObjectModel) -> dict[float, tuple[float, float, float]]:
    """By the edge of a voxel, mm; each part has its own grid."""
    found = {}
    for edge_mm in VOXELS_MM:
        grids = [
            voxelize(p.mesh.vertices, p.mesh.faces, p.density, edge=1e-3 * edge_mm)
            for p in obj.parts
        ]
        bodies = [voxel_properties(grid) for grid in grids]
        whole = combine(jax.tree.map(lambda *leaves: np.stack(leaves), *bodies))
        found[edge_mm] = largest_difference(whole, obj.inertial, obj.half_extents.max())
    return found


def numbers(body: InertialParameters) -> Float[ndarray, "10"]:
    """In the order of `FULL_INERTIA_NAMES`."""
    below = np.tril_indices(3)
    return np.concatenate([[body.mass], body.com, np.asarray(body.inertia)[below]])


def seen_by_cameras(obj: ObjectModel, seed: int, draws: int, cells: int) -> dict[str, float]:
    """Errors of one shape, its mass being that of the object in the catalogue."""
    mesh, mass = obj.mesh, float(obj.inertial.mass)
    target = (float(obj.center[0]), float(obj.center[1]), float(obj.center[2]))
    distance = 6.0 * float(obj.half_extents.max())
    cameras = join_views(
        *(
            camera_ring(count, target=target, distance=distance, elevation=e, start=e)
            for count, e in ((6, 0.05), (4, 0.7), (1, 1.45))
        )
    )
    view_key, draw_key, mass_key = jax.random.split(jax.random.key(seed), 3)
    exact = cast_views(mesh.vertices, mesh.faces, cameras, CameraSettings(128, 128, 260.0))
    views = with_noise(exact, NOISE, key=view_key)
    settings = FusionSettings(cells=cells)
    shape = estimate_shape(views, noise=NOISE, key=draw_key, draws=draws, settings=settings)
    pushed = mass * (1.0 + MASS_ERROR * jax.random.normal(mass_key))
    unknown = np.full(3, np.inf)
    full = combine_shape_and_push(
        shape,
        PlanarInertia(pushed, jnp.asarray(jnp.nan), jnp.full(2, jnp.nan)),
        np.diag([(MASS_ERROR * mass) ** 2, *unknown]),
    )
    truth = mass_properties(mesh.vertices, mesh.faces, mass / mesh.volume)
    error = numbers(full.inertial) - numbers(truth)
    moments = [4, 6, 9]
    return {
        "measured": shape.measured,
        "volume_percent": 100.0 * abs(float(shape.unit_density.mass) / mesh.volume - 1.0),
        "com_mm": 1e3 * float(np.linalg.norm(error[1:4])),
        "moments_percent": 100.0 * float(np.abs(error / numbers(truth))[moments].max()),
        "stated_percent": 100.0
        * float((np.sqrt(np.diag(full.covariance)) / numbers(truth))[moments].max()),
        "largest_z": float(np.abs(error / np.sqrt(np.diag(full.covariance))).max()),
    }


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Measures and prints tables."""
    runtime.configure(devices=1, float64=True)
    objects = load_catalogue()
    if unknown := set(options.seen) - set(objects):
        raise ValueError(f"seen={sorted(unknown)}: not in the catalogue")
    off = sorted((obj.pieces_error, name, len(obj.pieces)) for name, obj in objects.items())
    print("| object | pieces | volume off, % |\n| --- | --- | --- |")
    for error, name, count in off[::-1]:
        print(f"| {name} | {count} | {100.0 * error:.2f} |")
    agreement = export_differences(objects)
    voxels = voxel_differences(objects["hammer"])
    print("| voxel, mm | mass | CoM | tensor |\n| --- | --- | --- | --- |")
    for edge, row in voxels.items():
        print(f"| {edge:g} | " + " | ".join(f"{x:.1e}" for x in row) + " |")
    views = {
        name: seen_by_cameras(objects[name], seed, options.draws, options.cells)
        for seed, name in enumerate(options.seen)
    }
    columns = next(iter(views.values()))
    print(f"| object | {' | '.join(columns)} |\n|{' --- |' * (len(columns) + 1)}")
    for name, row in views.items():
        print(f"| {name} | " + " | ".join(f"{x:.2f}" for x in row.values()) + " |")
    errors = [error for error, _, _ in off]
    headline = {
        "objects": len(objects),
        "pieces_error_median": statistics.median(errors),
        "pieces_error_over_5_percent": sum(error > 0.05 for error in errors),
        "pieces_error_max": max(errors),
        "urdf_max_relative_difference": agreement["urdf"],
        "mjcf_max_relative_difference": agreement["mjcf"],
        "voxel_1mm_max_relative_difference": max(voxels[1.0]),
        "views_volume_percent_median": statistics.median(
            row["volume_percent"] for row in views.values()
        ),
        "views_moments_percent_median": statistics.median(
            row["moments_percent"] for row in views.values()
        ),
        "views_largest_z": max(row["largest_z"] for row in views.values()),
    }
    return {k: float(f"{v:.3g}") for k, v in headline.items()}


if __name__ == "__main__":
    main()
