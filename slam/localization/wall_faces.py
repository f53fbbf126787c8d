"""Where the walls of a map lie that does not know it better than to a cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from slam.grid import FREE, OccupancyGrid
from slam.kernels.facing import facing_of

DEEP = 3
"""Cells: what is farther from a face than this is a wall of its own, with something unknown before it."""


def faced(grid: OccupancyGrid) -> tuple[OccupancyGrid, NDArray[np.float32]]:
    """A grid for `SurfaceField`, and the sides (H, W, 2) that its walls are seen from.

    A grid that keeps its hits is taken as it is. In a picture a wall begins where the free space ends, half a cell before the middle of
    its first cells, and what lies behind these is no surface.
    """
    free = grid.states() == FREE
    facing = facing_of(grid.likely(), free)
    if grid.hit_offset.any():
        return grid, facing
    square = np.ones((3, 3), np.bool_)
    occupied = grid.likely()
    rim = occupied & np.asarray(ndimage.binary_dilation(free, square))
    hidden = occupied & ~rim & np.asarray(ndimage.binary_dilation(rim, square, iterations=DEEP))
    length = np.hypot(facing[:, :, 0], facing[:, :, 1])[:, :, None]
    normal = facing / np.maximum(length, 1e-6)
    half = 0.5 * grid.geometry.resolution * np.abs(normal).max(axis=2, keepdims=True)  # of a diagonal staircase the mean is nearer
    offset = np.where(rim[:, :, None], half * normal, 0.0).astype(np.float32)
    return OccupancyGrid(grid.geometry, np.where(hidden, np.float32(0.0), grid.log_odds), grid.hit_count, offset), facing
