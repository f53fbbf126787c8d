"""Ray-traced insertion of a scan into a log-odds grid. Coordinates are in the grid's own frame: the corner of cell (0, 0) is the origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

HIT, MISS = 1, 2


@njit
def insert_hits(
    points: NDArray[np.float64],
    resolution: float,
    cells: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    touched: NDArray[np.uint8],
    update: tuple[float, float, float],
) -> NDArray[np.int64]:
    """Raise the log-odds of every hit cell once and average its hits. Returns the flat indices of the hit cells.

    Args:
        points: (M, 2) [m] in the grid's frame.
        resolution: cell size [m].
        cells: log-odds (H, W), hit count (H, W), mean hit minus cell centre (H, W, 2) [m]; written.
        touched: (H, W) HIT where this scan hit; written, to be cleared by `clear`.
        update: log-odds of a hit, their limit, largest count (older hits fade beyond it).
    """
    log_odds, count, offset = cells
    height, width = log_odds.shape
    hits = np.empty(len(points), np.int64)
    n = 0
    for i in range(len(points)):
        col, row = int(np.floor(points[i, 0] / resolution)), int(np.floor(points[i, 1] / resolution))
        if not (0 <= row < height and 0 <= col < width):
            continue
        count[row, col] = min(count[row, col] + 1.0, update[2])
        gain = 1.0 / count[row, col]
        offset[row, col, 0] += gain * (points[i, 0] - (col + 0.5) * resolution - offset[row, col, 0])
        offset[row, col, 1] += gain * (points[i, 1] - (row + 0.5) * resolution - offset[row, col, 1])
        if touched[row, col] != HIT:
            touched[row, col] = HIT
            log_odds[row, col] = min(log_odds[row, col] + update[0], update[1])
            hits[n] = row * width + col
            n += 1
    return hits[:n].copy()


@njit
def insert_misses(
    origins: NDArray[np.float64],
    points: NDArray[np.float64],
    resolution: float,
    cells: tuple[NDArray[np.float32], NDArray[np.float32]],
    touched: NDArray[np.uint8],
    update: tuple[float, float],
) -> NDArray[np.int64]:
    """Lower the log-odds of every cell that a ray crosses before its hit, once a scan. Returns the flat indices of the crossed cells.

    Cells hit by this scan are spared, so that grazing rays do not erase the wall they run along.
    Traversal: Amanatides, Woo, "A fast voxel traversal algorithm" (1987).

    Args:
        origins: (M, 2) [m] where each ray starts, in the grid's frame.
        points: (M, 2) [m] where it ends.
        resolution: cell size [m].
        cells: log-odds (H, W), hit count (H, W), which starts anew where a cell becomes more free than occupied; written.
        touched: (H, W) HIT, MISS or 0; written, to be cleared by `clear`.
        update: log-odds of a miss (negative) and their limit (positive).
    """
    log_odds, count = cells
    height, width = log_odds.shape
    crossed = np.empty(log_odds.size, np.int64)
    n = 0
    for i in range(len(points)):
        x, y = origins[i, 0] / resolution, origins[i, 1] / resolution
        dx, dy = points[i, 0] / resolution - x, points[i, 1] / resolution - y
        col, row = int(np.floor(x)), int(np.floor(y))
        last_col, last_row = int(np.floor(x + dx)), int(np.floor(y + dy))
        step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        delta_x = abs(1.0 / dx) if dx != 0.0 else np.inf
        delta_y = abs(1.0 / dy) if dy != 0.0 else np.inf
        next_x = ((col + 1 - x) if dx > 0 else (x - col)) * delta_x if dx != 0.0 else np.inf
        next_y = ((row + 1 - y) if dy > 0 else (y - row)) * delta_y if dy != 0.0 else np.inf
        for _ in range(abs(last_col - col) + abs(last_row - row)):
            if 0 <= row < height and 0 <= col < width and touched[row, col] == 0:
                touched[row, col] = MISS
                log_odds[row, col] = max(log_odds[row, col] + update[0], -update[1])
                if log_odds[row, col] < 0.0:
                    count[row, col] = 0.0
                crossed[n] = row * width + col
                n += 1
            if next_x < next_y:
                next_x += delta_x
                col += step_x
            else:
                next_y += delta_y
                row += step_y
    return crossed[:n].copy()


@njit
def clear(touched: NDArray[np.uint8], cells: NDArray[np.int64]) -> None:
    """Reset the marks of the given flat cells."""
    flat = touched.reshape(-1)
    for i in range(len(cells)):
        flat[cells[i]] = 0
