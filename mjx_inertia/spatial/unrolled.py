"""Linear algebra of a few unknowns, written out: vectors and matrices with separate entries.

Written out, each operation runs over a whole batch at once. Loops over axes of length 3 or 6, and
LAPACK called for each small matrix of a batch, cost more than all the arithmetic. An entry is an
array (of one shape for all, for example of a batch), or a Python float, which is known while a
program is traced: products with known zeros and ones are left out of the program.
In: arrays (`components`), or entries. Out: entries, or arrays again (`stacked`).
"""

import weakref
from collections.abc import Iterable, Sequence
from typing import Any, SupportsIndex, TypeAlias, overload

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, Float

from mjx_inertia.spatial.arrays import AnyArray

# An array or a float; not written `Array | float`, because only who fills a vector knows which.
Component: TypeAlias = Any

# XLA's CPU compiler repeats cheap operations inside every loop that reads their result, up to
# fifteen times over, and nests such repetitions; `jax.lax.optimization_barrier` is gone before it
# decides. Divisions it never repeats, so this identity is lowered to one, in derivatives as well.
_once = Primitive("computed_once")
_once.def_impl(lambda x: x)
_once.def_abstract_eval(lambda x: x)
ad.deflinear2(_once, lambda cotangent, _: [_once.bind(cotangent)])
batching.defvectorized(_once)
mlir.register_lowering(
    _once,
    # a one that the compiler does not see through
    mlir.lower_fun(
        lambda x: x / jnp.where(jnp.isnan(x), x.dtype.type(2), x.dtype.type(1)),
        multiple_results=False,
    ),
)
# what `computed_once` gave, by its identity while it lives
_marked: weakref.WeakValueDictionary[int, Array] = weakref.WeakValueDictionary()


def computed_once(tree: Any) -> Any:
    """The same arrays, each (and its derivatives) computed in one place wherever it is used.

    Floats stay as they are, and so does what is marked already or is the negative of such an array.

    Args:
      tree: an array, or any pytree of arrays and floats.
    """
    return jax.tree.map(_computed_once, tree)


def _computed_once(x: Component) -> Component:
    return x if isinstance(x, float) or id(x) in _marked else _mark(_once.bind(x))


def _mark(x: Component) -> Component:
    if isinstance(x, jax.core.Tracer):
        _marked[id(x)] = x
    return x


def plus(a: Component, b: Component) -> Component:
    """A sum of entries."""
    if isinstance(a, float) and a == 0.0:
        return b
    return a if isinstance(b, float) and b == 0.0 else a + b


def minus(a: Component, b: Component) -> Component:
    """A difference of entries."""
    if isinstance(a, float) and a == 0.0:
        return _negative(b)
    return a if isinstance(b, float) and b == 0.0 else a - b


def times(a: Component, b: Component) -> Component:
    """A product of entries; nothing at all where a factor is known to be zero."""
    if isinstance(b, float):
        a, b = b, a
    if isinstance(a, float):
        if a == 0.0:
            return 0.0
        if abs(a) == 1.0:
            return b if a == 1.0 else _negative(b)
    return a * b


def _negative(x: Component) -> Component:
    return _mark(-x) if id(x) in _marked else -x


def safe_sqrt(square: Component) -> Component:
    """Square root, with a derivative of zero where it vanishes."""
    if isinstance(square, float):
        return square**0.5
    zero = square == 0.0
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, square)))


class Vector(tuple[Component, ...]):
    """n entries.

    `+`, `-` and `*` work entry by entry, `*` also with one factor for all; `@` is the dot product.
    """

    __slots__ = ()
    __array_ufunc__ = None  # a NumPy number leaves `number * vector` to the vector

    @overload
    def __getitem__(self, index: SupportsIndex) -> Component: ...
    @overload
    def __getitem__(self, index: slice) -> "Vector": ...
    def __getitem__(self, index: Any) -> Any:
        """An entry; a slice is a vector."""
        part = super().__getitem__(index)
        return Vector(part) if isinstance(index, slice) else part

    def __add__(self, other: Sequence[Component]) -> "Vector":
        return Vector(plus(a, b) for a, b in zip(self, other, strict=True))

    def __sub__(self, other: Sequence[Component]) -> "Vector":
        return Vector(minus(a, b) for a, b in zip(self, other, strict=True))

    def __neg__(self) -> "Vector":
        return Vector(times(-1.0, a) for a in self)

    def __mul__(self, factor: "Component | Vector") -> "Vector":
        if isinstance(factor, Vector):
            return Vector(times(a, b) for a, b in zip(self, factor, strict=True))
        return Vector(times(factor, a) for a in self)

    def __rmul__(self, factor: Component) -> "Vector":
        return self * factor

    def __matmul__(self, other: Sequence[Component]) -> Component:
        total: Component = 0.0
        for a, b in zip(self, other, strict=True):
            total = plus(total, times(a, b))
        return total

    def cross(self, other: Sequence[Component]) -> "Vector":
        """The cross product of two vectors of three entries."""
        (a, b, c), (x, y, z) = self, other
        return Vector(
            (
                minus(times(b, z), times(c, y)),
                minus(times(c, x), times(a, z)),
                minus(times(a, y), times(b, x)),
            )
        )


