"""What lies between the robot and what it sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, ONE_SIDED, Field, X, Y

CLEAR = 0.15
"""A beam begins and ends at least so far from a wall that it has crossed: maps are bent, and noise lies behind walls [m]."""
STEEP = 0.3
"""Least component of a beam along a wall's normal: it may well graze what it does not cross."""


@njit
def pierced(origins: NDArray[np.float64], points: NDArray[np.float64], field: Field) -> NDArray[np.bool_]:
    """Which beams (M,) cross a surface that is known as a line, well before they end.

    Args:
        origins: (M, 2) where each beam begins, in the grid's frame [m].
        points: (M, 2) where it ends.
        field: of the map.
    """
    nearest, surfaces, resolution = field
    height, width = nearest.shape
    found = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        x0, y0 = origins[i, 0], origins[i, 1]
        dx, dy = points[i, 0] - x0, points[i, 1] - y0
        length = np.sqrt(dx * dx + dy * dy)
        if not length > 2.0 * CLEAR:
            continue
        dx, dy = dx / length, dy / length
        t = CLEAR
        while t < length - CLEAR:
            col, row = int(np.floor((x0 + t * dx) / resolution)), int(np.floor((y0 + t * dy) / resolution))
            t += 0.5 * resolution
            if not (0 <= row < height and 0 <= col < width) or nearest[row, col] != row * width + col:
                continue
            s = surfaces[row, col]
            along = s[NORMAL_X] * dx + s[NORMAL_Y] * dy
            if s[FLATNESS] > 0.0 and abs(along) > STEEP:
                crossing = (s[NORMAL_X] * (s[X] - x0) + s[NORMAL_Y] * (s[Y] - y0)) / along
                if CLEAR < crossing < length - CLEAR / abs(along):
                    found[i] = True
                    break
    return found


@njit
def from_behind(origins: NDArray[np.float64], points: NDArray[np.float64], field: Field, near: float) -> NDArray[np.bool_]:
    """Which hits (M,) lie within `near` [m] of a surface that the map knows from its other side only.

    Args:
        origins: (M, 2) where each beam begins, in the grid's frame [m].
        points: (M, 2) where it ends.
        field: of the map.
        near: [m]
    """
    nearest, surfaces, resolution = field
    height, width = nearest.shape
    found = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        col, row = int(np.floor(x / resolution)), int(np.floor(y / resolution))
        if not (0 <= row < height and 0 <= col < width) or nearest[row, col] < 0:
            continue
        s = surfaces[nearest[row, col] // width, nearest[row, col] % width]
        away = s[NORMAL_X] * (x - origins[i, 0]) + s[NORMAL_Y] * (y - origins[i, 1]) > 0.0
        off = s[NORMAL_X] * (x - s[X]) + s[NORMAL_Y] * (y - s[Y])
        found[i] = s[FLATNESS] == ONE_SIDED and away and abs(off) < near
    return found


@njit
def screened(
    origin: NDArray[np.float64], points: NDArray[np.float64], walls: NDArray[np.float64], screens: NDArray[np.int64], near: float
) -> NDArray[np.bool_]:
    """Which points (K,) are hidden from an origin (2,) by a wall.

    Args:
        origin: x, y [m].
        points: (K, 2) [m].
        walls: (M, 4) as x1, y1, x2, y2 [m].
        screens: (K,) wall that is tried first for each point; afterwards the one that hides it.
        near: a wall hides what lies more than this behind it [m].
    """
    found = np.zeros(len(points), np.bool_)
    for k in range(len(points)):
        ray_x, ray_y = points[k, 0] - origin[0], points[k, 1] - origin[1]
        end = 1.0 - near / np.hypot(ray_x, ray_y)
        for turn in range(-1, len(walls)):
            m = screens[k] if turn < 0 else turn
            start_x, start_y = walls[m, 0] - origin[0], walls[m, 1] - origin[1]
            along_x, along_y = walls[m, 2] - walls[m, 0], walls[m, 3] - walls[m, 1]
            denominator = ray_x * along_y - ray_y * along_x
            if denominator == 0.0:
                continue
            on_ray = (start_x * along_y - start_y * along_x) / denominator
            on_wall = (start_x * ray_y - start_y * ray_x) / denominator
            if 0.0 < on_ray < end and 0.0 <= on_wall <= 1.0:
                found[k], screens[k] = True, m
                break
    return found
