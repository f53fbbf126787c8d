"""Exhaustive correlative search over a window of poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit


@njit
def search(
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    field: tuple[NDArray[np.int32], float],
    window: tuple[int, int, float],
    scores: tuple[NDArray[np.float32], NDArray[np.float64]],
) -> tuple[NDArray[np.float64], float]:
    """Best pose on a lattice about `pose`: mean score of the points, less a penalty for leaving the centre.

    After Olson, "Real-time correlative scan matching" (2009): points are rotated once per heading and then only shifted.

    Args:
        points: (M, 2) [m] in base.
        pose: (3,) centre x, y, yaw in the grid's frame.
        field: squared distance to the nearest occupied cell (H, W) [cells], cell size [m].
        window: cells to each side, headings to each side, heading step [rad].
        scores: score of a squared distance in cells (D,), penalty of a squared step in cells and in headings (2,).

    Returns:
        pose (3,) and its mean score without the penalty.
    """
    squares, resolution = field
    height, width = squares.shape
    reach, turns, step = window
    table, penalty = scores
    n = len(points)
    rows, cols = np.empty(n, np.int64), np.empty(n, np.int64)
    best, best_score = -1e9, 0.0
    best_pose = pose.copy()
    for turn in range(-turns, turns + 1):
        yaw = pose[2] + turn * step
        c, s = np.cos(yaw), np.sin(yaw)
        for i in range(n):
            cols[i] = int(np.floor((pose[0] + c * points[i, 0] - s * points[i, 1]) / resolution))
            rows[i] = int(np.floor((pose[1] + s * points[i, 0] + c * points[i, 1]) / resolution))
        for dr in range(-reach, reach + 1):
            for dc in range(-reach, reach + 1):
                total = 0.0
                for i in range(n):
                    row, col = rows[i] + dr, cols[i] + dc
                    if 0 <= row < height and 0 <= col < width:
                        total += table[squares[row, col]]
                score = total / n
                rated = score - penalty[0] * (dr * dr + dc * dc) - penalty[1] * turn * turn
                if rated > best:
                    best, best_score = rated, float(score)
                    best_pose[0] = pose[0] + dc * resolution
                    best_pose[1] = pose[1] + dr * resolution
                    best_pose[2] = yaw
    return best_pose, best_score
