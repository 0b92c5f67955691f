"""Cholesky's factor of a small matrix, for many right-hand sides, written out in components.

In: rows of a symmetric positive definite matrix; what is known to be zero stays out of the sums.
Out: its factor, and solutions with it. Every entry is computed once: left alone, XLA's CPU
compiler computes those of the first columns anew for each of the last. A matrix that is not
positive definite gives values that are not finite.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax

from mjx_inertia.spatial.components import Component, minus, once, plus, times

Row = Sequence[Component]


class Factor(NamedTuple):
    """L with L Lᵀ the matrix."""

    lower: list[list[Component]]  # rows of L below its diagonal
    inverse_diagonal: list[Component]  # inverses of the entries on it


def factorize(matrix: Sequence[Row]) -> Factor:
    """The factor; the lower half of `matrix` is read."""
    lower: list[list[Component]] = []
    inverse_diagonal: list[Component] = []
    for i, entries in enumerate(matrix):
        row: list[Component] = []
        for j in range(i):
            rest = minus(entries[j], inner(row, lower[j]))
            row.append(once(times(rest, inverse_diagonal[j])))
        pivot = minus(entries[i], inner(row, row))
        lower.append(row)
        inverse_diagonal.append(
            pivot**-0.5 if isinstance(pivot, float) else once(jax.lax.rsqrt(pivot))
        )
    return Factor(lower, inverse_diagonal)


def solve_lower(factor: Factor, vector: Row) -> list[Component]:
    """Solution x of L x = `vector`."""
    x: list[Component] = []
    for row, scale, right in zip(*factor, vector, strict=True):
        x.append(once(times(minus(right, inner(row, x)), scale)))
    return x


def solve_upper(factor: Factor, vector: Row) -> list[Component]:
    """Solution x of Lᵀ x = `vector`."""
    n = len(vector)
    x: list[Component] = []  # from the last on
    for i in reversed(range(n)):
        column = [factor.lower[k][i] for k in reversed(range(i + 1, n))]
        x.append(once(times(minus(vector[i], inner(column, x)), factor.inverse_diagonal[i])))
    return x[::-1]


def inverse(factor: Factor) -> list[list[Component]]:
    """The inverse of the whole matrix: Σ of the outer products of the rows of L⁻¹."""
    n = len(factor.inverse_diagonal)
    columns = [solve_lower(factor, [1.0 if i == j else 0.0 for i in range(n)]) for j in range(n)]
    result: list[list[Component]] = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i + 1):
            result[i][j] = result[j][i] = once(inner(columns[i][i:], columns[j][i:]))
    return result


def inner(a: Row, b: Row) -> Component:
    """Inner product over the shorter of the two."""
    total: Component = 0.0
    for x, y in zip(a, b, strict=False):
        total = plus(total, times(x, y))
    return total
