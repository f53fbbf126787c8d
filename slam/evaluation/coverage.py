"""How much of what a robot could see from where it can get its map knows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from slam.grid import FREE, OCCUPIED, OccupancyGrid
from slam.kernels import outlook
from slam.se2 import SE2

STRIDE = 4
"""Cells from one place to look from to the next, along both axes."""


def reachable_area(truth: OccupancyGrid, start: tuple[float, float], radius: float, reach: float) -> NDArray[np.bool_]:
    """Free cells (H, W) of a true map that are visible from some place to which a disc can be moved from a start.

    Args:
        truth: free, occupied and unknown cells.
        start: middle of the disc, in the true map's frame [m].
        radius: of the disc: the robot's with a margin [m].
        reach: of the lidar [m].
    """
    states, resolution = truth.states(), truth.geometry.resolution
    room = ndimage.distance_transform_edt(states != OCCUPIED) * resolution - 0.5 * resolution
    row, col = truth.geometry.to_cells(np.array([start]))[0]
    fits = (room >= radius) & (states == FREE)
    labels, _ = ndimage.label(fits, np.ones((3, 3)))
    if not labels[row, col]:  # the start may be tighter than the margin allows
        row, col = np.unravel_index(np.argmin(np.where(fits, _from(fits.shape, row, col), np.inf)), fits.shape)
    places = np.argwhere((labels == labels[row, col]) & (labels > 0))
    places = places[(places % STRIDE == 0).all(axis=1)]
    return outlook.visible(states == OCCUPIED, places, reach / resolution) & (states == FREE)


def coverage(grid: OccupancyGrid, truth: OccupancyGrid, area: NDArray[np.bool_], T_truth_map: SE2) -> float:
    """Share of the cells of an area (H, W) of the true map under whose middle a map knows something; nan for no area.

    Free or occupied: at a wall the two lattices differ by up to a cell, and how exact the walls are is told by other figures.
    """
    cells = np.argwhere(area)
    if len(cells) == 0:
        return float("nan")
    in_map = grid.geometry.to_cells(T_truth_map.inverse().transform(truth.geometry.to_points(cells)))
    inside = in_map[grid.geometry.contains(in_map)]
    return int(np.count_nonzero(grid.log_odds[inside[:, 0], inside[:, 1]])) / len(cells)


def _from(shape: tuple[int, ...], row: int, col: int) -> NDArray[np.float64]:
    rows, cols = np.ogrid[: shape[0], : shape[1]]
    return np.hypot(rows - row, cols - col)
