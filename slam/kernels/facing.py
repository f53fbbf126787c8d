"""From where the walls of a finished map can be seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

REACH = 3
"""Cells to each side that are looked at."""
SURE = 0.2
"""A mean shorter than this tells no side: the wall is free on both."""


@njit
def facing_of(occupied: NDArray[np.bool_], free: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Mean unit vector (H, W, 2) from every occupied cell to the free cells around it; 0 where no side prevails."""
    height, width = occupied.shape
    facing = np.zeros((height, width, 2), np.float32)
    for row in range(height):
        for col in range(width):
            if not occupied[row, col]:
                continue
            x, y, n = 0.0, 0.0, 0
            for r in range(max(row - REACH, 0), min(row + REACH + 1, height)):
                for c in range(max(col - REACH, 0), min(col + REACH + 1, width)):
                    if free[r, c]:
                        distance = np.hypot(r - row, c - col)
                        x, y, n = x + (c - col) / distance, y + (r - row) / distance, n + 1
            if n > 0 and np.hypot(x, y) > SURE * n:
                facing[row, col, 0], facing[row, col, 1] = x / n, y / n
    return facing
