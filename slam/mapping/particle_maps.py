"""The maps of all particles, in patches shared until one of them writes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slam.grid import LOG_ODDS_LIMIT, MOST_CELLS, GridGeometry, OccupancyGrid
from slam.kernels import patches as kernels
from slam.mapping.side_by_side import side_by_side
from slam.se2 import SE2, FloatArray

FIRST_PATCHES, FIRST_SIDE = 256, 8
RAYS = 230
"""Most rays of a scan that clear what they cross, evenly spread: finer ones cross the same cells."""
SIDE = kernels.SIDE


class ParticleMaps:
    """One grid for each of N particles; all have the same frame, `T_map_table` without rotation, and grow together."""

    def __init__(self, count: int, resolution: float, hit: float, miss: float) -> None:
        self.resolution = resolution
        self._update = (resolution, hit, miss, LOG_ODDS_LIMIT)
        side = 0.5 * FIRST_SIDE * SIDE * resolution
        self.corner = np.array([-side, -side])
        """Map position of the corner of the table's cell (0, 0) [m]."""
        self.tables: NDArray[np.int32] = np.full((count, FIRST_SIDE, FIRST_SIDE), -1, np.int32)
        """(N, TH, TW) number of each patch, -1 for none."""
        self.pool: kernels.Pool = _pool(FIRST_PATCHES)
        self._shares = np.zeros(FIRST_PATCHES, np.int32)
        self._free = np.arange(FIRST_PATCHES, dtype=np.int32)
        self._free_count = FIRST_PATCHES

    @property
    def patches(self) -> int:
        """Patches in use."""
        return len(self._shares) - self._free_count

    def insert(self, poses: FloatArray, points: FloatArray, origins: FloatArray) -> bool:
        """Draw a scan into every map at its particle's pose (N, 3); points and origins (M, 2) in base [m]. False: there is no room."""
        reach = float(np.sqrt(max(np.sum(points**2, axis=1).max(), np.sum(origins**2, axis=1).max())))
        centres = poses[:, :2] - self.corner
        shift = self._make_room(np.concatenate([centres - reach, centres + reach]))
        if shift is None:
            return False
        every, needed = math.ceil(len(points) / RAYS), (math.ceil(2.0 * reach / (SIDE * self.resolution)) + 1) ** 2
        placed = np.column_stack([centres + shift, poses[:, 2]])
        cloud = points, origins
        for table, pose in zip(self.tables, placed, strict=True):
            self._ensure(needed)
            store = self._shares, self._free, self._free_count
            self._free_count = kernels.claim(pose, cloud, every, table, self.pool, store, self.resolution)

        def draw(part: slice) -> None:
            for table, pose in zip(self.tables[part], placed[part], strict=True):
                kernels.insert(pose, cloud, every, table, self.pool, self._shares, self._update)

        side_by_side(draw, len(placed))
        return True

    def resample(self, parents: NDArray[np.int64]) -> None:
        """Particle n takes over the map of particle `parents[n]`."""
        tables = self.tables[parents].copy()
        shares = np.bincount(tables[tables >= 0], minlength=len(self._shares)).astype(np.int32)
        gone = np.flatnonzero((self._shares > 0) & (shares == 0))
        self._free[self._free_count : self._free_count + len(gone)] = gone
        self._free_count += len(gone)
        self.tables, self._shares = tables, shares

    def grid(self, particle: int) -> OccupancyGrid:
        """One particle's map."""
        height, width = (SIDE * n for n in self.tables.shape[1:])
        corner = SE2(float(self.corner[0]), float(self.corner[1]))
        grid = OccupancyGrid.empty(GridGeometry(self.resolution, width, height, corner))
        kernels.render(self.tables[particle], self.pool, (grid.log_odds, grid.hit_count, grid.hit_offset))
        return grid

    def _ensure(self, count: int) -> None:
        """Have at least `count` free patches."""
        if self._free_count >= count:
            return
        old = len(self._shares)
        new = max(2 * old, old + count)
        pool = _pool(new)
        for target, source in zip(pool, self.pool, strict=True):
            target[:old] = source
        free = np.empty(new, np.int32)
        free[: self._free_count] = self._free[: self._free_count]
        free[self._free_count : self._free_count + new - old] = np.arange(old, new)
        self._shares = np.concatenate([self._shares, np.zeros(new - old, np.int32)])
        self.pool, self._free, self._free_count = pool, free, self._free_count + new - old

    def _make_room(self, points: FloatArray) -> FloatArray | None:
        """Grow all tables so that points (K, 2) [m] of their frame lie inside; by how much the frame moves (2,) [m], None: too large."""
        size = SIDE * self.resolution
        cells = np.floor(points[:, ::-1] / size).astype(np.int64)
        shape = np.array(self.tables.shape[1:])
        low, high = np.minimum(cells.min(axis=0), 0), np.maximum(cells.max(axis=0) + 1, shape)
        if (low == 0).all() and (high == shape).all():
            return np.zeros(2)
        low, high = low - (low < 0), high + (high > shape)
        height, width = (int(n) for n in high - low)
        if height * width * SIDE**2 > MOST_CELLS:
            return None
        tables = np.full((len(self.tables), height, width), -1, np.int32)
        tables[:, -low[0] : shape[0] - low[0], -low[1] : shape[1] - low[1]] = self.tables
        shift = -low[::-1] * size
        self.tables, self.corner = tables, self.corner - shift
        return np.asarray(shift, np.float64)


def _pool(count: int) -> kernels.Pool:
    shape = (count, SIDE, SIDE)
    return np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros((*shape, 2), np.float32)
