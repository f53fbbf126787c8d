"""What a lidar would see from everywhere in a known map, made once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.grid import FREE, OccupancyGrid
from slam.kernels import rays as ray_kernels
from slam.kernels import views as kernels
from slam.se2 import SE2, FloatArray

SPACING = 0.2
"""Distance between places [m]."""
BEARINGS = 90
"""Views from each place, and headings that are tried."""
REACH = 12.0
"""Farther walls are not told apart [m]; a scan's own reach may be less."""
Squares = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Panoramas:
    """Places on a lattice over the free space, and between which ranges the first wall lies in every direction."""

    places: FloatArray
    """(K, 2) middle of the free part of each place, in the grid's frame [m]."""
    nearest: NDArray[np.float32]
    """(K, B) least range [m] to something that is not known to be free, about the place and the bearing."""
    farthest: NDArray[np.float32]
    """(K, B) largest range to a wall [m]; at most `REACH`."""
    neighbours: NDArray[np.int64]
    """(K, 8) places around each; -1 where there is none."""
    closed: Squares
    """Of `rays.empty_squares`: all is a wall that is not known to be free."""
    walls: Squares
    """The same of the walls alone."""
    resolution: float
    """Of the grid's cells [m]."""
    T_map_grid: SE2

    @classmethod
    def of(cls, grid: OccupancyGrid) -> Panoramas:
        """Look around everywhere in a map."""
        free = grid.states() == FREE
        resolution = grid.geometry.resolution
        closed, walls = ray_kernels.empty_squares(~free), ray_kernels.empty_squares(grid.occupied())
        fine = _lattice(free, resolution)
        lens = (resolution, REACH)
        first, last = kernels.look_around((closed, walls), fine.reshape(-1, 2), kernels.FINE * BEARINGS, lens)
        least, largest = kernels.pool(first.reshape(*fine.shape[:2], -1), last.reshape(*fine.shape[:2], -1))
        middles = _middles(fine)
        there = np.isfinite(middles[:, :, 0])
        neighbours = _neighbours(there)
        return cls(middles[there], least[there], largest[there], neighbours, closed, walls, resolution, grid.geometry.T_map_grid)

    def pose(self, place: int, heading: int) -> SE2:
        """`T_grid_laser` of a place and a heading."""
        return SE2(float(self.places[place, 0]), float(self.places[place, 1]), heading * math.tau / BEARINGS)


def _lattice(free: NDArray[np.bool_], resolution: float) -> FloatArray:
    """Fine places (r, c, 2) x, y [m] in the grid's frame, from its corner on; nan where the cell is not free."""
    step = SPACING / kernels.FINE
    height, width = free.shape
    x, y = np.arange(0.5 * step, width * resolution, step), np.arange(0.5 * step, height * resolution, step)
    rows, cols = np.minimum((y / resolution).astype(np.int64), height - 1), np.minimum((x / resolution).astype(np.int64), width - 1)
    places = np.stack(np.meshgrid(x, y), axis=-1)
    places[~free[np.ix_(rows, cols)]] = np.nan
    return places


def _middles(fine: FloatArray) -> FloatArray:
    """(R, C, 2) mean of the fine places that belong to each place; nan where none does."""
    rows, cols = (fine.shape[0] + 1) // kernels.FINE, (fine.shape[1] + 1) // kernels.FINE
    sums, counts = np.zeros((rows, cols, 2)), np.zeros((rows, cols, 1))
    side = kernels.FINE // 2
    padded = np.full((kernels.FINE * rows + 2 * side, kernels.FINE * cols + 2 * side, 2), np.nan)
    padded[side : side + fine.shape[0], side : side + fine.shape[1]] = fine
    for i in range(2 * side + 1):
        for j in range(2 * side + 1):
            part = padded[i : i + kernels.FINE * rows : kernels.FINE, j : j + kernels.FINE * cols : kernels.FINE]
            there = np.isfinite(part[:, :, :1])
            sums += np.where(there, part, 0.0)
            counts += there
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _neighbours(there: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(K, 8) numbers of the places around each of a lattice (R, C)."""
    numbers = np.full((there.shape[0] + 2, there.shape[1] + 2), -1, np.int64)
    numbers[1:-1, 1:-1][there] = np.arange(int(there.sum()))
    rows, cols = np.nonzero(there)
    around = [(dr, dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1) if (dr, dc) != (0, 0)]
    return np.column_stack([numbers[rows + 1 + dr, cols + 1 + dc] for dr, dc in around])
