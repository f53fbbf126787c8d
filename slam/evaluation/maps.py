"""How far a map is from the true walls, given as segments (M, 4) of x1, y1, x2, y2 [m] in the world."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.spatial import cKDTree

from slam.evaluation.visibility import sample_walls
from slam.grid import OccupancyGrid
from slam.se2 import SE2, FloatArray

REACH = 0.05
"""A wall counts as mapped where a wall point lies this near [m]."""


def wall_rms(grid: OccupancyGrid, segments: FloatArray, T_world_map: SE2) -> float:
    """Root mean square distance [m] of the map's wall points to the nearest true wall; nan without wall points or walls."""
    points = T_world_map.transform(grid.wall_points())
    if len(points) == 0 or len(segments) == 0:
        return float("nan")
    return float(np.sqrt(np.mean(distance_to_walls(points, segments) ** 2)))


def wall_recall(grid: OccupancyGrid, visible: FloatArray, T_world_map: SE2) -> float:
    """Share of the visible wall samples (K, 2), of `visible_walls`, that have a wall point within 5 cm; nan if nothing was visible."""
    points = T_world_map.transform(grid.wall_points())
    if len(visible) == 0:
        return float("nan")
    if len(points) == 0:
        return 0.0
    distance, _ = cKDTree(points).query(visible)
    return float(np.mean(distance <= REACH))


def iou(grid: OccupancyGrid, segments: FloatArray, visible: FloatArray, T_world_map: SE2) -> float:
    """Intersection over union of occupied cells, TP / (TP + FP + FN), with a tolerance of one cell (8 neighbours).

    TP: occupied cells with a true wall in or next to them; FP: the other occupied cells; FN: cells of *visible* wall
    without an occupied cell in or next to them. Without the tolerance, a wall on a cell border would be a coin toss.
    nan if there is neither an occupied cell nor a visible wall.
    """
    around = np.ones((3, 3), np.bool_)
    occupied = grid.occupied()
    walls = _rasterise(grid, sample_walls(segments), T_world_map)
    matched = int(np.count_nonzero(occupied & binary_dilation(walls, around)))
    missed = _rasterise(grid, visible, T_world_map) & ~binary_dilation(occupied, around)
    beyond = _cells_outside(grid, visible, T_world_map)
    union = int(np.count_nonzero(occupied)) + int(np.count_nonzero(missed)) + beyond
    return matched / union if union else float("nan")


def distance_to_walls(points: FloatArray, segments: FloatArray) -> FloatArray:
    """Distance (N,) [m] of points (N, 2) to the nearest of the segments (M, 4)."""
    nearest = np.full(len(points), np.inf)
    for segment in segments:
        offset, along = points - segment[:2], segment[2:] - segment[:2]
        length_squared = float(along @ along)
        fraction = np.clip(offset @ along / length_squared, 0.0, 1.0) if length_squared > 0.0 else np.zeros(len(points))
        nearest = np.minimum(nearest, np.linalg.norm(offset - fraction[:, None] * along, axis=1))
    return nearest


def _rasterise(grid: OccupancyGrid, points: FloatArray, T_world_map: SE2) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    cells = grid.geometry.to_cells(T_world_map.inverse().transform(points))
    inside = cells[grid.geometry.contains(cells)]
    mask = np.zeros((grid.geometry.height, grid.geometry.width), np.bool_)
    mask[inside[:, 0], inside[:, 1]] = True
    return mask


def _cells_outside(grid: OccupancyGrid, points: FloatArray, T_world_map: SE2) -> int:
    """Number of cells, beyond the grid's edge, that hold points: walls that a growing map never reached."""
    cells = grid.geometry.to_cells(T_world_map.inverse().transform(points))
    return len(np.unique(cells[~grid.geometry.contains(cells)], axis=0))
