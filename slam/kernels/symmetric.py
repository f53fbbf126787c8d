"""Small symmetric matrices, most 3 x 3 and written out: they are asked thousands of times a second, and LAPACK takes ten times as long."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]


@njit
def inverse(A: Floats) -> Floats:
    """Inverse of a symmetric positive definite 3 x 3 matrix by its adjugate; nan where it is singular."""
    B = np.empty((3, 3))
    B[0, 0] = A[1, 1] * A[2, 2] - A[1, 2] * A[1, 2]
    B[0, 1] = A[0, 2] * A[1, 2] - A[0, 1] * A[2, 2]
    B[0, 2] = A[0, 1] * A[1, 2] - A[0, 2] * A[1, 1]
    B[1, 1] = A[0, 0] * A[2, 2] - A[0, 2] * A[0, 2]
    B[1, 2] = A[0, 1] * A[0, 2] - A[0, 0] * A[1, 2]
    B[2, 2] = A[0, 0] * A[1, 1] - A[0, 1] * A[0, 1]
    B[1, 0], B[2, 0], B[2, 1] = B[0, 1], B[0, 2], B[1, 2]
    det = A[0, 0] * B[0, 0] + A[0, 1] * B[0, 1] + A[0, 2] * B[0, 2]
    return B / det if det > 0.0 else np.full((3, 3), np.nan)


@njit
def with_floor(A: Floats) -> Floats:
    """A plus so little that it can be inverted."""
    return A + (1e-9 * (A[0, 0] + A[1, 1] + A[2, 2]) + 1e-12) * np.eye(3)


@njit
def times(A: Floats, v: Floats) -> Floats:
    """A v of a matrix (3, 3) and a vector (3,)."""
    u = np.empty(3)
    for i in range(3):
        u[i] = A[i, 0] * v[0] + A[i, 1] * v[1] + A[i, 2] * v[2]
    return u


@njit
def add_square(B: Floats, x: float, y: float, z: float) -> None:
    """B += (x, y, z)^T (x, y, z)."""
    B[0, 0] += x * x
    B[0, 1] += x * y
    B[0, 2] += x * z
    B[1, 1] += y * y
    B[1, 2] += y * z
    B[2, 2] += z * z
    B[1, 0], B[2, 0], B[2, 1] = B[0, 1], B[0, 2], B[1, 2]


@njit
def enclosed(A: Floats, B: Floats) -> Floats:
    """A B A of symmetric matrices (3, 3)."""
    C = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                C[i, j] += A[i, k] * B[k, j]
    D = np.zeros((3, 3))
    for i in range(3):
        for j in range(i, 3):
            for k in range(3):
                D[i, j] += C[i, k] * A[k, j]
            D[j, i] = D[i, j]
    return D


@njit
def is_positive(S: Floats) -> bool:
    """Whether a symmetric matrix (3, 3) has positive eigenvalues only, by Sylvester's criterion: much sooner known than they are."""
    minor = S[0, 0] * S[1, 1] - S[0, 1] * S[0, 1]
    rest = S[2, 2] * minor - S[0, 0] * S[1, 2] * S[1, 2] - S[1, 1] * S[0, 2] * S[0, 2] + 2.0 * S[0, 1] * S[1, 2] * S[0, 2]
    return S[0, 0] > 0.0 and minor > 0.0 and rest > 0.0


@njit
def solve(A: Floats, b: Floats) -> None:
    """Write x of A x = b into b, for a symmetric positive definite matrix (n, n) of which the lower part is given; nan where it is not.

    The lower part becomes Cholesky's factor.
    """
    n = len(A)
    for j in range(n):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = np.sqrt(A[j, j]) if A[j, j] > 0.0 else np.nan
        for i in range(j + 1, n):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= A[i, k] * b[k]
        b[i] /= A[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= A[k, i] * b[k]
        b[i] /= A[i, i]
