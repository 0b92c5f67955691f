"""The operators of `unrolled` as functions of plain tuples, for arms and space robots."""

from collections.abc import Sequence

from mjx_inertia.spatial.unrolled import (
    IDENTITY,
    ZERO,
    Component,
    Matrix,
    SymmetricMatrix,
    Vector,
    axis_rotation,
    components,
    computed_once as once,
    minus,
    plus,
    rotation_axis as turn_axis,
    safe_sqrt as root,
    stacked,
    times,
)

__all__ = [
    "IDENTITY", "ZERO", "Component", "Mat3", "Vec3", "add", "apply", "axis_rotation", "components",
    "cross", "dot", "minus", "mirrored", "multiply", "once", "plus", "root", "scale", "stacked",
    "subtract", "symmetric_change", "times", "transpose", "turn_axis", "upper_half",
]  # fmt: skip

Vec3 = tuple[Component, ...]
Mat3 = tuple[Vec3, ...]
Entries = Sequence[Component]
Rows = Sequence[Entries]


def dot(a: Entries, b: Entries) -> Component:
    return Vector(a) @ b


def add(a: Entries, *others: Entries) -> Vector:
    total = Vector(a)
    for other in others:
        total = total + other
    return total


def subtract(a: Entries, b: Entries) -> Vector:
    return Vector(a) - b


def scale(factor: Component, a: Entries) -> Vector:
    return factor * Vector(a)


def cross(a: Entries, b: Entries) -> Vector:
    return Vector(a).cross(b)


def transpose(m: Rows) -> Matrix:
    return Matrix(m).T


def apply(m: Rows, a: Entries) -> Vector:
    return Matrix(m) @ Vector(a)


def multiply(a: Rows, b: Rows) -> Matrix:
    return Matrix(a) @ Matrix(b)


def upper_half(m: Rows) -> tuple[Component, ...]:
    return m[0][0], m[0][1], m[0][2], m[1][1], m[1][2], m[2][2]


def mirrored(upper: Entries) -> SymmetricMatrix:
    xx, xy, xz, yy, yz, zz = upper
    return SymmetricMatrix(((xx,), (xy, yy), (xz, yz, zz)))


def symmetric_change(rotation: Rows, tensor: Rows) -> SymmetricMatrix:
    return mirrored(upper_half(tensor)).rotated(Matrix(rotation))
