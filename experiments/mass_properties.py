"""Mass properties of meshes a second: one compiled call for a batch against trimesh, mesh by mesh.

    python experiments/mass_properties.py [meshes=256] [repeats=7]

A batch of unlike meshes (tori, cylinders, capsules, convex rocks of 100 to 1,300 faces), padded to
the largest, and one of deformations of a single mesh, in double precision on one device. trimesh
runs its own function on the triangles, without the making of its mesh objects. Both start from
NumPy arrays and end there, alternating in one process; compilation is timed apart. A single mesh
is timed with all its checks.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import trimesh
from numpy import ndarray

from mjx_inertia import runtime
from mjx_inertia.dataset import provenance
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import mass_properties, polyhedron_properties
from mjx_inertia.spatial import InertialParameters

DENSITY = 1000.0  # kg/m³


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    meshes: int = 256  # of a batch
    repeats: int = 7  # of both, in turn


def unlike_meshes(count: int) -> list[trimesh.Trimesh]:
    """Closed meshes of four kinds and many sizes, away from the origin."""
    rng = np.random.default_rng(0)
    meshes = []
    for i in range(count):
        sections = int(rng.integers(8, 26))
        match i % 4:
            case 0:
                mesh = trimesh.creation.torus(0.1, 0.03, sections, sections)
            case 1:
                mesh = trimesh.creation.cylinder(0.05, 0.2, sections=10 * sections)
            case 2:
                mesh = trimesh.creation.capsule(0.1, 0.03, count=(sections, sections))
            case _:
                mesh = trimesh.convex.convex_hull(rng.normal(0.0, 0.05, (40 * sections, 3)))
                mesh = mesh.subdivide()
        mesh.apply_transform(trimesh.transformations.random_rotation_matrix(rng.uniform(size=3)))
        meshes.append(mesh.apply_translation(rng.uniform(-0.3, 0.3, 3)))
    return meshes


def deformations(count: int) -> list[trimesh.Trimesh]:
    """One torus of 1,024 faces, stretched and bent `count` times."""
    rng = np.random.default_rng(1)
    one = trimesh.creation.torus(0.1, 0.03, 32, 16)
    bent = []
    for stretch, bend in zip(
        rng.uniform(0.5, 2.0, (count, 3)), rng.uniform(0, 2, count), strict=True
    ):
        vertices = np.asarray(one.vertices) * stretch
        vertices[:, 2] += bend * vertices[:, 0] ** 2
        bent.append(trimesh.Trimesh(vertices, one.faces, process=False))
    return bent


def padded(meshes: list[trimesh.Trimesh]) -> tuple[ndarray, ndarray]:
    """Vertices (n, v, 3) and faces (n, f, 3); repeated vertices and faces of no area are added."""
    v, f = max(len(m.vertices) for m in meshes), max(len(m.faces) for m in meshes)
    vertices = [np.pad(m.vertices, ((0, v - len(m.vertices)), (0, 0)), "edge") for m in meshes]
    faces = [np.pad(m.faces, ((0, f - len(m.faces)), (0, 0))) for m in meshes]
    return np.stack(vertices), np.stack(faces)


def rival(arrays: list[tuple[ndarray, ndarray]]) -> InertialParameters:
    """The same numbers by trimesh."""
    found = [
        trimesh.triangles.mass_properties(vertices[faces], density=DENSITY)
        for vertices, faces in arrays
    ]
    return InertialParameters(
        *(jnp.array([f[key] for f in found]) for key in ("mass", "center_mass", "inertia"))
    )


def timed(run: Callable[[], InertialParameters]) -> tuple[float, InertialParameters]:
    """Seconds and result of one run, the result on the host."""
    start = time.perf_counter()
    result = jax.tree.map(np.asarray, run())
    return time.perf_counter() - start, result


def difference(ours: InertialParameters, theirs: InertialParameters, sizes: ndarray) -> float:
    """Largest difference relative to the mass, the size and the largest entry of the tensor."""
    scale = np.abs(theirs.inertia).max(axis=(1, 2))
    return max(
        float(np.max(np.abs(ours.mass / theirs.mass - 1.0))),
        float(np.max(np.abs(ours.com - theirs.com).max(axis=1) / sizes)),
        float(np.max(np.abs(ours.inertia - theirs.inertia).max(axis=(1, 2)) / scale)),
    )


def compare(meshes: list[trimesh.Trimesh], repeats: int, *, shared: bool) -> dict[str, float]:
    """Rates of both on one batch, and how far they differ; `shared`: all have the same faces."""
    vertices, faces = padded(meshes)
    if shared:
        faces = faces[0]
    batched = jax.jit(jax.vmap(polyhedron_properties, in_axes=(0, None if shared else 0, None)))
    arrays = [(np.array(m.vertices), np.array(m.faces)) for m in meshes]
    first, ours = timed(lambda: batched(vertices, faces, DENSITY))
    _, theirs = timed(lambda: rival(arrays))
    seconds: dict[str, list[float]] = {"ours": [], "trimesh": []}
    for _ in range(repeats):
        seconds["ours"].append(timed(lambda: batched(vertices, faces, DENSITY))[0])
        seconds["trimesh"].append(timed(lambda: rival(arrays))[0])
    for name, values in seconds.items():
        print(f"{name}: {[round(1e3 * s, 1) for s in values]} ms for {len(meshes)} meshes")
    sizes = np.array([np.ptp(m.vertices, axis=0).max() for m in meshes])
    ours_s, theirs_s = (statistics.median(values) for values in seconds.values())
    return {
        "ours": len(meshes) / ours_s,
        "trimesh": len(meshes) / theirs_s,
        "difference": difference(ours, theirs, sizes),
        "compile_s": first - ours_s,
    }


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Measures and prints all times of both."""
    count, repeats = options.meshes, options.repeats
    jax.config.update("jax_compilation_cache_dir", tempfile.mkdtemp())  # compile_s from cold
    runtime.configure(devices=1, float64=True)
    unlike = unlike_meshes(count)
    batch = compare(unlike, repeats, shared=False)
    deformed = compare(deformations(count), repeats, shared=True)
    checked = statistics.median(
        timed(lambda m=m: mass_properties(m.vertices, m.faces, DENSITY))[0] for m in unlike[:32]
    )
    print("trimesh", version("trimesh"), "numpy", version("numpy"))
    sizes = [len(m.faces) for m in unlike]
    return {
        "ours_meshes_per_s": round(batch["ours"], 1),
        "trimesh_meshes_per_s": round(batch["trimesh"], 1),
        "ratio": round(batch["ours"] / batch["trimesh"], 2),
        "max_relative_difference": max(batch["difference"], deformed["difference"]),
        "deformed_ours_meshes_per_s": round(deformed["ours"], 1),
        "deformed_trimesh_meshes_per_s": round(deformed["trimesh"], 1),
        "deformed_ratio": round(deformed["ours"] / deformed["trimesh"], 2),
        "checked_single_mesh_ms": round(1e3 * checked, 1),
        "compile_s": round(batch["compile_s"], 2),
        "meshes": count,
        "faces_median": statistics.median(sizes),
        "faces_max": max(sizes),
        "device": provenance()["device"],
    }


if __name__ == "__main__":
    main()
