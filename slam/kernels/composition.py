"""Laying one occupancy grid over another that lies turned and shifted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit


@njit
def gather_free(target: NDArray[np.float32], source: NDArray[np.int8], pose: NDArray[np.float64], resolution: float, scale: float) -> None:
    """Add the free space of `source` (h, w) to the log-odds `target` (H, W), each cell by its centre.

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
    x0, y0 = pose[0] / resolution, pose[1] / resolution
    low, high = np.inf, -np.inf
    for u, v in ((0, 0), (cols, 0), (0, rows), (cols, rows)):
        low, high = min(low, y0 + s * u + c * v), max(high, y0 + s * u + c * v)
    for row in range(max(int(low), 0), min(int(high) + 1, height)):
        dy = row + 0.5 - y0
        u, v = c * (0.5 - x0) + s * dy, c * dy - s * (0.5 - x0)  # of the row's first cell; a column further on they grow by c and -s
        first, end = _inside(u, c, cols, (0.0, float(width)))
        first, end = _inside(v, -s, rows, (first, end))
        for col in range(int(np.ceil(first)), int(np.ceil(end))):
            j, i = int(u + c * col), int(v - s * col)
            if i < rows and j < cols and source[i, j] < 0:
                target[row, col] += source[i, j] * scale


@njit
def _inside(start: float, step: float, size: int, limits: tuple[float, float]) -> tuple[float, float]:
    """The part of the interval `limits` of k in which `start + step k` lies between 0 and `size`."""
    if abs(step) < 1e-12:
        return limits if 0.0 <= start < size else (0.0, 0.0)
    one, other = -start / step, (size - start) / step
    return max(limits[0], min(one, other)), min(limits[1], max(one, other))


@njit
def raise_beside(steps: NDArray[np.int8], cells: NDArray[np.int32], least: int) -> None:
    """Raise the cells around the flat `cells` to at least so many steps; writes `steps` (h, w)."""
    rows, cols = steps.shape
    for k in range(len(cells)):
        row, col = cells[k] // cols, cells[k] % cols
        for i in range(max(row - 1, 0), min(row + 2, rows)):
            for j in range(max(col - 1, 0), min(col + 2, cols)):
                steps[i, j] = max(steps[i, j], least)


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