class Matrix(tuple[Vector, ...]):
    """Rows of entries. `+`, `-` and `*` (with a factor) work entry by entry; `@` is the product."""

    __slots__ = ()
    __array_ufunc__ = None

    def __new__(cls, rows: Iterable[Iterable[Component]]) -> "Matrix":
        return tuple.__new__(cls, (Vector(row) for row in rows))

    @property
    def T(self) -> "Matrix":
        """The transpose."""
        return Matrix(zip(*self, strict=True))

    def __add__(self, other: "Matrix") -> "Matrix":
        return Matrix(a + b for a, b in zip(self, other, strict=True))

    def __sub__(self, other: "Matrix") -> "Matrix":
        return Matrix(a - b for a, b in zip(self, other, strict=True))

    def __mul__(self, factor: Component) -> "Matrix":
        return Matrix(factor * row for row in self)

    def __rmul__(self, factor: Component) -> "Matrix":
        return self * factor

    @overload
    def __matmul__(self, other: "Matrix") -> "Matrix": ...
    @overload
    def __matmul__(self, other: Vector) -> Vector: ...
    def __matmul__(self, other: Any) -> Any:
        if isinstance(other, Matrix):
            columns = other.T
            return Matrix(columns @ row for row in self)
        return Vector(row @ other for row in self)

    def trace(self) -> Component:
        """The sum of the diagonal."""
        total: Component = 0.0
        for i, row in enumerate(self):
            total = plus(total, row[i])
        return total

    def gram(self) -> "SymmetricMatrix":
        """A Aᵀ: the dot products of the rows with each other."""
        return SymmetricMatrix([a @ b for b in self[: i + 1]] for i, a in enumerate(self))


class SymmetricMatrix(Matrix):
    """A matrix whose upper half is the lower one: sums and pytrees have n (n + 1) / 2 entries."""

    __slots__ = ()

    def __new__(cls, rows: Iterable[Sequence[Component]]) -> "SymmetricMatrix":
        """Rows from the first entry to the diagonal at least; what is beyond it is not read."""
        lower = list(rows)
        n = len(lower)
        full = (Vector(lower[max(i, j)][min(i, j)] for j in range(n)) for i in range(n))
        return tuple.__new__(cls, full)

    @staticmethod
    def identity(n: int) -> "SymmetricMatrix":
        """Known ones and zeros."""
        return SymmetricMatrix([0.0] * i + [1.0] for i in range(n))

    @property
    def lower(self) -> tuple[Vector, ...]:
        """The rows up to the diagonal."""
        return tuple(row[: i + 1] for i, row in enumerate(self))

    @overload
    def __add__(self, other: "SymmetricMatrix") -> "SymmetricMatrix": ...
    @overload
    def __add__(self, other: Matrix) -> Matrix: ...
    def __add__(self, other: Any) -> Any:
        if not isinstance(other, SymmetricMatrix):
            return Matrix.__add__(self, other)
        return SymmetricMatrix(a + b for a, b in zip(self.lower, other.lower, strict=True))

    def __mul__(self, factor: Component) -> "SymmetricMatrix":
        return SymmetricMatrix(factor * row for row in self.lower)

    def rotated(self, rotation: Matrix) -> "SymmetricMatrix":
        """R A Rᵀ: a tensor in the axes to which a 3 × 3 rotation turns it."""
        half = computed_once(rotation @ self)
        return SymmetricMatrix(
            [half[j] @ row for j in range(i + 1)] for i, row in enumerate(rotation)
        )


jax.tree_util.register_pytree_node(Vector, lambda v: (tuple(v), None), lambda _, x: Vector(x))
jax.tree_util.register_pytree_node(
    Matrix, lambda m: (tuple(m), None), lambda _, rows: tuple.__new__(Matrix, rows)
)
jax.tree_util.register_pytree_node(
    SymmetricMatrix, lambda m: (m.lower, None), lambda _, rows: SymmetricMatrix(rows)
)

ZERO = Vector((0.0, 0.0, 0.0))
IDENTITY = SymmetricMatrix.identity(3)


def components(array: AnyArray) -> Any:
    """The entries of an array: floats where it is known, arrays where it is traced.

    Returns:
      A component, a `Vector`, a `Matrix` or a tuple of such, by the number of axes.
    """
    if not isinstance(array, jax.core.Tracer):
        array = np.asarray(array, np.float64)
        return _grouped(array.ndim, array.tolist())
    return _grouped(array.ndim, array)


def _grouped(axes: int, nested: Any) -> Any:
    if axes == 0:
        return nested
    kind = {1: Vector, 2: Matrix}.get(axes, tuple)
    return kind(_grouped(axes - 1, part) for part in nested)


def stacked(nested: Sequence[Any], dtype: Any) -> Float[Array, "..."]:
    """One array of nested sequences of entries: the opposite of `components`."""
    shape, leaves = [len(nested)], list(nested)
    while isinstance(leaves[0], tuple | list):
        shape.append(len(leaves[0]))
        leaves = [entry for row in leaves for entry in row]
    return jnp.stack([jnp.asarray(x, dtype) for x in leaves]).reshape(shape)


def axis_rotation(axis: Vector, angle: Component) -> Matrix:
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

    return Matrix(
        (
            (diagonal(x), beside(x, y, times(-1.0, z)), beside(x, z, y)),
            (beside(x, y, z), diagonal(y), beside(y, z, times(-1.0, x))),
            (beside(x, z, times(-1.0, y)), beside(y, z, x), diagonal(z)),
        )
    )


def rotation_axis(rotation: Matrix) -> Vector:
    """Axis of a rotation times the sine of its angle."""
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = rotation
    return 0.5 * Vector((minus(zy, yz), minus(xz, zx), minus(yx, xy)))


def quaternion_rotation(quaternion: Vector) -> Matrix:
    """Rotation matrix of a unit quaternion (wxyz)."""
    w, x, y, z = quaternion
    return Matrix(
        (
            (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
        )
    )
