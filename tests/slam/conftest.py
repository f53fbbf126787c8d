"""Walls to measure, and the maps that they make."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.se2 import SE2, FloatArray

URG_ANGLES = (np.arange(682) - 340) * math.tau / 1024


@dataclass(frozen=True)
class Walls:
    """Line segments (N, 4) [m] in the map."""

    segments: FloatArray

    def ranges(self, T_map_laser: SE2, angles: FloatArray = URG_ANGLES) -> FloatArray:
        """Distance along each beam (K,) [m]; inf where there is nothing."""
        bearing = T_map_laser.yaw + angles
        direction = np.column_stack([np.cos(bearing), np.sin(bearing)])
        start, along = self.segments[:, :2] - [T_map_laser.x, T_map_laser.y], self.segments[:, 2:] - self.segments[:, :2]
        across = direction[:, :1] * along[:, 1] - direction[:, 1:] * along[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
            share = (start[:, 0] * direction[:, 1:] - start[:, 1] * direction[:, :1]) / across
        distance[~((distance > 0.0) & (share >= 0.0) & (share <= 1.0))] = np.inf
        return distance.min(axis=1)

    def points(self, T_map_base: SE2, noise: FloatArray | float = 0.0, angles: FloatArray = URG_ANGLES) -> FloatArray:
        """Hits (M, 2) [m] in base of a laser at base, with this much added to each range."""
        ranges = self.ranges(T_map_base, angles)
        seen = np.isfinite(ranges)
        return (ranges + noise)[seen, None] * np.column_stack([np.cos(angles), np.sin(angles)])[seen]

    def samples(self) -> FloatArray:
        """Points (M, 2) [m] every millimetre along the walls."""
        steps = [np.linspace(0.0, 1.0, math.ceil(math.hypot(c - a, d - b) * 1000)) for a, b, c, d in self.segments]
        return np.vstack(
            [
                start + step[:, None] * (end - start)
                for step, start, end in zip(steps, self.segments[:, :2], self.segments[:, 2:], strict=True)
            ]
        )


def grid_of(points: FloatArray, geometry: GridGeometry) -> OccupancyGrid:
    """A map whose hits are these points (M, 2) [m]."""
    grid = OccupancyGrid.empty(geometry)
    cells = geometry.to_cells(points)
    inside = geometry.contains(cells)
    rows, cols = cells[inside].T
    offset = geometry.T_map_grid.inverse().transform(points[inside]) - (cells[inside][:, ::-1] + 0.5) * geometry.resolution
    np.add.at(grid.hit_count, (rows, cols), 1.0)
    np.add.at(grid.hit_offset, (rows, cols), offset)
    grid.log_odds[rows, cols] = LOG_ODDS_LIMIT
    grid.hit_offset[rows, cols] /= grid.hit_count[rows, cols][:, None]
    return grid


def box(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float, float, float]]:
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


@pytest.fixture(scope="session")
def make_grid() -> Callable[[FloatArray, GridGeometry], OccupancyGrid]:
    return grid_of


@pytest.fixture(scope="session")
def make_walls() -> Callable[[list[tuple[float, float, float, float]]], Walls]:
    return lambda segments: Walls(np.array(segments, dtype=np.float64))


@pytest.fixture(scope="session")
def room() -> Walls:
    """A room of 4 x 3 metres with a cupboard, about the origin."""
    return Walls(np.array([*box(-1.97, -1.46, 2.03, 1.54), *box(0.81, 0.62, 1.37, 1.12)]))
