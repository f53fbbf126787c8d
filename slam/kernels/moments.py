"""Weighted means and covariances of poses, in one pass each and without threads: those of BLAS cost more than they save."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit


@njit
def moments(
    poses: NDArray[np.float64], weights: NDArray[np.float64], labels: NDArray[np.int64], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Weight (K,), mean (K, 3) and covariance (K, 3, 3) of poses (N, 3) by their label; nan of what has no weight.

    Headings are averaged as turns from that of the first pose of their label: each label has to hang together.

    Args:
        poses: x, y [m], yaw [rad].
        weights: (N,)
        labels: (N,) 0 to `count` - 1.
        count: K
    """
    shares, means, covariances = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3, 3))
    first = np.full(count, -1, np.int64)
    for n in range(len(poses)):
        k, w = labels[n], weights[n]
        if first[k] < 0:
            first[k] = n
        start = first[k]
        dx, dy, turn = poses[n, 0] - poses[start, 0], poses[n, 1] - poses[start, 1], _turn(poses[n, 2] - poses[start, 2])
        shares[k] += w
        means[k, 0] += w * dx
        means[k, 1] += w * dy
        means[k, 2] += w * turn
        covariances[k, 0, 0] += w * dx * dx
        covariances[k, 0, 1] += w * dx * dy
        covariances[k, 0, 2] += w * dx * turn
        covariances[k, 1, 1] += w * dy * dy
        covariances[k, 1, 2] += w * dy * turn
        covariances[k, 2, 2] += w * turn * turn
    for k in range(count):
        off = means[k] / shares[k]
        for i in range(3):
            means[k, i] = poses[max(first[k], 0), i] + off[i]
            for j in range(i, 3):
                covariances[k, i, j] = covariances[k, i, j] / shares[k] - off[i] * off[j]
                covariances[k, j, i] = covariances[k, i, j]
    return shares, means, covariances


@njit
def _turn(angle: float) -> float:
    """In -pi..pi [rad]."""
    if -np.pi <= angle <= np.pi:
        return angle
    return angle - 2.0 * np.pi * np.floor((angle + np.pi) / (2.0 * np.pi))
