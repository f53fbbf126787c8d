"""Which part of a map is the world: the area where the robot can drive, and what it sees from there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from worlds.parts import FloatArray
from worlds.raster import HALF_DIAGONAL, Mask, components
from worlds.world import ROBOT_RADIUS

SIGHT = 1.0
"""How far free space beyond the places of the robot's middle belongs to the world [m]."""
ENCLOSING = 10.0
"""Where a map is open at its border, indoors is where walls stand within this distance [m] ..."""
ENCLOSED_DIRECTIONS = 6
"""... in so many of eight directions."""
FAR = 1 << 24
"""More steps than any picture has cells in a row."""
_DIRECTIONS = tuple((down, right) for down in (-1, 0, 1) for right in (-1, 0, 1) if (down, right) != (0, 0))

Cell = tuple[int, int]


def visible_area(free: Mask, cell: float, home: Cell) -> Mask:
    """Free cells of the area that holds the cell `home` (row, col), else of the largest, and a metre beyond; none without any place.

    Where that area runs out of the picture, only what is indoors counts, if anything is.
    """
    drivable = _drivable(free, cell, home)
    whole = _joined(free, drivable)
    if any(edge.any() for edge in (whole[0], whole[-1], whole[:, 0], whole[:, -1])):
        inside = free & _indoors(free, cell)
        rooms = _drivable(inside, cell, home)
        free, drivable = (inside, rooms) if rooms.any() else (free, drivable)
    return _joined(free & (distance(~drivable) * cell <= SIGHT), drivable)


def distance(mask: Mask) -> FloatArray:
    """How far each cell is from the nearest cell outside of the mask, or outside of the picture [cells]."""
    return ndimage.distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1]


def _drivable(free: Mask, cell: float, home: Cell) -> Mask:
    """Connected places of the robot's middle."""
    labels = components(distance(free) - HALF_DIAGONAL >= ROBOT_RADIUS / cell)
    sizes = np.bincount(labels.ravel(), minlength=2)
    inside = 0 <= home[0] < free.shape[0] and 0 <= home[1] < free.shape[1]
    label = (int(labels[home]) if inside else 0) or int(np.argmax(sizes[1:])) + 1
    return labels == label


def _joined(mask: Mask, seed: Mask) -> Mask:
    """Areas of a mask that hold a cell of the seed."""
    labels = components(mask)
    return np.isin(labels, np.unique(labels[seed & mask])) & mask


def _indoors(free: Mask, cell: float) -> Mask:
    """Where something stands near by in most directions."""
    blocked = np.zeros(free.shape, np.int8)
    for down, right in _DIRECTIONS:
        blocked += _steps_to_solid(free, down, right) <= ENCLOSING / (cell * math.hypot(down, right))
    return blocked >= ENCLOSED_DIRECTIONS


def _steps_to_solid(free: Mask, down: int, right: int) -> NDArray[np.int32]:
    """Steps to the first cell that is not free in one direction; a great many where there is none."""
    if down == 0:
        return _steps_to_solid(free.T, right, 0).T
    steps = np.zeros(free.shape, np.int32)
    before = np.full(free.shape[1] + 2, FAR, np.int32)
    for row in range(len(free))[::-down]:
        steps[row] = np.where(free[row], before[1 + right : len(before) - 1 + right] + 1, 0)
        before[1:-1] = steps[row]
    return steps
