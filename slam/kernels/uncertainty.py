"""Covariances of poses, carried from one frame to another: asked many times a second, and NumPy takes ten times as long."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit


@njit
def inverted(covariance: NDArray[np.float64], x: float, y: float, yaw: float) -> NDArray[np.float64]:
    """Ad C Ad^T (3, 3) by the adjoint of the pose: the body covariance of its inverse, from that of the pose."""
    return _enclosed(covariance, np.cos(yaw), np.sin(yaw), y, -x)


@njit
def carried(covariance: NDArray[np.float64], x: float, y: float, yaw: float) -> NDArray[np.float64]:
    """Ad C Ad^T (3, 3) by the adjoint of the inverse of a pose `T_b_c`: the covariance of frame b's body, as that of c's."""
    c, s = np.cos(yaw), np.sin(yaw)
    return _enclosed(covariance, c, -s, s * x - c * y, c * x + s * y)


@njit
def turned(covariance: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """The covariance (3, 3) of (x, y, yaw) in axes turned by -`yaw`; of an information matrix as well."""
    return _enclosed(covariance, np.cos(yaw), np.sin(yaw), 0.0, 0.0)


@njit
def propagated(
    covariance: NDArray[np.float64], yaw: float, way: tuple[float, float], variances: tuple[float, float]
) -> NDArray[np.float64]:
    """The covariance (3, 3) of a pose in the map, after a step by `way` in its own axes [m] with variances of the way and of the turn."""
    c, s = np.cos(yaw), np.sin(yaw)
    whole = _enclosed(covariance, 1.0, 0.0, -c * way[1] - s * way[0], c * way[0] - s * way[1])
    whole[0, 0] += variances[0]
    whole[1, 1] += variances[0]
    whole[2, 2] += variances[1]
    return whole


@njit
def _enclosed(A: NDArray[np.float64], c: float, s: float, u: float, v: float) -> NDArray[np.float64]:
    """F A F^T (3, 3) with F = [[c, -s, u], [s, c, v], [0, 0, 1]]."""
    half, whole = np.empty((3, 3)), np.empty((3, 3))
    for j in range(3):
        half[0, j] = c * A[0, j] - s * A[1, j] + u * A[2, j]
        half[1, j] = s * A[0, j] + c * A[1, j] + v * A[2, j]
        half[2, j] = A[2, j]
    for i in range(3):
        whole[i, 0] = half[i, 0] * c - half[i, 1] * s + half[i, 2] * u
        whole[i, 1] = half[i, 0] * s + half[i, 1] * c + half[i, 2] * v
        whole[i, 2] = half[i, 2]
    return whole
