"""Rays from cell to cell: Amanatides, Woo, "A fast voxel traversal algorithm" (1987)."""

from __future__ import annotations

import numpy as np

from slam.kernels.jit import inlined


@inlined
def ray_through_cells(x: float, y: float, dx: float, dy: float) -> tuple[int, int, int, int, float, float, float, float, int]:
    """A ray (x, y) + t (dx, dy) through unit cells, t in 0..1.

    Returns first row and column, steps of column and row, t per column and row, t of the next of each, number of cells before the last.
    """
    col, row = int(np.floor(x)), int(np.floor(y))
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    delta_x, delta_y = abs(1.0 / dx) if dx != 0.0 else np.inf, abs(1.0 / dy) if dy != 0.0 else np.inf
    next_x = ((col + 1 - x) if dx > 0 else (x - col)) * delta_x if dx != 0.0 else np.inf
    next_y = ((row + 1 - y) if dy > 0 else (y - row)) * delta_y if dy != 0.0 else np.inf
    count = abs(int(np.floor(x + dx)) - col) + abs(int(np.floor(y + dy)) - row)
    return row, col, step_x, step_y, delta_x, delta_y, next_x, next_y, count
