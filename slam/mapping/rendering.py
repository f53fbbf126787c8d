"""One map from many submaps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slam.errors import MapTooLargeError
from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.kernels import composition
from slam.mapping.compact_grid import STEP, CompactGrid
from slam.mapping.submap import Submap
from slam.se2 import SE2, FloatArray


def render(submaps: Sequence[Submap], resolution: float) -> OccupancyGrid:
    """The submaps laid over one another; `T_map_grid` has no rotation and lies on the lattice of the cells.

    Free space is taken cell by cell, walls hit by hit, so that they keep their place below the cell size.
    """
    packed = [(submap.T_map_submap, submap.compact()) for submap in submaps]
    grid = _blank(packed, resolution)
    T_grid_map = grid.geometry.T_map_grid.inverse()
    for T_map_submap, compact in packed:
        T_grid_corner = T_grid_map @ T_map_submap @ compact.geometry.T_map_grid
        composition.gather_free(grid.log_odds, compact.free_steps(), T_grid_corner.as_array(), resolution, STEP)
    for T_map_submap, compact in packed:
        points = (T_grid_map @ T_map_submap).transform(compact.hits())
        cells = (grid.log_odds, grid.hit_count, grid.hit_offset)
        composition.splat_hits(cells, points, compact.counts.astype(np.float64), compact.log_odds_of_hits(), resolution)
    np.clip(grid.log_odds, -LOG_ODDS_LIMIT, LOG_ODDS_LIMIT, out=grid.log_odds)
    return grid


def _blank(packed: Sequence[tuple[SE2, CompactGrid]], resolution: float) -> OccupancyGrid:
    """An unknown grid about all submaps, at least 8 m wide about the origin; of one cell where that would be too large."""
    corners = [np.array([[-4.0, -4.0], [4.0, 4.0]])] + [_corners(pose, compact) for pose, compact in packed]
    points = np.concatenate(corners)
    low, high = np.floor(points.min(axis=0) / resolution), np.ceil(points.max(axis=0) / resolution)
    width, height = (int(n) for n in high - low)
    try:
        geometry = GridGeometry(resolution, width, height, SE2(low[0] * resolution, low[1] * resolution))
    except MapTooLargeError:
        geometry = GridGeometry(resolution, 1, 1)
    return OccupancyGrid.empty(geometry)


def _corners(T_map_submap: SE2, compact: CompactGrid) -> FloatArray:
    g = compact.geometry
    u, v = g.width * g.resolution, g.height * g.resolution
    return (T_map_submap @ g.T_map_grid).transform(np.array([[0.0, 0.0], [u, 0.0], [0.0, v], [u, v]]))
