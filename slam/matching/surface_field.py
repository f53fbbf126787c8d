"""The distance field that scans are matched against.

Every cell knows the nearest occupied cell, and every occupied cell the line through the mean hits around it. The
distance of a point is measured to that line, not interpolated between cell centres, so it is signed, exact below the
cell size and free of the half-cell bias that a distance transform of cell centres has.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from slam.grid import OccupancyGrid
from slam.kernels import surfaces as kernels
from slam.se2 import SE2

NEIGHBOURHOODS = (0.10, 0.20, 0.40, 0.60)
"""How far to each side hits are pooled into a line: the first that holds three occupied cells [m]."""


_nearest_first = lru_cache(kernels.nearest_first)


class SurfaceField:
    """Nearest surfaces of one occupancy grid, kept up to date cell by cell."""

    def __init__(self, grid: OccupancyGrid, reach: float = 0.6, facing: NDArray[np.float32] | None = None) -> None:
        """Build the field of a grid; cells farther than `reach` [m] from any surface have none.

        Args:
            grid: the map.
            reach: [m]
            facing: (H, W, 2) as the attribute, where it is known.
        """
        self.radius = max(1, round(reach / grid.geometry.resolution))
        self._around = _nearest_first(self.radius)
        self.resolution = grid.geometry.resolution
        self._reaches: NDArray[np.int64] = np.ceil(np.array(NEIGHBOURHOODS) / self.resolution - 1e-9).astype(np.int64)
        self.T_map_grid = grid.geometry.T_map_grid
        self.T_grid_map = self.T_map_grid.inverse()
        shape = grid.log_odds.shape
        self._occupied: NDArray[np.bool_] = np.zeros(shape, np.bool_)
        self.nearest: NDArray[np.int32] = np.full(shape, -1, np.int32)
        """(H, W) flat index of the nearest occupied cell, -1 for none."""
        self.squares: NDArray[np.int32] = np.full(shape, self.radius**2 + 1, np.int32)
        """(H, W) squared distance to it in cells, radius^2 + 1 for none."""
        self.surfaces: NDArray[np.float32] = np.zeros((*shape, 5), np.float32)
        """(H, W, 5): point on the surface and normal in the grid's frame, flatness."""
        self.facing: NDArray[np.float32] = np.zeros((*shape, 2), np.float32) if facing is None else facing
        """(H, W, 2) mean unit vector from the hits of a cell towards where they were seen from; 0 where that is not known."""
        self.update(grid, np.flatnonzero(grid.likely()))

    @property
    def arrays(self) -> tuple[NDArray[np.int32], NDArray[np.float32], float]:
        """Nearest occupied cells, surfaces and cell size, as kernels take them."""
        return self.nearest, self.surfaces, self.resolution

    def update(self, grid: OccupancyGrid, changed: NDArray[np.int64]) -> None:
        """Follow the grid in the flat cells that changed."""
        now = grid.likely_at(changed)
        before = self._occupied.reshape(-1)[changed]
        self._occupied.reshape(-1)[changed] = now
        gone, new = changed[before & ~now], changed[now & ~before]
        kernels.detach(self.nearest, self.squares, self._occupied, gone, self._around)
        kernels.attach(self.nearest, self.squares, new, self.radius)
        refit = self.with_neighbours(np.concatenate([changed[now], gone]))
        hits = (grid.hit_count, grid.hit_offset, self.facing)
        kernels.fit(self.surfaces, self._occupied, hits, refit, (self.resolution, self._reaches))

    def grow(self, grid: OccupancyGrid, shift: tuple[int, int]) -> None:
        """Move into a larger grid whose cell (row, col) + `shift` is the old cell (row, col)."""
        shape = grid.log_odds.shape
        window = tuple(slice(start, start + size) for start, size in zip(shift, self.nearest.shape, strict=True))
        old_occupied, old_nearest, old_squares, old_facing = self._occupied, self.nearest, self.squares, self.facing
        surfaces = np.zeros((*shape, 5), np.float32)
        surfaces[window] = self.surfaces
        self._occupied = np.zeros(shape, np.bool_)
        self.nearest = np.full(shape, -1, np.int32)
        self.squares = np.full(shape, self.radius**2 + 1, np.int32)
        self.facing = np.zeros((*shape, 2), np.float32)
        self._occupied[window], self.squares[window], self.facing[window] = old_occupied, old_squares, old_facing
        kernels.move(old_nearest, self.nearest, shift)
        cells = np.flatnonzero(self._occupied)
        surfaces.reshape(-1, 5)[cells, :2] += np.array([shift[1], shift[0]], np.float32) * self.resolution
        self.surfaces = surfaces
        # walls near the old border are the nearest ones of cells beyond it
        kernels.attach(self.nearest, self.squares, cells[self._near_border(cells, window)], self.radius)
        self.T_map_grid = grid.geometry.T_map_grid
        self.T_grid_map = self.T_map_grid.inverse()

    def _near_border(self, cells: NDArray[np.int64], window: tuple[slice, ...]) -> NDArray[np.bool_]:
        """Which of the flat cells (K,) within a window of rows and columns are within the radius of what is beyond it."""
        near = np.zeros(len(cells), np.bool_)
        for at, part in zip(np.divmod(cells, self.nearest.shape[1]), window, strict=True):
            near |= (at < part.start + self.radius) | (at >= part.stop - self.radius)
        return near

    def pose_in_grid(self, T_map_base: SE2) -> SE2:
        """The pose in the grid's own frame, in which the kernels work."""
        return self.T_grid_map @ T_map_base

    def with_neighbours(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        """The occupied ones among the flat cells and those around them whose surface they take part in."""
        return kernels.occupied_around(self._occupied, cells, int(self._reaches[0]))
