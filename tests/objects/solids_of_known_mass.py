"""Solids of unit density with closed forms, and a reference in extended precision."""

import dataclasses

import numpy as np
import trimesh


@dataclasses.dataclass(frozen=True)
class KnownSolid:
    """A mesh, the integrals of the smooth solid that it approximates, and how well it does."""

    mesh: trimesh.Trimesh
    volume: float
    com: np.ndarray
    inertia: np.ndarray
    tolerance: float


def box(x=0.3, y=0.2, z=0.1):
    volume = x * y * z
    inertia = volume / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
    return KnownSolid(trimesh.creation.box((x, y, z)), volume, np.zeros(3), inertia, 1e-13)


def tetrahedron():
    """The corner of the unit cube: volume 1/6, CoM 1/4, ∫ x² = 1/60 and ∫ x y = 1/120."""
    mesh = trimesh.Trimesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        process=False,
    )
    second = np.full((3, 3), 1 / 120) + np.eye(3) / 120 - np.full((3, 3), 1 / 16 / 6)
    inertia = np.trace(second) * np.eye(3) - second
    return KnownSolid(mesh, 1 / 6, np.full(3, 0.25), inertia, 1e-13)


def ellipsoid(a=0.3, b=0.2, c=0.1):
    mesh = trimesh.creation.icosphere(4)
    mesh.apply_transform(np.diag([a, b, c, 1.0]))
    volume = 4 / 3 * np.pi * a * b * c
    inertia = volume / 5 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    return KnownSolid(mesh, volume, np.zeros(3), inertia, 4e-3)


def torus(major=0.2, minor=0.07, sections=64):
    mesh = trimesh.creation.torus(major, minor, sections, sections)
    volume = 2 * np.pi**2 * major * minor**2
    across = volume * (4 * major**2 + 5 * minor**2) / 8
    along = volume * (4 * major**2 + 3 * minor**2) / 4
    return KnownSolid(mesh, volume, np.zeros(3), np.diag([across, across, along]), 1e-2)


def cylinder(radius=0.1, height=0.4, sections=1024):
    mesh = trimesh.creation.cylinder(radius, height, sections=sections)
    volume = np.pi * radius**2 * height
    across = volume * (3 * radius**2 + height**2) / 12
    inertia = np.diag([across, across, volume * radius**2 / 2])
    return KnownSolid(mesh, volume, np.zeros(3), inertia, 2e-5)


def integrals_in_extended_precision(vertices, faces):
    """Volume, CoM and tensor about it, by Eberly's form of Mirtich's integrals, in 80 bits."""
    points = np.asarray(vertices).astype(np.longdouble)
    points, shift = points - points.mean(axis=0), points.mean(axis=0)
    p, q, r = (points[np.asarray(faces)[:, k]] for k in range(3))
    normal = np.cross(q - p, r - p)
    f1 = p + q + r
    f2 = p * p + q * (p + q) + r * f1
    f3 = p * p * p + q * (p * p + q * (p + q)) + r * f2
    g = [f2 + x * (f1 + x) for x in (p, q, r)]
    volume = np.sum(normal[:, 0] * f1[:, 0]) / 6
    com = np.sum(normal * f2, axis=0) / 24 / volume
    square = np.sum(normal * f3, axis=0) / 60 - volume * com**2
    following = [1, 2, 0]
    product = (
        np.sum(normal * sum(x[:, following] * y for x, y in zip((p, q, r), g, strict=True)), axis=0)
        / 120
        - volume * com * com[following]
    )
    x, y, z = square
    xy, yz, zx = product
    inertia = np.array([[y + z, -xy, -zx], [-xy, x + z, -yz], [-zx, -yz, x + y]])
    return float(volume), (com + shift).astype(float), inertia.astype(float)


def worst_difference(body, volume, com, inertia, size):
    """Largest difference relative to the mass, the size and the largest entry of the tensor."""
    return max(
        abs(float(body.mass) / volume - 1.0),
        float(np.abs(np.asarray(body.com) - com).max()) / size,
        float(np.abs(np.asarray(body.inertia) - inertia).max() / np.abs(inertia).max()),
    )
