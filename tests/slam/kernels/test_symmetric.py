"""Small symmetric matrices against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from slam.kernels.planar_pose import rotation
from slam.kernels.symmetric import solve


@pytest.mark.parametrize("n", [1, 3, 6])
def test_equations_are_solved_from_their_lower_part(n: int) -> None:
    rng = np.random.default_rng(n)
    J, b = rng.normal(size=(2 * n, n)), rng.normal(size=n)
    A = J.T @ J
    lower, x = np.tril(A), b.copy()
    solve(lower, x)
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-9)
    np.testing.assert_allclose(np.tril(lower), np.linalg.cholesky(A), rtol=1e-9)


def test_what_is_not_positive_has_no_solution() -> None:
    b = np.ones(2)
    solve(np.array([[1.0, 0.0], [2.0, 1.0]]), b)
    assert np.isnan(b).all()


@pytest.mark.parametrize("scale", [0.0, 1e-9, 0.3, 3.0])
def test_a_rotation_vector_turns_about_itself(scale: float) -> None:
    theta = scale * np.array([0.6, -0.3, 0.5])
    R = rotation(theta)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(R @ theta, theta, atol=1e-12)
    assert np.trace(R) == pytest.approx(1.0 + 2.0 * np.cos(np.linalg.norm(theta)))
