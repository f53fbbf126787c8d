"""Ways over a costmap: all of them at once, or one to a goal, straight where that costs no more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.kernels import grid_search
from slam.navigation.costmap import Costmap
from slam.se2 import FloatArray

LONGEST_STRETCH = 120
"""Cells of a way that are straightened at once."""
ESCAPE = 0.25
"""From a place where it does not fit the robot may go so far to one where it does [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """The cheapest ways from one place to all others."""

    costmap: Costmap
    start: int
    """Flat cell that they begin in."""
    lengths: FloatArray
    """(H, W) what they cost [cells]; inf where there is none."""
    before: NDArray[np.int64]
    """(H, W) flat cell before each."""

    def to(self, cell: int) -> FloatArray | None:
        """Corners (N, 2) [m] of the way to a flat cell, the middles of both end cells included; None where there is none."""
        if cell < 0 or not np.isfinite(self.lengths.flat[cell]):
            return None
        way = grid_search.way_to(self.before, cell)
        corners = grid_search.straighten(self.costmap.costs, self.lengths, way, LONGEST_STRETCH)
        width = self.costmap.geometry.width
        return self.costmap.geometry.to_points(np.column_stack([corners // width, corners % width]))

    def length_to(self, cell: int) -> float:
        """What the way to a flat cell costs [m]; inf where there is none."""
        return float(self.lengths.flat[cell]) * self.costmap.geometry.resolution if cell >= 0 else np.inf


def ways_from(costmap: Costmap, start: tuple[float, float]) -> Ways:
    """All ways from a point [m]; none where that is not in the map."""
    return _search(costmap, _foothold(costmap, start), -1)


def plan(costmap: Costmap, start: tuple[float, float], goal: tuple[float, float]) -> FloatArray | None:
    """Corners (N, 2) [m] of a cheap way from point to point [m], the first in the start's cell; None where there is none."""
    cell = costmap.flat_cell(goal)
    if cell < 0 or not np.isfinite(costmap.costs.flat[cell]):
        return None
    return _search(costmap, _foothold(costmap, start), cell).to(cell)


def _search(costmap: Costmap, start: int, goal: int) -> Ways:
    if start < 0:
        shape = costmap.costs.shape
        return Ways(costmap, start, np.full(shape, np.inf), np.full(shape, -1, np.int64))
    return Ways(costmap, start, *grid_search.search(costmap.costs, start, goal))


def _foothold(costmap: Costmap, start: tuple[float, float]) -> int:
    """The start's cell, or where the robot does not fit there the nearest in which it does, if one is near; -1 outside the map."""
    cell = costmap.flat_cell(start)
    if cell < 0 or np.isfinite(costmap.costs.flat[cell]):
        return cell
    row, col = divmod(cell, costmap.geometry.width)
    reach = int(ESCAPE / costmap.geometry.resolution)
    top, left = max(row - reach, 0), max(col - reach, 0)
    near = np.argwhere(np.isfinite(costmap.costs[top : row + reach + 1, left : col + reach + 1])) + np.array([top, left])
    if len(near) == 0:
        return cell
    row, col = near[int(np.argmin(np.hypot(*(near - (row, col)).T)))].tolist()
    return row * costmap.geometry.width + col
