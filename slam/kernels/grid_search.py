"""Cheapest ways over a grid of costs, and the straight stretches that are as cheap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import inlined, njit

DIAGONAL = np.sqrt(2.0)
STEPS = np.array([(0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)])

Heap = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Keys and flat cells, the lowest key first."""


@njit
def search(costs: NDArray[np.float32], start: int, goal: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Costs (H, W) of the cheapest ways from a cell to all others in cells, inf where there is none, and the flat cell before each (H, W).

    A step costs its length times the mean of its cells' costs. With a goal it is A* with the octile distance (Hart, Nilsson, Raphael,
    "A formal basis for the heuristic determination of minimum cost paths", 1968) and ends there; with -1 it is Dijkstra's algorithm.

    Args:
        costs: (H, W) of a cell of way, 1 or above; inf where nobody may go. The start may be such a place.
        start: flat cell.
        goal: flat cell, or -1.
    """
    height, width = costs.shape
    lengths = np.full((height, width), np.inf)
    before = np.full((height, width), -1, np.int64)
    done = np.zeros((height, width), np.bool_)
    heap = (np.empty(4 * height * width + 16), np.empty(4 * height * width + 16, np.int64))
    lengths[start // width, start % width] = 0.0
    heap[0][0], heap[1][0] = 0.0, start
    size = 1
    while size > 0:
        cell = heap[1][0]
        size = _pop(heap, size)
        row, col = cell // width, cell % width
        if done[row, col]:
            continue
        done[row, col] = True
        if cell == goal:
            break
        here = costs[row, col] if np.isfinite(costs[row, col]) else 1.0
        for k in range(8):
            r, c = row + STEPS[k, 0], col + STEPS[k, 1]
            if not (0 <= r < height and 0 <= c < width) or done[r, c] or not np.isfinite(costs[r, c]):
                continue
            way = float(lengths[row, col] + 0.5 * (here + costs[r, c]) * (1.0 if k < 4 else DIAGONAL))
            if way < lengths[r, c] - 1e-9:
                lengths[r, c], before[r, c] = way, cell
                if size == len(heap[0]):
                    heap = (np.concatenate((heap[0], heap[0])), np.concatenate((heap[1], heap[1])))
                size = _push(heap, size, way + _octile(r, c, goal, width), r * width + c)
    return lengths, before


@inlined
def _octile(row: int, col: int, goal: int, width: int) -> float:
    if goal < 0:
        return 0.0
    rows, cols = abs(row - goal // width), abs(col - goal % width)
    return max(rows, cols) + (DIAGONAL - 1.0) * min(rows, cols)


@inlined
def _push(heap: Heap, size: int, key: float, cell: int) -> int:
    """Add an entry; returns the new size."""
    keys, cells = heap
    at = size
    while at > 0 and keys[(at - 1) // 2] > key:
        keys[at], cells[at] = keys[(at - 1) // 2], cells[(at - 1) // 2]
        at = (at - 1) // 2
    keys[at], cells[at] = key, cell
    return size + 1


@inlined
def _pop(heap: Heap, size: int) -> int:
    """Remove the lowest entry; returns the new size."""
    keys, cells = heap
    last = size - 1
    key, cell = keys[last], cells[last]
    at, below = 0, 1
    while below < last:
        if below + 1 < last and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[at], cells[at] = keys[below], cells[below]
        at, below = below, 2 * below + 1
    keys[at], cells[at] = key, cell
    return last


@njit
def way_to(before: NDArray[np.int64], goal: int) -> NDArray[np.int64]:
    """Flat cells (N,) of the way from the start of a search to a cell, both included; only the goal where there is none."""
    flat = before.reshape(-1)
    count, cell = 1, goal
    while flat[cell] >= 0:
        cell = flat[cell]
        count += 1
    way = np.empty(count, np.int64)
    cell = goal
    for i in range(count - 1, -1, -1):
        way[i] = cell
        cell = flat[cell]
    return way


@njit
def straighten(costs: NDArray[np.float32], lengths: NDArray[np.float64], way: NDArray[np.int64], longest: int) -> NDArray[np.int64]:
    """The corners (K,) of a way (N,) that are left when each stretch goes straight as far as that costs no more.

    Args:
        costs: (H, W) as in `search`.
        lengths: (H, W) of that search.
        way: flat cells.
        longest: most cells of the way in one stretch.
    """
    width = costs.shape[1]
    corners = np.empty(len(way), np.int64)
    corners[0], count, at = way[0], 1, 0
    while at < len(way) - 1:
        best = at + 1
        for k in range(at + 2, min(at + longest, len(way) - 1) + 1):
            by_cells = lengths[way[k] // width, way[k] % width] - lengths[way[at] // width, way[at] % width]
            if straight_cost(costs, way[at], way[k]) <= by_cells + 1e-6:
                best = k
        at = best
        corners[count] = way[at]
        count += 1
    return corners[:count]


@njit
def straight_cost(costs: NDArray[np.float32], start: int, goal: int) -> float:
    """Cost of the straight way between two flat cells, in cells; inf where it leads over a cell that nobody may enter."""
    width = costs.shape[1]
    row, col = float(start // width), float(start % width)
    rows, cols = goal // width - row, goal % width - col
    length = np.sqrt(rows * rows + cols * cols)
    count = max(int(np.ceil(2.0 * length)), 1)
    total = 0.0
    for i in range(1, count + 1):
        f = (i - 0.5) / count
        total += costs[int(np.rint(row + f * rows)), int(np.rint(col + f * cols))]
    return total * length / count
