"""Sparse Cholesky factor of a symmetric matrix of 3 x 3 blocks: T. Davis, "Direct Methods for Sparse Linear Systems" (2006), chapter 4."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Factor = tuple[Indices, Indices, Floats, Indices]
"""Column starts (N + 1), rows (M) and blocks (M, 3, 3) of L, of each column the inverse of the diagonal block first; the tree (N,)."""


@njit
def elimination(starts: Indices, rows: Indices) -> tuple[Indices, Indices]:
    """Parent in the elimination tree (N,), -1 at a root, and where each column of L starts (N + 1,).

    Args:
        starts: (N + 1,) of the columns of the upper triangle, diagonal included.
        rows: (M,) of its blocks, rising in each column.
    """
    n = len(starts) - 1
    parent, ancestor = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    mark, counts = np.full(n, -1, np.int64), np.ones(n, np.int64)
    for k in range(n):
        mark[k] = k
        for p in range(starts[k], starts[k + 1]):
            i = rows[p]
            while i != -1 and i < k:
                above = ancestor[i]
                ancestor[i] = k
                if above == -1:
                    parent[i] = k
                i = above
        for p in range(starts[k], starts[k + 1]):
            i = rows[p]
            while mark[i] != k:
                mark[i] = k
                counts[i] += 1
                i = parent[i]
    columns = np.zeros(n + 1, np.int64)
    columns[1:] = np.cumsum(counts)
    return parent, columns


@njit
def factorise(starts: Indices, rows: Indices, blocks: Floats, tree: tuple[Indices, Indices]) -> tuple[Factor, bool]:
    """Factor L of A = L L^T, row by row, and whether A is positive definite (Davis 2006, section 4.7, on blocks).

    Args:
        starts: as for `elimination`.
        rows: as for `elimination`.
        blocks: (M, 3, 3) of the upper triangle; block (i, k) stands at row i of column k.
        tree: the answer of `elimination`.
    """
    parent, columns = tree
    n = len(parent)
    filled = columns[:-1] + 1
    Li, L = np.empty(columns[n], np.int64), np.empty((columns[n], 3, 3))
    work, mark, stack = np.zeros((n, 3, 3)), np.full(n, -1, np.int64), np.empty(n, np.int64)
    Y, D = np.empty((3, 3)), np.empty((3, 3))
    for k in range(n):
        mark[k] = k
        top = n
        for p in range(starts[k], starts[k + 1]):
            i = rows[p]
            for a in range(3):
                for b in range(3):
                    work[i, a, b] = blocks[p, b, a]
            length = 0
            while mark[i] != k:
                stack[length] = i
                length += 1
                mark[i] = k
                i = parent[i]
            while length > 0:
                top -= 1
                length -= 1
                stack[top] = stack[length]
        D[:] = work[k]
        work[k] = 0.0
        for s in range(top, n):
            i = stack[s]
            _times_transposed(work[i], L[columns[i]], Y)
            work[i] = 0.0
            for p in range(columns[i] + 1, filled[i]):
                _subtract(work[Li[p]], Y, L[p])
            _subtract(D, Y, Y)
            L[filled[i]] = Y
            Li[filled[i]] = k
            filled[i] += 1
        Li[columns[k]] = k
        if not _invert_root(D, L[columns[k]]):
            return (columns, Li, L, parent), False
    return (columns, Li, L, parent), True


@njit
def solve(factor: Factor, b: Floats) -> Floats:
    """Return x (N, 3) of L L^T x = b (N, 3)."""
    columns, Li, L, _ = factor
    x = b.copy()
    n = len(columns) - 1
    for k in range(n):
        d = L[columns[k]]
        x0, x1, x2 = x[k, 0], x[k, 1], x[k, 2]
        x0, x1, x2 = d[0, 0] * x0, d[1, 0] * x0 + d[1, 1] * x1, d[2, 0] * x0 + d[2, 1] * x1 + d[2, 2] * x2
        x[k, 0], x[k, 1], x[k, 2] = x0, x1, x2
        for p in range(columns[k] + 1, columns[k + 1]):
            for a in range(3):
                x[Li[p], a] -= L[p, a, 0] * x0 + L[p, a, 1] * x1 + L[p, a, 2] * x2
    for k in range(n - 1, -1, -1):
        x0, x1, x2 = x[k, 0], x[k, 1], x[k, 2]
        for p in range(columns[k] + 1, columns[k + 1]):
            r = Li[p]
            x0 -= L[p, 0, 0] * x[r, 0] + L[p, 1, 0] * x[r, 1] + L[p, 2, 0] * x[r, 2]
            x1 -= L[p, 0, 1] * x[r, 0] + L[p, 1, 1] * x[r, 1] + L[p, 2, 1] * x[r, 2]
            x2 -= L[p, 0, 2] * x[r, 0] + L[p, 1, 2] * x[r, 1] + L[p, 2, 2] * x[r, 2]
        d = L[columns[k]]
        x[k, 0] = d[0, 0] * x0 + d[1, 0] * x1 + d[2, 0] * x2
        x[k, 1] = d[1, 1] * x1 + d[2, 1] * x2
        x[k, 2] = d[2, 2] * x2
    return x


@njit
def projected(factor: Factor, places: tuple[int, int], J: tuple[Floats, Floats], work: Floats, out: Floats) -> None:
    """Write J A^-1 J^T (3, 3) of a J with two blocks (3, 3) in the columns `places`; visits only what lies above them in the tree.

    `work` (N, 3, 3) must be zero, and is again afterwards.
    """
    columns, Li, L, parent = factor
    i, j = places
    Ji, Jj = J
    out[:] = 0.0
    for a in range(3):
        for b in range(3):
            work[i, b, a] += Ji[a, b]
            work[j, b, a] += Jj[a, b]
    y = np.empty((3, 3))
    while i != -1 or j != -1:
        k = j if i == -1 or (j != -1 and j < i) else i
        if i == k:
            i = parent[k]
        if j == k:
            j = parent[k]
        d = L[columns[k]]
        for a in range(3):
            for c in range(3):
                y[a, c] = d[a, 0] * work[k, 0, c] + d[a, 1] * work[k, 1, c] + d[a, 2] * work[k, 2, c]
        work[k] = 0.0
        for a in range(3):
            for c in range(3):
                out[a, c] += y[0, a] * y[0, c] + y[1, a] * y[1, c] + y[2, a] * y[2, c]
        for p in range(columns[k] + 1, columns[k + 1]):
            r = Li[p]
            for a in range(3):
                for c in range(3):
                    work[r, a, c] -= L[p, a, 0] * y[0, c] + L[p, a, 1] * y[1, c] + L[p, a, 2] * y[2, c]


@njit
def _times_transposed(A: Floats, B: Floats, out: Floats) -> None:
    """Write A B^T."""
    for a in range(3):
        for b in range(3):
            out[a, b] = A[a, 0] * B[b, 0] + A[a, 1] * B[b, 1] + A[a, 2] * B[b, 2]


@njit
def _subtract(target: Floats, A: Floats, B: Floats) -> None:
    """Subtract A B^T."""
    for a in range(3):
        for b in range(3):
            target[a, b] -= A[a, 0] * B[b, 0] + A[a, 1] * B[b, 1] + A[a, 2] * B[b, 2]


@njit
def _invert_root(D: Floats, out: Floats) -> bool:
    """Write the inverse of the lower Cholesky factor of D (3, 3); False when D is not positive definite."""
    if not D[0, 0] > 0.0:
        return False
    l00 = np.sqrt(D[0, 0])
    l10, l20 = D[1, 0] / l00, D[2, 0] / l00
    d11 = D[1, 1] - l10 * l10
    if not d11 > 0.0:
        return False
    l11 = np.sqrt(d11)
    l21 = (D[2, 1] - l20 * l10) / l11
    d22 = D[2, 2] - l20 * l20 - l21 * l21
    if not d22 > 0.0:
        return False
    l22 = np.sqrt(d22)
    out[:] = 0.0
    out[0, 0], out[1, 1], out[2, 2] = 1.0 / l00, 1.0 / l11, 1.0 / l22
    out[1, 0] = -l10 / (l00 * l11)
    out[2, 1] = -l21 / (l11 * l22)
    out[2, 0] = (l10 * l21 - l20 * l11) / (l00 * l11 * l22)
    return True
