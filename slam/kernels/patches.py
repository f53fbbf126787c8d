"""Maps in patches that particles share until one of them writes: copy on write.

A map is a table (TH, TW) of patch numbers, -1 for nothing known; a patch is `SIDE` x `SIDE` cells of the pool: log-odds, hit count, and
mean hit minus cell centre. Coordinates are in the table's frame: the corner of its cell (0, 0) is the origin.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.traversal import ray_through_cells

SHIFT = 5
SIDE = 1 << SHIFT
"""Cells along each side of a patch."""
MASK = SIDE - 1

Table = NDArray[np.int32]
Pool = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
"""Log-odds (P, SIDE, SIDE), hit count (P, SIDE, SIDE), mean hit minus cell centre (P, SIDE, SIDE, 2) [m]."""


@njit
def claim(
    pose: NDArray[np.float64],
    cloud: tuple[NDArray[np.float64], NDArray[np.float64]],
    every: int,
    table: Table,
    pool: Pool,
    store: tuple[NDArray[np.int32], NDArray[np.int32], int],
    resolution: float,
) -> int:
    """Make the patches that a scan enters the map's own: copy what is shared, begin what is new. Returns the free patches.

    Args:
        pose: x, y, yaw of base (3,).
        cloud: where each ray hits and where it starts, (M, 2) each, in base [m].
        every: one ray in so many is followed; of all others only the hit counts.
        table: the map; written.
        pool: written.
        store: maps that share each patch (P,), numbers of unused patches (P,) and how many they are: enough for all that rays enter.
        resolution: cell size [m].
    """
    shares, free, left = store
    size = resolution * SIDE
    cos, sin, x0, y0 = np.cos(pose[2]) / size, np.sin(pose[2]) / size, pose[0] / size, pose[1] / size
    points, origins = cloud
    for i in range(len(points)):
        x1, y1 = x0 + cos * points[i, 0] - sin * points[i, 1], y0 + sin * points[i, 0] + cos * points[i, 1]
        left = _own(table, (int(np.floor(y1)), int(np.floor(x1))), pool, shares, free, left)
        if i % every != 0:
            continue
        x, y = x0 + cos * origins[i, 0] - sin * origins[i, 1], y0 + sin * origins[i, 0] + cos * origins[i, 1]
        ray = ray_through_cells(x, y, x1 - x, y1 - y)
        row, col, next_x, next_y = ray[0], ray[1], ray[6], ray[7]
        for _ in range(ray[8]):
            left = _own(table, (row, col), pool, shares, free, left)
            if next_x < next_y:
                next_x += ray[4]
                col += ray[2]
            else:
                next_y += ray[5]
                row += ray[3]
    return left


@njit
def insert(
    pose: NDArray[np.float64],
    cloud: tuple[NDArray[np.float64], NDArray[np.float64]],
    every: int,
    table: Table,
    pool: Pool,
    shares: NDArray[np.int32],
    update: tuple[float, float, float, float],
) -> None:
    """Raise what rays hit and lower what they cross, in patches that are the map's own; maps may be written side by side.

    Args:
        pose: x, y, yaw of base (3,).
        cloud: where each ray hits and where it starts, (M, 2) each, in base [m].
        every: one ray in so many lowers what it crosses.
        table: the map, after `claim`.
        pool: written.
        shares: maps that share each patch (P,).
        update: cell size [m], log-odds of a hit, of a miss (negative), their limit.
    """
    log_odds, hits, offsets = pool
    resolution, hit, miss, limit = update
    cos, sin = np.cos(pose[2]) / resolution, np.sin(pose[2]) / resolution
    x0, y0 = pose[0] / resolution, pose[1] / resolution
    points, origins = cloud
    odds, miss, limit = log_odds.reshape(-1), np.float32(miss), np.float32(limit)
    for i in range(0, len(points), every):
        x, y = x0 + cos * origins[i, 0] - sin * origins[i, 1], y0 + sin * origins[i, 0] + cos * origins[i, 1]
        dx, dy = x0 + cos * points[i, 0] - sin * points[i, 1] - x, y0 + sin * points[i, 0] + cos * points[i, 1] - y
        row, col, step_x, step_y, delta_x, delta_y, next_x, next_y, count = ray_through_cells(x, y, dx, dy)
        patch, at_row, at_col = -1, -1, -1
        for _ in range(count):
            if row >> SHIFT != at_row or col >> SHIFT != at_col:
                at_row, at_col = row >> SHIFT, col >> SHIFT
                patch = _owned(table, at_row, at_col, shares)
            if patch >= 0:
                cell = np.uint64(patch * SIDE * SIDE + (row & MASK) * SIDE + (col & MASK))  # unsigned: no test for the end
                odds[cell] = max(odds[cell] + miss, -limit)
            if next_x < next_y:
                next_x += delta_x
                col += step_x
            else:
                next_y += delta_y
                row += step_y
    for i in range(len(points)):
        x, y = x0 + cos * points[i, 0] - sin * points[i, 1], y0 + sin * points[i, 0] + cos * points[i, 1]
        col, row = int(np.floor(x)), int(np.floor(y))
        patch, r, c = _owned(table, row >> SHIFT, col >> SHIFT, shares), row & MASK, col & MASK
        if patch < 0:
            continue
        if log_odds[patch, r, c] <= 0.0:  # what was free has forgotten its hits
            hits[patch, r, c] = 0.0
        log_odds[patch, r, c] = min(log_odds[patch, r, c] + hit, limit)
        hits[patch, r, c] += 1.0
        gain = 1.0 / hits[patch, r, c]
        offsets[patch, r, c, 0] += gain * ((x - col - 0.5) * resolution - offsets[patch, r, c, 0])
        offsets[patch, r, c, 1] += gain * ((y - row - 0.5) * resolution - offsets[patch, r, c, 1])


@njit
def _owned(table: Table, row: int, col: int, shares: NDArray[np.int32]) -> int:
    """A patch that is the map's own; -1 where there is none, as where rounding leads a ray round another side of a corner than `claim`."""
    if not (0 <= row < table.shape[0] and 0 <= col < table.shape[1]):
        return -1
    patch = table[row, col]
    return int(patch) if patch >= 0 and shares[patch] == 1 else -1


