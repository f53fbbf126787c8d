"""From where the walls of a finished map can be seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

REACH = 3
"""Cells to each side within which free space is looked for."""
SURE = 0.2
"""A mean shorter than this tells no side: the wall is free on both."""


@njit
def facing_of(occupied: NDArray[np.bool_], free: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Mean unit vector (H, W, 2) from every occupied cell to the nearest free cells; 0 where no side prevails."""
    height, width = occupied.shape
    facing = np.zeros((height, width, 2), np.float32)
    for row in range(height):
        for col in range(width):
            if not occupied[row, col]:
                continue
            for reach in range(1, REACH + 1):
                x, y, n = _towards(free, row, col, reach)
                if n > 0:
                    if np.hypot(x, y) > SURE * n:
                        facing[row, col, 0], facing[row, col, 1] = x / n, y / n
                    break
    return facing


@njit
def _towards(free: NDArray[np.bool_], row: int, col: int, reach: int) -> tuple[float, float, int]:
    """Sum of the unit vectors to the free cells within `reach` rows and columns, and their number."""
    height, width = free.shape
    x, y, n = 0.0, 0.0, 0
    for r in range(max(row - reach, 0), min(row + reach + 1, height)):
        for c in range(max(col - reach, 0), min(col + reach + 1, width)):
            if free[r, c]:
                distance = np.hypot(r - row, c - col)
                x, y, n = x + (c - col) / distance, y + (r - row) / distance, n + 1
    return x, y, n
