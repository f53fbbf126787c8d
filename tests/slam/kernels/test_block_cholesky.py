import numpy as np
import pytest

from slam.kernels import block_cholesky
from slam.se2 import FloatArray


def _matrix(seed: int, n: int = 12, density: float = 0.2) -> FloatArray:
    """A sparse positive definite matrix of n x n blocks."""
    rng = np.random.default_rng(seed)
    J = np.zeros((3 * n * n, 3 * n))
    row = 0
    for i in range(n):
        for j in range(i):
            if rng.uniform() < density:
                J[row : row + 3, 3 * i : 3 * i + 3], J[row : row + 3, 3 * j : 3 * j + 3] = rng.normal(size=(2, 3, 3))
                row += 3
    return J.T @ J + 0.1 * np.eye(3 * n)


def _upper(A: FloatArray):
    n = len(A) // 3
    blocks = A.reshape(n, 3, n, 3).transpose(0, 2, 1, 3)
    columns = [[i for i in range(k + 1) if np.any(blocks[i, k])] for k in range(n)]
    starts = np.concatenate([[0], np.cumsum([len(column) for column in columns])]).astype(np.int64)
    rows = np.concatenate(columns).astype(np.int64)
    return starts, rows, np.array([blocks[i, k] for k, column in enumerate(columns) for i in column])


def _factor(A: FloatArray):
    starts, rows, blocks = _upper(A)
    return block_cholesky.factorise(starts, rows, blocks, block_cholesky.elimination(starts, rows))


@pytest.mark.parametrize("seed", range(5))
def test_solves_what_numpy_solves(seed: int) -> None:
    A, b = _matrix(seed), np.random.default_rng(seed).normal(size=(12, 3))
    factor, positive = _factor(A)
    assert positive
    assert np.allclose(block_cholesky.solve(factor, b).ravel(), np.linalg.solve(A, b.ravel()), rtol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_projects_the_inverse_on_any_two_columns(seed: int) -> None:
    A = _matrix(seed)
    factor, _ = _factor(A)
    rng, work, out = np.random.default_rng(seed), np.zeros((12, 3, 3)), np.empty((3, 3))
    for i, j in rng.integers(0, 12, (20, 2)).tolist():
        J = np.zeros((3, 36))
        Ji, Jj = rng.normal(size=(2, 3, 3))
        J[:, 3 * i : 3 * i + 3] += Ji
        J[:, 3 * j : 3 * j + 3] += Jj
        block_cholesky.projected(factor, (i, j), (Ji, Jj), work, out)
        assert np.allclose(out, J @ np.linalg.inv(A) @ J.T, rtol=1e-8)
        assert not np.any(work)


def test_says_when_a_matrix_is_not_positive_definite() -> None:
    A = _matrix(0)
    A[20, 20] = -1.0
    assert not _factor(A)[1]