@njit
def _own(table: Table, at: tuple[int, int], pool: Pool, shares: NDArray[np.int32], free: NDArray[np.int32], left: int) -> int:
    """Make the patch at a row and a column of a map its own. Returns the free patches."""
    row, col = at
    if not (0 <= row < table.shape[0] and 0 <= col < table.shape[1]):
        return left
    old = table[row, col]
    if old >= 0 and shares[old] == 1:
        return left
    log_odds, hits, offsets = pool
    new = free[left - 1]
    if old >= 0:
        log_odds[new], hits[new], offsets[new] = log_odds[old], hits[old], offsets[old]
        shares[old] -= 1
    else:
        log_odds[new], hits[new], offsets[new] = 0.0, 0.0, 0.0
    shares[new] = 1
    table[row, col] = new
    return left - 1


@njit
def render(table: Table, pool: Pool, grid: Pool) -> None:
    """Copy a map into arrays of a plain grid: log-odds (H, W), hit count (H, W), mean hit minus cell centre (H, W, 2)."""
    for row in range(table.shape[0]):
        for col in range(table.shape[1]):
            patch = table[row, col]
            if patch >= 0:
                for r in range(SIDE):
                    for c in range(SIDE):
                        at = row * SIDE + r, col * SIDE + c
                        grid[0][at[0], at[1]] = pool[0][patch, r, c]
                        grid[1][at[0], at[1]] = pool[1][patch, r, c]
                        grid[2][at[0], at[1], 0] = pool[2][patch, r, c, 0]
                        grid[2][at[0], at[1], 1] = pool[2][patch, r, c, 1]
