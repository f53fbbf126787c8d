"""Occupancy grid: geometry, log-odds and the mean of the hits in each cell.

Row 0 is the lowest y in memory, column 0 the lowest x. The centre of cell (row, col) lies at
`T_map_grid @ ((col + 1/2) resolution, (row + 1/2) resolution)`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slam.errors import MapTooLargeError
from slam.se2 import SE2, FloatArray

LOG_ODDS_LIMIT = 5.0
OCCUPIED_THRESHOLD = 0.65
FREE_THRESHOLD = 0.196
OCCUPIED, FREE, UNKNOWN = 100, 0, -1
MOST_CELLS = 50_000_000
"""350 x 350 m in cells of 5 cm; a mapper needs some 100 bytes for each."""


@dataclass(frozen=True, slots=True)
class GridGeometry:
    """Where the cells are.

    Raises:
        MapTooLargeError: more than `MOST_CELLS` of them.
    """

    resolution: float
    """Cell size [m]."""
    width: int
    """Columns, along x."""
    height: int
    """Rows, along y."""
    T_map_grid: SE2 = field(default_factory=SE2)
    """Pose of the lower-left corner of cell (0, 0); map_server's `origin`."""

    def __post_init__(self) -> None:
        if self.width * self.height > MOST_CELLS:
            raise MapTooLargeError(self.width, self.height, self.resolution)

    def to_cells(self, points: FloatArray) -> NDArray[np.int64]:
        """Cells (N, 2) as (row, col) that hold map points (N, 2) [m]; may lie outside the grid."""
        local = self.T_map_grid.inverse().transform(np.asarray(points, dtype=np.float64))
        return np.floor(local[:, ::-1] / self.resolution).astype(np.int64)

    def to_points(self, cells: NDArray[np.int64]) -> FloatArray:
        """Centres (N, 2) [m] in the map of cells (N, 2) given as (row, col)."""
        return self.T_map_grid.transform((np.asarray(cells, dtype=np.float64)[:, ::-1] + 0.5) * self.resolution)

    def contains(self, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which of the cells (N, 2) lie inside, (N,)."""
        rows, cols = cells[:, 0], cells[:, 1]
        return (rows >= 0) & (rows < self.height) & (cols >= 0) & (cols < self.width)


@dataclass(slots=True, eq=False)
class OccupancyGrid:
    """Log-odds of occupancy in +-5, 0 unknown, and the mean hit of each cell: walls are known better than the cell size."""

    geometry: GridGeometry
    log_odds: NDArray[np.float32]
    """(height, width)"""
    hit_count: NDArray[np.float32]
    """(height, width) hits behind each mean."""
    hit_offset: NDArray[np.float32]
    """(height, width, 2) mean hit minus cell centre, along the grid's x and y [m]."""

    @classmethod
    def empty(cls, geometry: GridGeometry) -> OccupancyGrid:
        """A grid that knows nothing."""
        shape = (geometry.height, geometry.width)
        return cls(geometry, np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros((*shape, 2), np.float32))

    @classmethod
    def from_states(cls, geometry: GridGeometry, states: NDArray[np.int8]) -> OccupancyGrid:
        """A grid from cells of 100, 0, -1 (height, width), with hits at the centres of occupied cells."""
        grid = cls.empty(geometry)
        grid.log_odds[states == OCCUPIED] = LOG_ODDS_LIMIT
        grid.log_odds[states == FREE] = -LOG_ODDS_LIMIT
        grid.hit_count[states == OCCUPIED] = 1.0
        return grid

    def occupied(self) -> NDArray[np.bool_]:
        """Cells at or above map_server's occupied threshold, (height, width)."""
        return self.log_odds >= _log_odds(OCCUPIED_THRESHOLD)

    def likely(self) -> NDArray[np.bool_]:
        """Cells that are rather occupied than free, (height, width)."""
        return self.log_odds > 0.0

    def likely_at(self, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which of the flat cells (K,) are rather occupied than free, (K,)."""
        return self.log_odds.reshape(-1)[cells] > 0.0

    def states(self) -> NDArray[np.int8]:
        """100 occupied, 0 free, -1 unknown, (height, width)."""
        states = np.full(self.log_odds.shape, UNKNOWN, np.int8)
        states[self.log_odds <= _log_odds(FREE_THRESHOLD)] = FREE
        states[self.occupied()] = OCCUPIED
        return states

    def wall_points(self) -> FloatArray:
        """Mean hit of every occupied cell, (N, 2) [m] in the map."""
        cells = np.argwhere(self.occupied())
        centres = (cells[:, ::-1].astype(np.float64) + 0.5) * self.geometry.resolution
        return self.geometry.T_map_grid.transform(centres + self.hit_offset[cells[:, 0], cells[:, 1]])

    def frozen_copy(self) -> OccupancyGrid:
        """A copy whose arrays cannot be written."""
        arrays = [array.copy() for array in (self.log_odds, self.hit_count, self.hit_offset)]
        for array in arrays:
            array.setflags(write=False)
        return OccupancyGrid(self.geometry, *arrays)


def _log_odds(probability: float) -> float:
    return math.log(probability / (1.0 - probability))
