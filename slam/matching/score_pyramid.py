"""What a hit at a cell speaks for a pose, and the best of that in ever larger blocks of cells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.errors import ParameterError, require_positive
from slam.grid import OccupancyGrid
from slam.kernels import score_tables as kernels
from slam.se2 import SE2, FloatArray

LEVELS = 5
"""Beyond the cells themselves: nodes of up to 2^5 cells."""
BORDER = 3 << (LEVELS - 1)
"""The widest block that a table looks at, 2^5 cells and a quarter to each side: what lies beyond such a border makes no difference."""


@dataclass(frozen=True, slots=True)
class Scores:
    """What a hit speaks for a pose, from 0 in a place known to be free to 1 on a surface."""

    resolution: float = 0.025
    """Cell size; that of a grid is divided until it is about this [m]."""
    sigma: float = 0.05
    """Width of the score exp(-d^2 / 2 sigma^2) about a surface [m]."""
    unknown: float = 0.6
    """Score where nothing is known: rays that end in the free space of a map speak against a pose, those that end beyond it do not."""

    def __post_init__(self) -> None:
        require_positive(self, "resolution", "sigma")
        if not 0.0 <= self.unknown < 1.0:
            raise ParameterError(self, "unknown", "0 or above and below 1")


@dataclass(frozen=True, slots=True, eq=False)
class ScorePyramid:
    """Score tables of one map or scan, made once and searched often."""

    tables: NDArray[np.uint8]
    """(L + 1, H, W) scores of the cells, 255 for 1, then the best of the 2 x 2, 6 x 6, 12 x 12, 24 x 24, ... cells from each cell on."""
    outside: int
    """Score of what is unknown, as all that is off the tables."""
    resolution: float
    """Cell size [m]."""
    T_map_grid: SE2
    """Pose of the corner of cell (0, 0)."""
    sigma: float
    """Width of the scores about a surface [m]."""

    @classmethod
    def of(cls, grid: OccupancyGrid, scores: Scores | None = None) -> ScorePyramid:
        """Tables of a map: its mean hits are the surfaces, what is rather free than occupied is free space."""
        s, geometry = scores or Scores(), grid.geometry
        finer = max(1, round(geometry.resolution / s.resolution))
        known = np.argwhere(grid.log_odds != 0.0)
        low, high = (known.min(axis=0), known.max(axis=0) + 1) if len(known) else (np.zeros(2, np.int64), np.ones(2, np.int64))
        part = grid.log_odds[low[0] : high[0], low[1] : high[1]]
        cells = np.argwhere(part > 0.0)
        offset = grid.hit_offset[low[0] : high[0], low[1] : high[1]][cells[:, 0], cells[:, 1]]
        points = ((cells[:, ::-1] + 0.5) + offset / geometry.resolution) * finer
        free = np.repeat(np.repeat(part < 0.0, finer, axis=0), finer, axis=1)
        corner = geometry.T_map_grid @ SE2(low[1] * geometry.resolution, low[0] * geometry.resolution)
        return _build(points, free, s, geometry.resolution / finer, corner)

    @classmethod
    def of_scan(cls, points: FloatArray, origins: FloatArray, scores: Scores | None = None) -> ScorePyramid:
        """Tables of one scan: hits (N, 2), seen from origins (N, 2), both in the frame that is searched [m]."""
        s = scores or Scores()
        seen = np.isfinite(points).all(axis=1)
        ends, starts = points[seen], origins[seen]
        both = np.concatenate([ends, starts, np.zeros((1, 2))])
        low = np.floor(both.min(axis=0) / s.resolution) - math.ceil(3.0 * s.sigma / s.resolution)
        size = np.ceil(both.max(axis=0) / s.resolution) + math.ceil(3.0 * s.sigma / s.resolution) - low
        free = np.zeros((int(size[1]), int(size[0])), np.bool_)
        ends, starts = ends / s.resolution - low, starts / s.resolution - low
        kernels.clear_rays(free, starts, ends)
        return _build(ends, free, s, s.resolution, SE2(low[0] * s.resolution, low[1] * s.resolution))


def _build(points: FloatArray, free: NDArray[np.bool_], scores: Scores, resolution: float, corner: SE2) -> ScorePyramid:
    """Tables of surface points (N, 2) x, y [cells] and free cells (h, w), within a border of the unknown."""
    outside = round(255.0 * scores.unknown)
    hits = np.zeros((free.shape[0] + 2 * BORDER, free.shape[1] + 2 * BORDER), np.uint8)
    kernels.splat(hits, points + BORDER, scores.sigma / resolution)
    cleared = np.zeros(hits.shape, np.bool_)
    cleared[BORDER:-BORDER, BORDER:-BORDER] = free
    tables = np.empty((LEVELS + 1, *hits.shape), np.uint8)
    tables[0] = np.where(cleared, hits, _beyond(outside)[hits])
    blocks = tables[0]
    for level in range(1, LEVELS + 1):
        half, smaller = 1 << (level - 1), blocks
        blocks = tables[1] if level == 1 else np.empty_like(hits)
        kernels.pool(smaller, blocks, half, outside)
        if level > 1:
            kernels.pool(blocks, tables[level], half, outside)
    T_map_grid = corner @ SE2(-BORDER * resolution, -BORDER * resolution)
    return ScorePyramid(tables, outside, resolution, T_map_grid, scores.sigma)


def _beyond(outside: int) -> NDArray[np.uint8]:
    """Scores (256,) of what is not known to be free: as high as on a surface, but no lower than outside."""
    return (outside + np.arange(256) * (255 - outside) / 255.0).round().astype(np.uint8)
