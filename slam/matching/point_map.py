"""A scan as a small map, for matchers that match on maps."""

from __future__ import annotations

import numpy as np

from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.se2 import SE2, FloatArray

MARGIN = 0.7
"""Room around the points: as far as a surface is felt [m]."""


def point_map(points: FloatArray, resolution: float = 0.05) -> OccupancyGrid:
    """A grid whose hits are the points (N, 2) [m] that are finite; one empty cell without any."""
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        return OccupancyGrid.empty(GridGeometry(resolution, 1, 1))
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    width, height = (int(n) for n in np.ceil((high - low) / resolution))
    grid = OccupancyGrid.empty(GridGeometry(resolution, width, height, SE2(low[0], low[1])))
    cells = grid.geometry.to_cells(points)
    rows, cols = cells.T
    np.add.at(grid.hit_count, (rows, cols), 1.0)
    np.add.at(grid.hit_offset, (rows, cols), (points - grid.geometry.to_points(cells)).astype(np.float32))
    hit = grid.hit_count > 0.0
    grid.hit_offset[hit] /= grid.hit_count[hit][:, None]
    grid.log_odds[hit] = LOG_ODDS_LIMIT
    return grid
