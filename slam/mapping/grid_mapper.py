"""Insertion of deskewed scans into an occupancy grid that grows, with its surface field kept in step."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.errors import MapTooLargeError, require_not_negative, require_positive
from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.kernels import insertion
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2, FloatArray

_log = logging.getLogger(__name__)

FULL = "the map would be too large"
"""Reason of an estimate whose scan had no room in the map."""


@dataclass(frozen=True, slots=True)
class MapSettings:
    """How a scan changes the map."""

    resolution: float = 0.05
    """Cell size [m]."""
    fixed_size: float = 0.0
    """Side of a fixed square map centred on the map's origin [m], such as 20; 0 lets the map grow."""
    hit: float = 0.5
    """Log-odds added to a cell that is hit (p = 0.62)."""
    miss: float = -0.2
    """Log-odds added to a cell that a ray crosses (p = 0.45)."""
    merge: float = 0.1
    """A hit this near to a known line belongs to it [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "resolution", "hit", "merge")
        require_not_negative(self, "fixed_size")


class GridMapper:
    """A map in the making: `T_map_grid` has no rotation."""

    def __init__(self, settings: MapSettings, grid: OccupancyGrid | None = None, facing: NDArray[np.float32] | None = None) -> None:
        """A blank map, or one to go on with; `facing` (H, W, 2) is that of its surface field, where it is known."""
        self.settings = settings
        self.grid = grid or _blank(settings)
        self.field = SurfaceField(self.grid, facing=facing)
        self._touched = np.zeros(self.grid.log_odds.shape, np.uint8)
        self._frozen: OccupancyGrid | None = None
        self.full = False
        """The last scan had no room: with it the map would have been too large. It stays as it was."""

    def snapshot(self) -> OccupancyGrid:
        """A read-only copy of the map, made once per change."""
        if self._frozen is None:
            self._frozen = self.grid.frozen_copy()
        return self._frozen

    def insert(self, T_map_base: SE2, points: FloatArray, origins: FloatArray) -> None:
        """Insert hits `points` (M, 2) seen from `origins` (M, 2), both in base [m]."""
        if len(points) == 0:
            return
        T_map_points = T_map_base.transform(points)
        self.full = not self.settings.fixed_size and not self._make_room(T_map_points)
        if not self.full:
            self._frozen = None
            self._insert(T_map_points, T_map_base.transform(origins))

    def _insert(self, T_map_points: FloatArray, T_map_origins: FloatArray) -> None:
        corner = np.array([self.grid.geometry.T_map_grid.x, self.grid.geometry.T_map_grid.y])
        ends, starts = T_map_points - corner, T_map_origins - corner
        grid, s = self.grid, self.settings
        cells = (grid.log_odds, grid.hit_count, grid.hit_offset, self.field.facing)
        field = (self.field.nearest, self.field.surfaces, s.resolution)
        hits, stops = insertion.insert_hits(starts, ends, field, cells, self._touched, (s.hit, LOG_ODDS_LIMIT, s.merge))
        misses = insertion.insert_misses(starts, stops, s.resolution, cells[:2], self._touched, (s.miss, LOG_ODDS_LIMIT))
        changed = np.concatenate([hits, misses])
        insertion.clear(self._touched, changed)
        self.field.update(grid, changed)
        around = self.field.with_neighbours(hits)
        self.field.update(grid, insertion.absorb(cells, field, around, s.merge))

    def _make_room(self, points: FloatArray) -> bool:
        """Grow the grid by at least a quarter where points fall outside. False: it would be too large, and stays."""
        old = self.grid.geometry
        cells = old.to_cells(points)
        low, high = np.minimum(cells.min(axis=0), 0), np.maximum(cells.max(axis=0) + 1, (old.height, old.width))
        size = np.array([old.height, old.width])
        if (low == 0).all() and (high == size).all():
            return True
        margin = np.maximum(size // 4, 40)
        low, high = low - margin * (low < 0), high + margin * (high > size)
        height, width = (int(n) for n in high - low)
        corner = SE2(old.T_map_grid.x + low[1] * old.resolution, old.T_map_grid.y + low[0] * old.resolution)
        try:
            geometry = GridGeometry(old.resolution, width, height, corner)
        except MapTooLargeError as error:
            if not self.full:
                _log.warning("the map stays as it is: %s", error)
            return False
        grid = OccupancyGrid.empty(geometry)
        shift = (int(-low[0]), int(-low[1]))
        window: tuple[slice, ...] = tuple(slice(start, start + n) for start, n in zip(shift, self.grid.log_odds.shape, strict=True))
        _copy_into(grid, self.grid, window)
        self.grid, self._touched = grid, np.zeros(grid.log_odds.shape, np.uint8)
        self.field.grow(grid, shift)
        return True


def _blank(settings: MapSettings) -> OccupancyGrid:
    side = settings.fixed_size or 8.0
    cells = math.ceil(side / settings.resolution)
    corner = SE2(-0.5 * cells * settings.resolution, -0.5 * cells * settings.resolution)
    return OccupancyGrid.empty(GridGeometry(settings.resolution, cells, cells, corner))


def _copy_into(target: OccupancyGrid, source: OccupancyGrid, window: tuple[slice, ...]) -> None:
    target.log_odds[window] = source.log_odds
    target.hit_count[window] = source.hit_count
    target.hit_offset[window] = source.hit_offset
