"""An explorer's map in bytes, kept up ray by ray, and the two views of it that an agent gets.

A cell is 0 while nothing is known of it, else 1 (free for certain) to 15 (occupied for certain); up to `FREEST` it counts as free.
Row and column of a place are those of its coordinates in the map; the map's origin is the corner of its middle cell.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.rolling_kernel import Pose, wrapped
from slam.kernels.jit import inlined, njit

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Counts = NDArray[np.int16]
Chart = tuple[Bytes, Counts, Bytes, Bytes]
"""Cells (SIDE, SIDE); free and occupied ones in each block (SIDE / BLOCK, SIDE / BLOCK, 2); how light the blocks look
(SIDE / BLOCK, SIDE / BLOCK); 1 for every cell that counts (SIDE, SIDE)."""

CELL = 0.05
"""[m]"""
SIDE = 1024
"""Cells to each side of the map: 51 m."""
HALF = SIDE // 2
BLOCK = 8
"""Cells to each side of a coarse cell."""
VIEW = 64
"""Cells to each side of a view: 3.2 m of fine cells, 25.6 m of coarse ones."""
FREEST, CERTAIN = 7, 15
FIRST_HIT, FIRST_MISS, HIT, MISS = 11, 6, 3, 1
TOUCHED = 0x80
"""Mark of the cells that the scan at hand has changed: each counts once."""
SHIFT = 20
FIXED = 1 << SHIFT
"""Of a cell, in whole numbers."""
UNKNOWN_GREY, FREE_GREY, WALL_GREY = 127, 255, 0
WALLS_IN_BLOCK = 6
"""Occupied cells that make a coarse cell look like a wall."""


@njit
def insert(chart: Chart, beams: tuple[Floats, Floats], poses: tuple[Pose, Pose], limits: tuple[float, float]) -> int:
    """Enter a scan: what the beams cross is free, where they end is not. Returns how many cells that count are new.

    Args:
        chart: changed.
        beams: ranges (N,) [m], inf for nothing in range; angles in the laser's frame (N,) [rad].
        poses: T_map_laser at the first and at the last beam; between them it moves evenly.
        limits: least and greatest range [m].
    """
    ranges, angles = beams
    (x0, y0, yaw0), (x1, y1, yaw1) = poses
    turn = wrapped(yaw1 - yaw0)
    count, k = len(ranges), 0
    ends = np.empty((count, 5))
    for i in range(count):
        r = ranges[i]
        if not r >= limits[0]:  # nan and -inf say nothing
            continue
        share = i / (count - 1.0)
        angle = yaw0 + share * turn + angles[i]
        length = min(r, limits[1])
        ends[k, 0], ends[k, 1] = (x0 + share * (x1 - x0)) / CELL + HALF, (y0 + share * (y1 - y0)) / CELL + HALF
        ends[k, 2], ends[k, 3] = ends[k, 0] + length / CELL * math.cos(angle), ends[k, 1] + length / CELL * math.sin(angle)
        ends[k, 4] = 1.0 if r <= limits[1] else 0.0
        k += 1
    touched = np.empty(_most_crossed(ends[:k]), np.int32)
    hit, crossed = _hit(chart, ends[:k], touched)
    count, new = _cross(chart, ends[:k], (touched, hit))
    flat = chart[0].reshape(-1)
    for i in range(count):
        flat[touched[i]] &= ~np.uint8(TOUCHED)
    return crossed + new


@inlined
def _most_crossed(ends: Floats) -> int:
    """More cells than these rays (N, 5) touch."""
    most = 0
    for i in range(len(ends)):
        most += int(abs(ends[i, 2] - ends[i, 0]) + abs(ends[i, 3] - ends[i, 1])) + 4
    return most


@inlined
def _hit(chart: Chart, ends: Floats, touched: NDArray[np.int32]) -> tuple[int, int]:
    """Raise the cells in which rays end at something; returns how many were touched, and how many that count are new."""
    cells, _, _, counting = chart
    n, fresh = 0, 0
    for i in range(len(ends)):
        col, row = int(np.floor(ends[i, 2])), int(np.floor(ends[i, 3]))
        if ends[i, 4] == 0.0 or not (0 <= row < SIDE and 0 <= col < SIDE) or cells[row, col] & TOUCHED:
            continue
        old = cells[row, col]
        new = min(old + HIT, CERTAIN) if old else FIRST_HIT
        if old == 0 or (old > FREEST) != (new > FREEST):
            _count(chart, row, col, (old, new))
        fresh += counting[row, col] if old == 0 else 0
        cells[row, col] = new | TOUCHED
        touched[n] = row * SIDE + col
        n += 1
    return n, fresh


@inlined
def _cross(chart: Chart, ends: Floats, touched: tuple[NDArray[np.int32], int]) -> tuple[int, int]:
    """Lower the cells that rays cross before they end; returns how many are touched by now, and how many that count are new.

    A ray is followed from row to row, or from column to column where it is flat, in numbers of `FIXED` to a cell.
    """
    cells, counting = chart[0].reshape(-1), chart[3]
    (marked, n), fresh = touched, 0
    for i in range(len(ends)):
        col, row, last_col, last_row = (
            int(np.floor(ends[i, 0])),
            int(np.floor(ends[i, 1])),
            int(np.floor(ends[i, 2])),
            int(np.floor(ends[i, 3])),
        )
        if min(row, col, last_row, last_col) < 0 or max(row, col, last_row, last_col) >= SIDE:
            continue
        steps = max(abs(last_col - col), abs(last_row - row))
        if steps == 0:
            continue
        x, y = int(ends[i, 0] * FIXED), int(ends[i, 1] * FIXED)
        dx, dy = int((ends[i, 2] - ends[i, 0]) * FIXED / steps), int((ends[i, 3] - ends[i, 1]) * FIXED / steps)
        for k in range(steps):
            row, col = (y + k * dy) >> SHIFT, (x + k * dx) >> SHIFT
            at = np.uint32(row * SIDE + col)  # unsigned: an index that cannot count from the end is faster
            old = cells[at]
            if old != 1 and old < TOUCHED:  # what is free for certain stays so however often it is crossed
                new = max(old - MISS, 1) if old else FIRST_MISS
                if old == 0 or (old > FREEST) != (new > FREEST):
                    _count(chart, row, col, (old, new))
                    fresh += counting[row, col] if old == 0 else 0
                cells[at] = new | TOUCHED
                marked[n] = at
                n += 1
    return n, fresh


@inlined
def _count(chart: Chart, row: int, col: int, change: tuple[int, int]) -> None:
    """Enter that a cell has become free or occupied."""
    old, new = change
    i, k = row // BLOCK, col // BLOCK
    block = chart[1][i, k]
    if old:
        block[0 if old <= FREEST else 1] -= 1
    block[0 if new <= FREEST else 1] += 1
    light = min(UNKNOWN_GREY + 2 * int(block[0]), FREE_GREY)
    chart[2][i, k] = light * (WALLS_IN_BLOCK - min(int(block[1]), WALLS_IN_BLOCK)) // WALLS_IN_BLOCK


@njit
def close_up(cells: Bytes, pose: Pose, seen: Bytes) -> None:
    """What lies around the robot: grey values into `seen` (VIEW, VIEW), the robot in the middle, ahead of it above.

    Args:
        cells: see `Chart`.
        pose: T_map_base.
        seen: written.
    """
    _sample(cells, (pose[0] / CELL + HALF, pose[1] / CELL + HALF, pose[2]), seen)
    flat = seen.reshape(-1)
    for i in range(len(flat)):
        flat[i] = UNKNOWN_GREY if flat[i] == 0 else FREE_GREY if flat[i] <= FREEST else WALL_GREY


@njit
def overview(blocks: Bytes, pose: Pose, seen: Bytes) -> None:
    """What lies far around the robot: as `close_up`, in blocks of cells, lighter the more of a block is known to be free."""
    _sample(blocks, ((pose[0] / CELL + HALF) / BLOCK, (pose[1] / CELL + HALF) / BLOCK, pose[2]), seen)


@inlined
def _sample(values: Bytes, pose: Pose, seen: Bytes) -> None:
    """Values (N, N) about a pose, x and y in cells, into `seen` (VIEW, VIEW); at the border those there repeat.

    First where a row's values are, for four of them at once, then the values.
    """
    ux, uy, limit = int(math.cos(pose[2]) * FIXED), int(math.sin(pose[2]) * FIXED), len(values) - 1
    flat, width, shift = values.reshape(-1), np.uint64(len(values)), np.uint64(SHIFT + 1)
    inside = min(pose[0], pose[1]) > 0.75 * VIEW and max(pose[0], pose[1]) < limit - 0.75 * VIEW
    places = np.empty(VIEW, np.uint32)
    for i in range(VIEW):
        ahead, left = VIEW - 1 - 2 * i, VIEW - 1
        x = 2 * int(pose[0] * FIXED) + ahead * ux - left * uy
        y = 2 * int(pose[1] * FIXED) + ahead * uy + left * ux
        for k in range(VIEW):
            if inside:
                places[k] = (np.uint64(y - 2 * k * ux) >> shift) * width + (np.uint64(x + 2 * k * uy) >> shift)
            else:
                col, row = (x + 2 * k * uy) >> SHIFT + 1, (y - 2 * k * ux) >> SHIFT + 1
                places[k] = min(max(row, 0), limit) * len(values) + min(max(col, 0), limit)
        for k in range(VIEW):
            seen[i, k] = flat[places[k]]
