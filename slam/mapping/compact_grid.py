"""An occupancy grid at a byte a cell, for submaps that nobody is matched to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.kernels import composition
from slam.se2 import SE2, FloatArray

STEP = LOG_ODDS_LIMIT / 125.0
"""Log-odds of one step."""
FREE_BESIDE = -1.5
"""Least log-odds of free space beside an occupied cell, when submaps are laid over one another."""


@dataclass(frozen=True, slots=True, eq=False)
class CompactGrid:
    """Log-odds in steps, and mean hits of the cells that have any; cropped to what is known."""

    geometry: GridGeometry
    steps: NDArray[np.int8]
    """(height, width) log-odds in `STEP`s, 0 unknown."""
    cells: NDArray[np.int32]
    """(K,) flat cells with hits."""
    counts: NDArray[np.float32]
    """(K,) hits behind each mean."""
    offsets: NDArray[np.float32]
    """(K, 2) mean hit minus cell centre [m]."""
    facings: NDArray[np.int8]
    """(K, 2) mean unit vector towards where the hits were seen from, 127 for 1: without it both faces of a thin wall melt into one."""

    @classmethod
    def of(cls, grid: OccupancyGrid, facing: NDArray[np.float32]) -> CompactGrid:
        """Pack a grid, and the `facing` (H, W, 2) of its surface field."""
        window, geometry = _known(grid)
        steps = np.rint(grid.log_odds[window] / STEP).astype(np.int8)
        cells = np.flatnonzero((steps > 0) & (grid.hit_count[window] > 0.0))
        counts = grid.hit_count[window].reshape(-1)[cells]
        offsets = grid.hit_offset[window].reshape(-1, 2)[cells]
        facings = np.rint(127.0 * facing[window].reshape(-1, 2)[cells]).astype(np.int8)
        return cls(geometry, steps, cells.astype(np.int32), counts, offsets, facings)

    def unpacked(self) -> tuple[OccupancyGrid, NDArray[np.float32]]:
        """The grid, with two metres of room around, and its facing (H, W, 2)."""
        margin = round(2.0 / self.geometry.resolution)
        g = self.geometry
        corner = SE2(g.T_map_grid.x - margin * g.resolution, g.T_map_grid.y - margin * g.resolution)
        grid = OccupancyGrid.empty(GridGeometry(g.resolution, g.width + 2 * margin, g.height + 2 * margin, corner))
        grid.log_odds[margin : margin + g.height, margin : margin + g.width] = self.steps * STEP
        rows, cols = self.cells // g.width + margin, self.cells % g.width + margin
        grid.hit_count[rows, cols] = self.counts
        grid.hit_offset[rows, cols] = self.offsets
        facing = np.zeros((*grid.log_odds.shape, 2), np.float32)
        facing[rows, cols] = self.facings / np.float32(127.0)
        return grid, facing

    def hits(self) -> FloatArray:
        """Mean hits (K, 2) in the submap's frame [m]."""
        rows, cols = self.cells // self.geometry.width, self.cells % self.geometry.width
        corner = np.array([self.geometry.T_map_grid.x, self.geometry.T_map_grid.y])
        hits: FloatArray = corner + (np.stack([cols, rows], axis=1) + 0.5) * self.geometry.resolution + self.offsets.astype(np.float64)
        return hits

    def free_steps(self) -> NDArray[np.int8]:
        """(height, width) the steps with free space beside walls raised to `FREE_BESIDE`.

        Two maps of one wall disagree by a cell where it lies on their border: the free space of one is not to erase the wall of the other.
        """
        steps = self.steps.copy()
        composition.raise_beside(steps, self.cells, round(FREE_BESIDE / STEP))
        return steps

    def log_odds_of_hits(self) -> FloatArray:
        """(K,) log-odds of the cells that have hits."""
        return self.steps.reshape(-1)[self.cells].astype(np.float64) * STEP


def _known(grid: OccupancyGrid) -> tuple[tuple[slice, slice], GridGeometry]:
    """The window of cells that are not unknown, at least one cell."""
    known = grid.log_odds != 0.0
    rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    top, bottom = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 1)
    left, right = (int(cols[0]), int(cols[-1]) + 1) if len(cols) else (0, 1)
    g = grid.geometry
    corner = SE2(g.T_map_grid.x + left * g.resolution, g.T_map_grid.y + top * g.resolution)
    return (slice(top, bottom), slice(left, right)), GridGeometry(g.resolution, right - left, bottom - top, corner)
