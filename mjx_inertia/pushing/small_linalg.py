"""Linear algebra of a handful of unknowns, written out so that a batch of it vectorises.

Vectors are lists of arrays, matrices lists of rows. On a CPU, LAPACK called once for each 6 x 6
matrix of a batch, and loops over axes of length 6, cost more than all the arithmetic of a
simulation step; written out, each operation runs over the whole batch at once.
"""

from collections.abc import Sequence

import jax
from jaxtyping import Array

Vector = Sequence[Array]
Matrix = Sequence[Sequence[Array]]


def inner_product(a: Vector, b: Vector) -> Array:
    """Inner product."""
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:], strict=True):
        total = total + x * y
    return total


def matvec(matrix: Matrix, vector: Vector) -> list[Array]:
    """Product of a matrix and a vector."""
    return [inner_product(row, vector) for row in matrix]


def cholesky_solve(matrix: Matrix, vector: Vector) -> list[Array]:
    """Solves A x = b for a symmetric positive definite A; reads its lower half only."""
    n = len(vector)
    lower: list[list[Array]] = [[] for _ in range(n)]  # strictly lower triangle
    inverse_diagonal: list[Array] = []
    y: list[Array] = []
    for i in range(n):
        for j in range(i):
            rest = matrix[i][j]
            for k in range(j):
                rest = rest - lower[i][k] * lower[j][k]
            lower[i].append(rest * inverse_diagonal[j])
        pivot, right = matrix[i][i], vector[i]
        for k in range(i):
            pivot = pivot - lower[i][k] * lower[i][k]
            right = right - lower[i][k] * y[k]
        inverse_diagonal.append(jax.lax.rsqrt(pivot))
        y.append(right * inverse_diagonal[i])
    x: list[Array] = [y[0]] * n
    for i in reversed(range(n)):
        right = y[i]
        for k in range(i + 1, n):
            right = right - lower[k][i] * x[k]
        x[i] = right * inverse_diagonal[i]
    return x
