"""A world in cells: where something stands and how much room is left around each cell."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from worlds.parts import Cylinder, FloatArray, Point
from worlds.world import ROBOT_HEIGHT, ROBOT_RADIUS, World

Mask = NDArray[np.bool_]

HALF_DIAGONAL = math.sqrt(0.5)
"""Of a cell of side 1: what stands somewhere in a cell is that close to its middle."""
CERTIFICATE_CELL = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Raster:
    """Cells in rows of growing y; cell (row, col) has its middle at `corner + cell * (col, row)`."""

    cell: float
    """Side of a cell [m]."""
    corner: Point
    """Middle of cell (0, 0) [m]."""
    clearance: FloatArray
    """(height, width): room about the middle of each cell, never more than there is [m]; 0 or below where something may stand."""

    def cells(self, points: FloatArray) -> NDArray[np.int64]:
        """Cells (N, 2) as (row, col) that hold points (N, 2) [m]."""
        return np.rint((points - np.array(self.corner))[:, ::-1] / self.cell).astype(np.int64)

    def points(self, cells: NDArray[np.int64]) -> FloatArray:
        """Middles (N, 2) [m] of cells (N, 2) given as (row, col)."""
        return np.array(self.corner) + cells[:, ::-1].astype(np.float64) * self.cell

    def room_at(self, points: FloatArray) -> FloatArray:
        """Clearance (N,) [m] of the cells that hold points (N, 2) within the raster."""
        rows, cols = self.cells(points).T
        return self.clearance[rows, cols]

    def connected(self, radius: float, point: Point) -> Mask:
        """Cells (height, width) that a disc of `radius` [m] can be moved to from a point; none where it does not fit there."""
        labels = components(self.clearance >= radius)
        row, col = self.cells(np.array([point]))[0]
        return (labels == labels[row, col]) & (labels > 0)


def rasterise(world: World, cell: float, height: float = ROBOT_HEIGHT) -> Raster:
    """Raster of everything that stands lower than `height` [m], doors as they are at time 0; a ring of free cells lies around."""
    x0, y0, x1, y1 = world.bounds
    corner = np.array([x0, y0]) - 2 * cell
    solid = np.zeros((math.ceil((y1 - y0) / cell) + 5, math.ceil((x1 - x0) / cell) + 5), np.bool_)
    for thing in (*world.solids, *world.doors):
        if thing.z_span[0] >= height:
            continue
        if isinstance(thing, Cylinder):
            _fill_disc(solid, (np.array(thing.centre) - corner) / cell, thing.radius / cell)
        else:
            _fill(solid, (thing.footprint() - corner) / cell)
    distance = ndimage.distance_transform_edt(~solid)
    return Raster(cell, (float(corner[0]), float(corner[1])), (distance - HALF_DIAGONAL) * cell)


def components(mask: Mask) -> NDArray[np.int32]:
    """Number of the connected area that each cell is in, from 1 on; 0 outside the mask."""
    numbers = np.empty(mask.shape, np.int32)
    ndimage.label(mask, output=numbers)
    return numbers


def pockets(raster: Raster, start: Point, radius: float = ROBOT_RADIUS) -> tuple[Mask, Mask]:
    """Cells (height, width) where a robot fits and air gets to but not the robot from its start, and cells that it reaches.

    None of the first in cells of 2 cm certifies that all free space is reachable.
    """
    reached = raster.connected(radius, start)
    return raster.connected(0.0, start) & (raster.clearance >= radius) & ~reached, reached


def _fill(solid: Mask, polygon: FloatArray) -> None:
    """Mark the cells that a polygon, in cells, may touch."""
    low = np.maximum(np.floor(polygon.min(axis=0)).astype(int) - 1, 0)
    high = np.ceil(polygon.max(axis=0)).astype(int) + 2
    rows, cols = np.ogrid[low[1] : min(high[1], solid.shape[0]), low[0] : min(high[0], solid.shape[1])]
    inside = np.ones((rows.shape[0], cols.shape[1]), np.bool_)
    for (x, y), (dx, dy) in zip(polygon.tolist(), (np.roll(polygon, -1, axis=0) - polygon).tolist(), strict=True):
        inside &= dx * (rows - y) - dy * (cols - x) >= -HALF_DIAGONAL * math.hypot(dx, dy)
    solid[low[1] : high[1], low[0] : high[0]] |= inside


def _fill_disc(solid: Mask, centre: FloatArray, radius: float) -> None:
    """Mark the cells that a disc, in cells, may touch."""
    reach = radius + HALF_DIAGONAL
    low, high = np.maximum(np.ceil(centre - reach).astype(int), 0), np.floor(centre + reach).astype(int) + 1
    rows, cols = np.ogrid[low[1] : min(high[1], solid.shape[0]), low[0] : min(high[0], solid.shape[1])]
    solid[low[1] : high[1], low[0] : high[0]] |= np.square(cols - centre[0]) + np.square(rows - centre[1]) <= reach**2
