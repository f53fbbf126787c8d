"""Laying one occupancy grid over another that lies turned and shifted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit


@njit
def gather_free(target: NDArray[np.float32], source: NDArray[np.int8], pose: NDArray[np.float64], resolution: float, scale: float) -> None:
    """Add the free space of `source` (h, w) to the log-odds `target` (H, W), each cell by its centre.

    Beside an occupied cell free space counts little: two maps of one wall disagree by a cell where the wall lies on its border,
    and the one's free space is not to erase the other's wall.

    Args:
        target: written; the caller limits it.
        source: log-odds in steps of `scale`, 0 unknown.
        pose: (3,) T_target_source, of the corners of both cells (0, 0).
        resolution: cell size of both [m].
        scale: log-odds of one step.
    """
    rows, cols = source.shape
    height, width = target.shape
    c, s = np.cos(pose[2]), np.sin(pose[2])
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for u in (0.0, cols * resolution):
        for v in (0.0, rows * resolution):
            x, y = pose[0] + c * u - s * v, pose[1] + s * u + c * v
            low_x, high_x = min(low_x, x), max(high_x, x)
            low_y, high_y = min(low_y, y), max(high_y, y)
    for row in range(max(int(low_y / resolution), 0), min(int(high_y / resolution) + 1, height)):
        for col in range(max(int(low_x / resolution), 0), min(int(high_x / resolution) + 1, width)):
            dx, dy = (col + 0.5) * resolution - pose[0], (row + 0.5) * resolution - pose[1]
            j, i = int(np.floor((c * dx + s * dy) / resolution)), int(np.floor((c * dy - s * dx) / resolution))
            if not (0 <= i < rows and 0 <= j < cols) or source[i, j] >= 0:
                continue
            beside = False
            for di in range(-1, 2):
                for dj in range(-1, 2):
                    if 0 <= i + di < rows and 0 <= j + dj < cols and source[i + di, j + dj] > 0:
                        beside = True
            target[row, col] += max(source[i, j] * scale, -1.5) if beside else source[i, j] * scale


@njit
def splat_hits(
    cells: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    points: NDArray[np.float64],
    weights: NDArray[np.float64],
    log_odds: NDArray[np.float64],
    resolution: float,
) -> None:
    """Add mean hits (M, 2) [m], with the hits behind each and its log-odds, both (M,), to a grid's cells.

    Writes log-odds (H, W), hit count (H, W) and mean hit minus cell centre (H, W, 2) [m].
    """
    grid, count, offset = cells
    height, width = grid.shape
    for i in range(len(points)):
        col, row = int(np.floor(points[i, 0] / resolution)), int(np.floor(points[i, 1] / resolution))
        if not (0 <= row < height and 0 <= col < width):
            continue
        grid[row, col] += log_odds[i]
        count[row, col] += weights[i]
        gain = weights[i] / max(count[row, col], 1e-9)
        offset[row, col, 0] += gain * (points[i, 0] - (col + 0.5) * resolution - offset[row, col, 0])
        offset[row, col, 1] += gain * (points[i, 1] - (row + 0.5) * resolution - offset[row, col, 1])
