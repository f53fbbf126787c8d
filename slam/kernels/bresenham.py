"""Bresenham rays into a log-odds grid: Bresenham, "Algorithm for computer control of a digital plotter" (1965)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit


@njit
def insert(
    origin: tuple[int, int],
    ends: NDArray[np.int64],
    offsets: NDArray[np.float64],
    cells: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    update: tuple[float, float, float],
) -> None:
    """Lower the log-odds of the cells on the way to every hit, raise those of the hit cells; each beam counts.

    Args:
        origin: cell (row, col) of the laser; it may lie outside.
        ends: (M, 2) cells (row, col) that are hit; those outside change only what lies before them.
        offsets: (M, 2) hit minus cell centre, along the grid's x and y [m].
        cells: log-odds (H, W), hit count (H, W), mean hit minus cell centre (H, W, 2) [m]; written.
        update: log-odds of a hit, of a miss (negative), and their limit.
    """
    log_odds, count, mean = cells
    height, width = log_odds.shape
    for i in range(len(ends)):
        row, col = origin
        d_row, d_col = abs(ends[i, 0] - row), abs(ends[i, 1] - col)
        step_row, step_col = (1 if ends[i, 0] > row else -1), (1 if ends[i, 1] > col else -1)
        error = d_col - d_row
        while row != ends[i, 0] or col != ends[i, 1]:
            if 0 <= row < height and 0 <= col < width:
                log_odds[row, col] = max(log_odds[row, col] + update[1], -update[2])
            doubled = 2 * error
            if doubled > -d_row:
                error -= d_row
                col += step_col
            if doubled < d_col:
                error += d_col
                row += step_row
        if 0 <= row < height and 0 <= col < width:
            log_odds[row, col] = min(log_odds[row, col] + update[0], update[2])
            count[row, col] += 1.0
            mean[row, col, 0] += (offsets[i, 0] - mean[row, col, 0]) / count[row, col]
            mean[row, col, 1] += (offsets[i, 1] - mean[row, col, 1]) / count[row, col]
