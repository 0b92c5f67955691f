"""Vectors and rotations as components, with zeros and ones that are known left out of the sums.

Written out, each operation runs over a whole batch at once; and robots are full of right angles, so
most products of their rotations need not be computed. In: components, each an array or a Python
float, which is known while a program is traced. Out: the same.
"""

import weakref
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.spatial.arrays import AnyArray
from mjx_inertia.spatial.computed_once import computed_once

Component = Array | float
Vec3 = tuple[Component, Component, Component]
Mat3 = tuple[Vec3, Vec3, Vec3]  # rows
Upper = tuple[Component, Component, Component, Component, Component, Component]

ZERO: Vec3 = (0.0, 0.0, 0.0)
IDENTITY: Mat3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

# what `once` gave, by its identity while it lives
_settled: weakref.WeakValueDictionary[int, Array] = weakref.WeakValueDictionary()


def components(array: AnyArray) -> Any:
    """Nested tuples of the entries: floats where the array is known, arrays where it is traced."""
    if isinstance(array, jax.core.Tracer):
        return tuple(components(row) for row in array) if array.ndim else array
    return _tuples(np.asarray(array, np.float64).tolist())


def _tuples(nested: Any) -> Any:
    return tuple(_tuples(x) for x in nested) if isinstance(nested, list) else nested


def stacked(nested: Any, dtype: Any) -> Float[Array, "..."]:
    """One array of nested sequences of components: the opposite of `components`."""
    shape, leaves = [len(nested)], list(nested)
    while isinstance(leaves[0], tuple | list):
        shape.append(len(leaves[0]))
        leaves = [entry for row in leaves for entry in row]
    return jnp.stack([jnp.asarray(x, dtype) for x in leaves]).reshape(shape)


def once(nested: Any) -> Any:
    """The same components, each computed in one place wherever they are used.

    What is so already, or is the opposite of such a component, stays as it is.
    """
    if isinstance(nested, tuple | list):
        return tuple(once(x) for x in nested)
    if isinstance(nested, float) or id(nested) in _settled:
        return nested
    return _settle(computed_once(nested))


def _settle(x: Array) -> Array:
    if isinstance(x, jax.core.Tracer):
        _settled[id(x)] = x
    return x


def _opposite(x: Component) -> Component:
    if isinstance(x, float | int):
        return -x
    return _settle(-x) if id(x) in _settled else -x


def plus(a: Component, b: Component) -> Component:
    """Sum."""
    if isinstance(a, float) and a == 0.0:
        return b
    return a if isinstance(b, float) and b == 0.0 else a + b


def minus(a: Component, b: Component) -> Component:
    """Difference."""
    if isinstance(a, float) and a == 0.0:
        return _opposite(b)
    return a if isinstance(b, float) and b == 0.0 else a - b


def times(a: Component, b: Component) -> Component:
    """Product; nothing at all where a factor is known to be zero."""
    if isinstance(b, float):
        a, b = b, a
    if isinstance(a, float):
        if a == 0.0:
            return 0.0
        if abs(a) == 1.0:
            return b if a == 1.0 else _opposite(b)
    return a * b


def dot(a: Vec3, b: Vec3) -> Component:
    """Inner product."""
    total = times(a[0], b[0])
    for x, y in zip(a[1:], b[1:], strict=True):
        total = plus(total, times(x, y))
    return total


def root(square: Component) -> Component:
    """Square root, with a derivative of zero where it vanishes."""
    if isinstance(square, float):
        return square**0.5
    zero = square == 0.0
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, square)))


def _each(operation: Callable[[Component, Component], Component], a: Vec3, b: Vec3) -> Vec3:
    return operation(a[0], b[0]), operation(a[1], b[1]), operation(a[2], b[2])


def add(a: Vec3, *others: Vec3) -> Vec3:
    """Sum of vectors."""
    for b in others:
        a = _each(plus, a, b)
    return a


def subtract(a: Vec3, b: Vec3) -> Vec3:
    """Difference of vectors."""
    return _each(minus, a, b)


def scale(factor: Component, a: Vec3) -> Vec3:
    """`factor` times a vector."""
    return times(factor, a[0]), times(factor, a[1]), times(factor, a[2])


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Cross product a × b."""
    return (
        minus(times(a[1], b[2]), times(a[2], b[1])),
        minus(times(a[2], b[0]), times(a[0], b[2])),
        minus(times(a[0], b[1]), times(a[1], b[0])),
    )


def transpose(m: Mat3) -> Mat3:
    """The transpose."""
    x, y, z = zip(*m, strict=True)
    return x, y, z


def apply(m: Mat3, a: Vec3) -> Vec3:
    """Matrix times vector."""
    return dot(m[0], a), dot(m[1], a), dot(m[2], a)


def multiply(a: Mat3, b: Mat3) -> Mat3:
    """Matrix product."""
    columns = transpose(b)
    return apply(columns, a[0]), apply(columns, a[1]), apply(columns, a[2])


def turn_axis(rotation: Mat3) -> Vec3:
    """Axis of a rotation times the sine of its angle."""
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = rotation
    return scale(0.5, (minus(zy, yz), minus(xz, zx), minus(yx, xy)))


def upper_half(m: Mat3) -> Upper:
    """xx, xy, xz, yy, yz, zz of a symmetric matrix."""
    return m[0][0], m[0][1], m[0][2], m[1][1], m[1][2], m[2][2]


def mirrored(upper: Upper) -> Mat3:
    """The symmetric matrix with the entries xx, xy, xz, yy, yz, zz."""
    xx, xy, xz, yy, yz, zz = upper
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def symmetric_change(rotation: Mat3, tensor: Mat3) -> Mat3:
    """R I Rᵀ of a symmetric tensor."""
    half = once(multiply(rotation, tensor))
    pairs = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    xx, xy, xz, yy, yz, zz = (dot(half[i], rotation[j]) for i, j in pairs)
    return mirrored((xx, xy, xz, yy, yz, zz))


def axis_rotation(axis: Vec3, angle: Component) -> Mat3:
    """Rotation by `angle` (rad) about a unit `axis`: Rodrigues' formula.

    The diagonal is written a² + (1 - a²) cos, so that about a coordinate axis all is folded.
    """
    c, s = jnp.cos(angle), jnp.sin(angle)
    x, y, z = axis
    rest = minus(1.0, c)

    def diagonal(a: Component) -> Component:
        square = times(a, a)
        return plus(square, times(minus(1.0, square), c))

    def beside(a: Component, b: Component, turn: Component) -> Component:
        return plus(times(times(a, b), rest), times(turn, s))

    return (
        (diagonal(x), beside(x, y, times(-1.0, z)), beside(x, z, y)),
        (beside(x, y, z), diagonal(y), beside(y, z, times(-1.0, x))),
        (beside(x, z, times(-1.0, y)), beside(y, z, x), diagonal(z)),
    )
