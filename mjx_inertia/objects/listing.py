"""What an object amounts to, in one line of a table.

In: `ObjectModel`s. Out: `ObjectSummary` of each, and a table in plain text.
"""

import dataclasses
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.command import aligned
from mjx_inertia.objects.model import ObjectModel


@dataclasses.dataclass(frozen=True, eq=False)
class ObjectSummary:
    """Figures of one object, in the units that one would say them in."""

    name: str  # of the object
    category: str  # of the catalogue
    size_mm: Float[ndarray, "3"]  # extents along x, y, z
    mass: float  # kg
    com_mm: Float[ndarray, "3"]  # in the object frame
    moments: Float[ndarray, "3"]  # principal moments about the CoM, largest first, kg m²
    axes: Float[ndarray, "3 3"]  # of these moments, rows, unit vectors in the object frame
    # of the uniform ellipsoid with the same mass and tensor, along `axes`, m
    semi_axes: Float[ndarray, "3"]


def summarize_object(obj: ObjectModel) -> ObjectSummary:
    """The figures of an object."""
    mass = float(obj.inertial.mass)
    moments, axes = np.linalg.eigh(np.asarray(obj.inertial.inertia, np.float64))
    moments, axes = moments[::-1], axes.T[::-1]
    # an ellipsoid has I₁ = m (b² + c²) / 5, so a² = 5 (I₁ + I₂ + I₃ - 2 I₁) / (2 m)
    squares = 2.5 * (moments.sum() - 2.0 * moments) / mass
    return ObjectSummary(
        name=obj.name,
        category=obj.category,
        size_mm=2e3 * obj.half_extents,
        mass=mass,
        com_mm=1e3 * np.asarray(obj.inertial.com, np.float64),
        moments=moments,
        axes=axes,
        semi_axes=np.sqrt(np.maximum(squares, 0.0)),
    )


def object_table(objects: Iterable[ObjectModel]) -> str:
    """Name, category, size, mass, CoM, principal moments and `pieces_error` of each, aligned."""
    head = ("name", "category", "size / mm", "mass / kg", "CoM / mm", "principal moments / kg m²")
    head = (*head, "pieces off, %")
    rows = [
        head,
        *((*_cells(summarize_object(o)), f"{100.0 * o.pieces_error:.1f}") for o in objects),
    ]
    lines = aligned(rows, left=(0, 1, 2, 4, 5))
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


def _cells(figures: ObjectSummary) -> tuple[str, ...]:
    return (
        figures.name,
        figures.category,
        " x ".join(f"{x:3.0f}" for x in figures.size_mm),
        f"{figures.mass:.3f}",
        " ".join(f"{x + 0.0:6.1f}" for x in np.round(figures.com_mm, 1)),
        " ".join(f"{x:.3e}" for x in figures.moments),
    )
