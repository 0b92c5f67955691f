"""Cholesky's factor of a small matrix, for many right-hand sides, written out in components.

In: a symmetric positive definite matrix; what is known to be zero stays out of the sums. Out: its
factor, and solutions with it. Where the matrix is not positive definite they are not finite.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import jax

from mjx_inertia.spatial.unrolled import (
    Component,
    Matrix,
    SymmetricMatrix,
    Vector,
    computed_once,
    minus,
    times,
)


@dataclass(frozen=True)
class Cholesky:
    """The factor L of a symmetric positive definite matrix A = L Lᵀ, for many right-hand sides."""

    lower: tuple[Vector, ...]  # rows of L below its diagonal
    inverse_diagonal: Vector  # inverses of the entries on it
    marked: bool  # every entry of solutions is `computed_once`

    def solve_lower(self, vector: Sequence[Component]) -> Vector:
        """Solution x of L x = `vector`."""
        x: list[Component] = []
        for row, inverse, right in zip(self.lower, self.inverse_diagonal, vector, strict=True):
            rest = right
            for factor, known in zip(row, x, strict=True):
                rest = minus(rest, times(factor, known))
            x.append(self._entry(times(rest, inverse)))
        return Vector(x)

    def solve_upper(self, vector: Sequence[Component]) -> Vector:
        """Solution x of Lᵀ x = `vector`."""
        x = list(vector)
        for i in reversed(range(len(x))):
            for k in range(i + 1, len(x)):
                x[i] = minus(x[i], times(self.lower[k][i], x[k]))
            x[i] = self._entry(times(x[i], self.inverse_diagonal[i]))
        return Vector(x)

    def solve(self, vector: Sequence[Component]) -> Vector:
        """Solution x of A x = `vector`."""
        return self.solve_upper(self.solve_lower(vector))

    def inverse(self) -> SymmetricMatrix:
        """A⁻¹: the sum of the outer products of the rows of L⁻¹."""
        columns = [self.solve_lower(unit) for unit in SymmetricMatrix.identity(len(self.lower))]
        return SymmetricMatrix(
            [self._entry(a[i:] @ b[i:]) for b in columns[: i + 1]] for i, a in enumerate(columns)
        )

    def _entry(self, x: Component) -> Component:
        return computed_once(x) if self.marked else x


def cholesky(matrix: Matrix, *, marked: bool = True) -> Cholesky:
    """The factor of a small matrix, of which the lower half is read.

    Args:
      matrix: symmetric, positive definite.
      marked: mark every entry as `computed_once`. Left alone, XLA's CPU compiler computes those of
        the first columns anew for each of the last; up to about six rows, that costs less than the
        marks.
    """
    lower: list[Vector] = []
    inverse_diagonal: list[Component] = []
    for i, entries in enumerate(matrix):
        done = Cholesky(tuple(lower), Vector(inverse_diagonal), marked)
        row = done.solve_lower(entries[:i])
        pivot = entries[i]
        for entry in row:
            pivot = minus(pivot, times(entry, entry))
        lower.append(row)
        if isinstance(pivot, float):
            inverse: Component = pivot**-0.5 if pivot > 0.0 else math.nan
        else:
            inverse = jax.lax.rsqrt(pivot)
        inverse_diagonal.append(computed_once(inverse) if marked else inverse)
    return Cholesky(tuple(lower), Vector(inverse_diagonal), marked)


# Functions of plain sequences, for arms and space robots.

Factor = Cholesky


def factorize(matrix: Sequence[Sequence[Component]]) -> Cholesky:
    return cholesky(SymmetricMatrix(matrix))


def solve_lower(factor: Cholesky, vector: Sequence[Component]) -> list[Component]:
    return list(factor.solve_lower(vector))


def solve_upper(factor: Cholesky, vector: Sequence[Component]) -> list[Component]:
    return list(factor.solve_upper(vector))


def inner(a: Sequence[Component], b: Sequence[Component]) -> Component:
    n = min(len(a), len(b))
    return Vector(a[:n]) @ b[:n]
